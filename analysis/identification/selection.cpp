#include "analysis/identification/selection.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "analysis/identification/covariance.h"
#include "nn/base/doubles.h"

namespace swarmcert::identification {
namespace {

constexpr double kClearly_z = 2;

double total_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

}  // namespace

bool is_supported(const Grams& grams, std::size_t candidate, std::size_t theta, std::size_t blocks,
                  const Thresholds& thresholds) {
  const Support& where = grams.support[candidate][theta];
  if (where.records >= thresholds.support_records && where.blocks >= blocks) return true;
  return telling_blocks(grams, candidate, theta) >= static_cast<double>(blocks);
}

int Selection::plain_of(stability::Family family) const {
  for (int k = 0; family != stability::Family::kNone && k < static_cast<int>(grams().candidates.size());
       ++k) {
    if (grams().candidates[static_cast<std::size_t>(k)].info.traits.is_plain(family)) return k;
  }
  return -1;
}

/// Flights differ in their thrust scale and in their heights, so only changes within flights can show a ceiling.
bool Selection::is_shown_within_flights(const Members& before, const Member& added) const {
  if (!candidate(added).info.traits.within_flights) return true;
  Members rest = before;
  const int scale = plain_of(stability::Family::kThrustScale);
  if (scale >= 0 && !is_present(before, scale)) rest.push_back({scale, 0});
  const Members after = with(rest, added);
  const Folds& folds = folds_for(after);
  return paired_z(trimmed_errors(rest, folds), trimmed_errors(after, folds)) >= kClearly_z;
}

std::vector<double> Selection::errors(const Members& members, const Folds& folds, bool trims) const {
  return trims ? trimmed_errors(members, folds) : block_errors(members, folds);
}

double Selection::loss_without(const Members& members, std::size_t index) const {
  const Folds& folds = folds_for(members);
  const Members rest = without(members, index);
  if (candidate(members[index]).info.remembers)
    return 1 - total_of(trimmed_errors(members, folds)) / total_of(trimmed_errors(rest, folds));
  return 1 - mean_square(members, folds) / mean_square(rest, folds);
}

bool Selection::is_held(const Members& members) const {
  if (!candidate(members.back()).info.remembers) return false;
  const Eigen::VectorXd c = in_model(members, coefficients(members));
  return std::abs(c[c.size() - 1] - 1) > 0.999 * kMemoryTolerance;
}

Members Selection::ordered(Members members) const {
  Members result;
  while (!members.empty()) {
    std::vector<double> squares;
    for (const Member& member : members) squares.push_back(mean_square(with(result, member)));
    const std::size_t best =
        static_cast<std::size_t>(std::min_element(squares.begin(), squares.end()) - squares.begin());
    result.push_back(members[best]);
    members = without(members, best);
  }
  return result;
}

Member Selection::best_theta(const Members& members, int which) const {
  Member best{which, 0};
  double least = kInfinity;
  bool best_is_held = true;
  const auto thetas = static_cast<int>(grams().candidates[static_cast<std::size_t>(which)].thetas.size());
  for (int t = 0; t < thetas; ++t) {
    const Member member{which, t};
    const Members after = with(members, member);
    // A neighbouring theta of a coarse grid may fit better with a gain at its bound, but that is not a lag.
    const bool held = is_held(after);
    if (held && !best_is_held) continue;
    const double square = mean_square(after);
    // Of thetas that differ only by round-off, use the first, which is the default.
    if (square < least * (1 - 1e-9) || (best_is_held && !held)) {
      least = square;
      best = member;
      best_is_held = held;
    }
  }
  return best;
}

bool Selection::is_acceptable(const Members& before, const Member& added) const {
  const Members after = with(before, added);
  const Folds& folds = folds_for(after);
  return is_acceptable(before, added, mean_square(before, folds), mean_square(after, folds), folds);
}

bool Selection::is_acceptable(const Members& before, const Member& added, double before_square,
                              double after_square, const Folds& folds) const {
  const Members after = with(before, added);
  const bool trims = candidate(added).info.remembers;
  if (!trims && !(after_square <= (1 - thresholds_.gain) * before_square)) return false;
  const std::vector<double> errors_before = errors(before, folds, trims),
                            errors_after = errors(after, folds, trims);
  if (trims) {
    before_square = total_of(errors_before);
    after_square = total_of(errors_after);
  }
  if (!(after_square <= (1 - thresholds_.gain) * before_square)) return false;
  const bool is_plain = after_square <= (1 - thresholds_.plain_gain) * before_square;
  const std::size_t blocks = is_plain ? thresholds_.plain_support_blocks : thresholds_.support_blocks;
  const auto k = static_cast<std::size_t>(added.candidate), t = static_cast<std::size_t>(added.theta);
  if (!is_supported(grams(), k, t, blocks, thresholds_)) return false;
  if (is_held(after) || !is_shown_within_flights(before, added)) return false;
  const double z = paired_z(errors_before, errors_after);
  return z >= thresholds_.paired_z || (z >= thresholds_.least_paired_z && wald(after) >= thresholds_.wald_z);
}

}  // namespace swarmcert::identification
