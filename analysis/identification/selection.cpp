#include "analysis/identification/selection.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "analysis/identification/covariance.h"
#include "analysis/identification/scan/formulas.h"
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

/// If the voltage falls little, its effect is a thrust scale; if speed or thrust vary little, any drag is linear; a
/// wake of slowly moving neighbours has no delay; and a load that never swings is a thrust scale. The plain form is
/// used unless the flights clearly show more.
int Selection::plain_form(int which) const {
  return plain_of(grams().candidates[static_cast<std::size_t>(which)].info.traits.reduces_to);
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

bool Selection::is_clearly_better(const Members& after, const Members& before) const {
  const Folds& folds = folds_for(after);
  return mean_square(after, folds) <= (1 - thresholds_.gain) * mean_square(before, folds) &&
         paired_z(block_errors(before, folds), block_errors(after, folds)) >= kClearly_z;
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

bool Selection::is_formula(const Member& member) const {
  return identification::is_formula(candidate(member).name);
}

bool Selection::formula_wins(const Members& rest, const Member& formula, const Member& named) const {
  constexpr double kMore = 1.125, kLess = 0.8;
  const Members by_formula = with(rest, formula), by_name = with(rest, named);
  const Folds& folds = folds_for(with(by_formula, named));
  const double before = mean_square(rest, folds);
  const double formula_left = mean_square(by_formula, folds), name_left = mean_square(by_name, folds);
  const bool is_more = before - formula_left > kMore * std::max(before - name_left, 0.0);
  return (is_more || formula_left < kLess * name_left) && is_clearly_better(by_formula, by_name);
}

bool Selection::is_held(const Members& members) const {
  if (!candidate(members.back()).info.remembers) return false;
  const Eigen::VectorXd c = in_model(members, coefficients(members));
  return std::abs(c[c.size() - 1] - 1) > 0.999 * kMemoryTolerance;
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

bool Selection::add_one(Members& members) const {
  struct Choice {
    Member member;
    const Folds* folds;
    double before, after;
    int parameters;
    double share() const { return after / before; }
  };
  std::vector<Choice> choices;
  for (int k = 0; k < static_cast<int>(grams().candidates.size()); ++k) {
    if (is_present(members, k)) continue;
    const Member member = best_theta(members, k);
    const Members after = with(members, member);
    const Folds& folds = folds_for(after);
    choices.push_back({member, &folds, mean_square(members, folds), mean_square(after, folds),
                       candidate(member).columns()});
  }
  std::stable_sort(choices.begin(), choices.end(),
                   [](const Choice& a, const Choice& b) { return a.share() < b.share(); });
  const auto accepts = [&](const Choice& c) {
    return is_acceptable(members, c.member, c.before, c.after, *c.folds);
  };
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (!accepts(choices[i])) continue;
    // Of equally good effects, choose the one with the fewest parameters.
    const Choice* best = &choices[i];
    for (std::size_t j = i + 1; j < choices.size(); ++j) {
      if (choices[j].share() - choices[i].share() > thresholds_.swap_gain) break;
      if (choices[j].parameters < best->parameters && accepts(choices[j])) best = &choices[j];
    }
    const int plain = plain_form(best->member.candidate);
    for (const Choice& choice : choices) {
      if (choice.member.candidate == plain && accepts(choice) &&
          !is_clearly_better(with(members, best->member), with(members, choice.member))) {
        best = &choice;
        break;
      }
    }
    const Choice* name = nullptr;
    if (is_formula(best->member)) {
      for (const Choice& choice : choices) {
        if (is_formula(choice.member) || !accepts(choice)) continue;
        name = &choice;
        break;
      }
    }
    if (name != nullptr && !formula_wins(members, best->member, name->member)) best = name;
    members.push_back(best->member);
    return true;
  }
  return false;
}

bool Selection::swap_one(Members& members) const {
  for (std::size_t i = 0; i < members.size(); ++i) {
    const Members rest = without(members, i);
    for (int k = 0; k < static_cast<int>(grams().candidates.size()); ++k) {
      if (is_present(rest, k)) continue;
      const Member member = best_theta(rest, k);
      if (member == members[i]) continue;
      const Members instead = with(rest, member);
      const Folds& folds = folds_for(with(instead, members[i]));
      const double now = mean_square(members, folds), then = mean_square(instead, folds);
      const bool retunes = k == members[i].candidate;
      if (plain_form(k) == members[i].candidate && !is_clearly_better(instead, members)) continue;
      if (is_formula(member) && !is_formula(members[i]) && !formula_wins(rest, member, members[i])) continue;
      const bool names_it =
          is_formula(members[i]) && !is_formula(member) && !formula_wins(rest, members[i], member);
      if ((names_it || then < (retunes ? 1 - 1e-6 : 1 - thresholds_.swap_gain) * now) &&
          is_acceptable(rest, member, mean_square(rest, folds), then, folds)) {
        members[i] = member;
        return true;
      }
    }
  }
  return false;
}

bool Selection::remove_one(Members& members) const {
  std::size_t least = members.size();
  double least_loss = thresholds_.removal_share * thresholds_.gain;
  for (std::size_t i = 0; i < members.size(); ++i) {
    const double loss = loss_without(members, i);
    if (loss >= least_loss) continue;
    least_loss = loss;
    least = i;
  }
  if (least == members.size()) return false;
  members = without(members, least);
  return true;
}

void Selection::prune(Members& members) const {
  while (remove_one(members)) {
  }
}

Members Selection::select(const std::vector<std::string>& names) const {
  Members members;
  if (!is_sound()) return members;
  for (const std::string& name : names) {
    for (int k = 0; k < static_cast<int>(grams().candidates.size()); ++k) {
      if (grams().candidates[static_cast<std::size_t>(k)].name != name || is_present(members, k)) continue;
      members.push_back(best_theta(members, k));
    }
  }
  constexpr std::size_t kMostEffects = 10;
  for (int round = 0; round < 20 && members.size() < kMostEffects; ++round) {
    if (!add_one(members)) break;
    for (int i = 0; i < 20 && swap_one(members); ++i) {
    }
    prune(members);
  }
  return ordered(members);
}

Members Selection::ordered(Members members) const {
  constexpr double kLocalShare = 0.25;
  // A shape without memory that is no share of all thrust: ground, jets, ...
  const auto is_local = [&](const Member& m) {
    const stability::EffectInfo& info = candidate(m).info;
    return !info.shape.empty() && !info.remembers && info.traits.family != stability::Family::kThrustScale;
  };
  Members result;
  while (!members.empty()) {
    const double before = mean_square(result);
    std::size_t best = 0, best_local = members.size();
    double least = kInfinity, least_local = kInfinity;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const double square = mean_square(with(result, members[i]));
      if (square < least) {
        least = square;
        best = i;
      }
      if (is_local(members[i]) && square < least_local) {
        least_local = square;
        best_local = i;
      }
    }
    if (before - least_local > kLocalShare * (before - least) && before > least_local) best = best_local;
    result.push_back(members[best]);
    members = without(members, best);
  }
  return result;
}

}  // namespace swarmcert::identification
