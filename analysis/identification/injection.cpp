#include "analysis/identification/injection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

namespace swarmcert::identification {
namespace {

constexpr int kInjections = 10, kMostMissed = 1;
constexpr double kResolution = 1.1;  ///< ratio of the last sizes tried
/// Blocks are merged until at most this many are left: the result depends on the scatter of the sums, not on the
/// division into blocks.
constexpr std::size_t kMostBlocks = 300;

Eigen::VectorXd packed_part(const Eigen::VectorXd& gram, const std::vector<int>& columns) {
  const auto n = static_cast<int>(columns.size());
  Eigen::VectorXd part(Eigen::Index(n) * (n + 1) / 2);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i <= j; ++i)
      part[Grams::packed(i, j)] =
          gram[Grams::packed(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)])];
  }
  return part;
}

/// Returns the columns of `members`, each with its theta, followed by those of candidate k with all of its thetas.
Grams reduced(const Grams& grams, const Members& members, std::size_t k) {
  Grams small;
  std::vector<int> columns;
  const auto take = [&](std::size_t candidate, const std::vector<int>& thetas) {
    const Candidate& from = grams.candidates[candidate];
    Candidate to = from;
    to.thetas.clear();
    small.first_column.emplace_back();
    small.support.emplace_back();
    for (const int theta : thetas) {
      const auto t = static_cast<std::size_t>(theta);
      to.thetas.push_back(from.thetas[t]);
      small.support.back().push_back(grams.support[candidate][t]);
      small.first_column.back().push_back(small.columns);
      for (int c = 0; c < from.columns(); ++c) columns.push_back(grams.first_column[candidate][t] + c);
      small.columns += from.columns();
    }
    small.candidates.push_back(std::move(to));
  };
  for (const Member& m : members) take(static_cast<std::size_t>(m.candidate), {m.theta});
  std::vector<int> thetas;
  for (int t = 0; t < static_cast<int>(grams.candidates[k].thetas.size()); ++t) thetas.push_back(t);
  take(k, thetas);
  const std::size_t together = (grams.blocks.size() + kMostBlocks - 1) / kMostBlocks;
  for (std::size_t i = 0; i < grams.blocks.size(); ++i) {
    const Block& block = grams.blocks[i];
    Block part;
    part.gram = packed_part(block.gram, columns);
    part.b.resize(small.columns);
    for (int c = 0; c < small.columns; ++c) part.b[c] = block.b[columns[static_cast<std::size_t>(c)]];
    part.y = block.y;
    part.records = block.records;
    part.flight = block.flight;
    if (i % together == 0) {
      small.blocks.push_back(std::move(part));
      continue;
    }
    Block& sum = small.blocks.back();
    sum.gram += part.gram;
    sum.b += part.b;
    sum.y += part.y;
    sum.records += part.records;
  }
  return small;
}

/// Injects effects into resampled blocks.
class Injector {
 public:
  Injector(const Grams& grams, const Members& members, std::size_t k)
      : base_(reduced(grams, members, k)), last_(static_cast<int>(members.size())) {
    for (int i = 0; i < last_; ++i) members_.push_back({i, 0});
  }

  /// Returns true if at least nine of ten injections of `size` are accepted.
  bool is_shown(int coefficient, double size, int theta) const {
    int missed = 0;
    std::mt19937_64 generator(1);
    for (int i = 0; i < kInjections; ++i) {
      // If the sign is free, inject both with and against the present value.
      const stability::Parameter& p =
          base_.candidates.back().info.linear[static_cast<std::size_t>(coefficient)];
      const bool negative = p.upper <= 0 || (p.lower < 0 && i % 2 == 1);
      const Grams injected = inject(theta, coefficient, negative ? -size : size, generator);
      const Selection selection(injected);
      if (!selection.is_acceptable(members_, selection.best_theta(members_, last_)) && ++missed > kMostMissed)
        return false;
    }
    return true;
  }

  /// Returns the factor of the column of a lag with gain 1 beside the members.
  double lag_factor() const {
    if (members_.empty()) return 1;
    const Eigen::VectorXd c = Selection(base_).coefficients(members_);
    std::vector<const Candidate*> effects;
    for (const Candidate& candidate : base_.candidates) effects.push_back(&candidate);
    double factor = 1;
    for (const ScaledStage& pair : scaled_stages(effects)) {
      if (pair.stage + 1 != effects.size() || pair.scale + 1 == effects.size()) continue;
      Eigen::Index at = 0;
      for (std::size_t i = 0; i < pair.scale; ++i) at += effects[i]->columns();
      factor += c[at] / effects[pair.stage]->scale;
    }
    return factor;
  }

  /// Returns thetas with enough samples, those closest to the effect's default first.
  std::vector<int> supported_thetas() const {
    const Thresholds thresholds;
    std::vector<int> thetas;
    const Candidate& candidate = base_.candidates.back();
    for (std::size_t t = 0; t < candidate.thetas.size(); ++t) {
      if (is_supported(base_, base_.candidates.size() - 1, t, thresholds.support_blocks, thresholds))
        thetas.push_back(static_cast<int>(t));
    }
    const auto distance = [&](int t) {
      double sum = 0;
      for (std::size_t i = 0; i < candidate.info.shape.size(); ++i) {
        const double own = candidate.info.shape[i].value;
        sum +=
            std::abs(candidate.thetas[static_cast<std::size_t>(t)][i] - own) / std::max(std::abs(own), 1e-3);
      }
      return sum;
    };
    std::stable_sort(thetas.begin(), thetas.end(), [&](int a, int b) { return distance(a) < distance(b); });
    return thetas;
  }

  /// Returns the size at which the energy of the column is `share` of the remainder, to start the search.
  double size_of_share(int coefficient, int theta, double share) const {
    const int column = base_.first_column.back()[static_cast<std::size_t>(theta)] + coefficient;
    double energy = 0, left = 0;
    for (const Block& block : base_.blocks) {
      energy += block.gram[Grams::packed(column, column)];
      left += block.y;
    }
    return energy > 0 ? std::sqrt(share * left / energy) : std::numeric_limits<double>::infinity();
  }

 private:
  Grams inject(int theta, int coefficient, double size, std::mt19937_64& generator) const {
    Grams injected;
    injected.candidates = base_.candidates;
    injected.first_column = base_.first_column;
    injected.support = base_.support;
    injected.columns = base_.columns;
    const int column = base_.first_column.back()[static_cast<std::size_t>(theta)] + coefficient;
    for (std::size_t i = 0; i < base_.blocks.size(); ++i) {
      Block block = base_.blocks[generator() % base_.blocks.size()];
      block.y += 2 * size * block.b[column] + size * size * block.gram[Grams::packed(column, column)];
      for (int c = 0; c < base_.columns; ++c) block.b[c] += size * block.gram[Grams::packed(c, column)];
      injected.blocks.push_back(std::move(block));
    }
    return injected;
  }

  const Grams base_;
  const int last_;
  Members members_;
};

/// Returns nothing if the flights appear to show the effect without any injection: the remainder looks like it, so no
/// size can be determined.
std::optional<double> smallest_size(const Injector& injector, const stability::Parameter& p, int coefficient,
                                    int theta) {
  constexpr int kMostDoublings = 60;
  if (injector.is_shown(coefficient, 0, theta)) return std::nullopt;
  const double largest = std::max(std::abs(p.lower), std::abs(p.upper));
  double lower = 0, upper = std::min(injector.size_of_share(coefficient, theta, 0.02), largest);
  if (!std::isfinite(upper)) return upper;
  for (int doublings = 0; !injector.is_shown(coefficient, upper, theta); ++doublings) {
    if (upper >= largest || doublings == kMostDoublings) return std::numeric_limits<double>::infinity();
    lower = upper;
    upper = std::min(2 * upper, largest);
  }
  if (lower == 0) {
    while (injector.is_shown(coefficient, upper / 2, theta)) upper /= 2;
    lower = upper / 2;
  }
  while (upper > kResolution * lower) {
    const double middle = std::sqrt(lower * upper);
    (injector.is_shown(coefficient, middle, theta) ? upper : lower) = middle;
  }
  return upper;
}

}  // namespace

std::vector<Detectable> detectable(const Grams& grams, const Members& members) {
  std::vector<Detectable> result;
  const Selection selection(grams);
  for (std::size_t k = 0; k < grams.candidates.size(); ++k) {
    const Candidate& candidate = grams.candidates[k];
    if (selection.is_present(members, static_cast<int>(k)) || !candidate.vehicles.empty()) continue;
    const Injector injector(grams, members, k);
    const std::vector<int> thetas = injector.supported_thetas();
    const double never = std::numeric_limits<double>::infinity();
    if (candidate.info.remembers) {
      // The gain is 1, so the size is the shortest detectable time.
      Detectable entry{
          candidate.info.name, candidate.info.shape[0].name, never, candidate.info.excitation, {}};
      std::vector<int> by_time = thetas;
      std::sort(by_time.begin(), by_time.end(), [&](int a, int b) {
        return candidate.thetas[static_cast<std::size_t>(a)][0] <
               candidate.thetas[static_cast<std::size_t>(b)][0];
      });
      const double factor = injector.lag_factor();
      for (const int theta : by_time) {
        if (!injector.is_shown(0, factor, theta)) continue;
        entry.size = candidate.thetas[static_cast<std::size_t>(theta)][0];
        break;
      }
      result.push_back(std::move(entry));
      continue;
    }
    for (int c = 0; c < candidate.columns(); ++c) {
      const stability::Parameter& p = candidate.info.linear[static_cast<std::size_t>(c)];
      Detectable entry{candidate.info.name, p.name, never, candidate.info.excitation, {}};
      if (!thetas.empty()) {
        const std::optional<double> size = smallest_size(injector, p, c, thetas[0]);
        if (!size) continue;
        entry.size = *size;
        for (std::size_t i = 0; i < candidate.info.shape.size(); ++i)
          entry.shape[candidate.info.shape[i].name] =
              candidate.thetas[static_cast<std::size_t>(thetas[0])][i];
      }
      result.push_back(std::move(entry));
    }
  }
  return result;
}

}  // namespace swarmcert::identification
