#include "analysis/tracking/tube/force_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "nn/base/parallel.h"

namespace swarmcert::analysis {

namespace {

constexpr double kNoBound = std::numeric_limits<double>::infinity();

}  // namespace

bool Enclosure::prepare(const Radii& largest, const std::vector<TruthSizes>&) {
  const std::vector<Stretch>& stretches = scene_.motion().stretches;
  const int count = static_cast<int>(stretches.size());
  const Deviations deviations = all_within(largest);
  std::vector<std::optional<ForceDifference>> made(stretches.size());
  const auto is_cancelled = [this] { return options_.cancelled != nullptr && *options_.cancelled; };
  std::atomic<int> done{0};
  const auto advance = [&] {
    ++done;
    if (options_.progress) options_.progress(done, 2 * count);
  };
  files::parallel_for(count, options_.jobs, [&](int s) {
    if (is_cancelled()) return;
    const auto at = static_cast<std::size_t>(s);
    made[at].emplace(scene_, stretches[at], deviations);
    advance();
  });
  if (is_cancelled()) return false;
  double largest_N = 0;
  for (const auto& one : made) largest_N = std::max(largest_N, one->bound_N());
  files::parallel_for(count, options_.jobs, [&](int s) {
    made[static_cast<std::size_t>(s)]->refine(options_.boxes, options_.tolerance * largest_N,
                                              options_.cancelled);
    advance();
  });
  differences_.clear();
  for (auto& one : made) differences_.push_back(std::move(*one));
  return !is_cancelled();
}

std::vector<double> Enclosure::sizes(const Radii& radii) const {
  const Deviations deviations = all_within(radii);
  std::vector<double> result;
  for (const ForceDifference& one : differences_) result.push_back(one.over(deviations).mag());
  return result;
}

double slope_cost_N(const ForceConstants& c, double position_m, double velocity_m_s) {
  const auto times = [](double constant, double deviation) {
    return deviation == 0 ? 0 : up(constant * deviation);
  };
  const double apart = up(times(c.position, position_m) + times(c.velocity, velocity_m_s));
  const double length =
      sqrt(Interval(position_m) * Interval(position_m) + Interval(velocity_m_s) * Interval(velocity_m_s))
          .upper;
  return std::min(apart, times(c.together, length));
}

bool SlopeBound::prepare(const Radii&, const std::vector<TruthSizes>& truth) {
  truth_ = truth;
  return true;
}

std::vector<double> SlopeBound::sizes(const Radii& radii) const {
  std::vector<double> result;
  const std::vector<Stretch>& stretches = scene_.motion().stretches;
  for (std::size_t s = 0; s < stretches.size(); ++s) {
    const int i = stretches[s].vehicle;
    const ForceConstants& constants = constants_[static_cast<std::size_t>(i)];
    double size = up(at_set_points_[s] + truth_[s].rest_width_N);
    for (int n = 0; n + 1 < scene_.vehicles(); ++n) {
      const int j = Scene::neighbour(i, n);
      const double dp = scene_.position_deviation_m(radii, i, j);
      size = up(size + slope_cost_N(constants, dp, scene_.velocity_deviation_m_s(radii, i, j)));
      if (dp > 0) size = up(size + up(truth_[s].gradient_N_m[static_cast<std::size_t>(n)] * dp));
    }
    const auto& p = radii.position_m[static_cast<std::size_t>(i)];
    const auto& v = radii.velocity_m_s[static_cast<std::size_t>(i)];
    if (constants.own > 0) {
      const Interval own =
          sqrt(Interval(p[2]) * p[2] + Interval(v[0]) * v[0] + Interval(v[1]) * v[1] + Interval(v[2]) * v[2]);
      size = up(size + up(constants.own * own.upper));
    }
    result.push_back(std::isnan(size) ? kNoBound : size);
  }
  return result;
}

}  // namespace swarmcert::analysis
