#include "analysis/tracking/tube/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/tracking/tube/force_difference.h"

namespace swarmcert::analysis {

namespace {

/// Largest part of a lag interval, as the logarithm of the ratio of its ends. The errors within one part differ
/// little, and those of all parts are united.
constexpr double kLagPart = 0.05;
constexpr int kMostLagParts = 16;

Interval widened(Interval x, double by) { return x + Interval(-by, by); }

}  // namespace

double largest_position_m(const Deviations& deviations, int axis) {
  double largest_m = 0;
  for (const Deviation& one : deviations)
    largest_m = std::max(largest_m, one.position_m[static_cast<std::size_t>(axis)].mag());
  return largest_m;
}

double largest_position_m(const Deviations& deviations) {
  return std::max({largest_position_m(deviations, 0), largest_position_m(deviations, 1),
                   largest_position_m(deviations, 2)});
}

double network_age_s(const stability::Gains& gains, bool is_sampled) {
  double age_s = gains.network_latency_s;
  if (gains.network_rate_hz > 0) age_s = up(up(1 / gains.network_rate_hz) + age_s);
  if (is_sampled && gains.rate_hz > 0) age_s = up(up(1 / gains.rate_hz) + age_s);
  return age_s;
}

Scene::Scene(const stability::FlownLoop& tracking, const stability::Model& truth,
             const files::Network& network, const stability::Task& task, int vehicles, double network_age_s,
             double longest_slice_s, bool is_sampled, const EstimateErrors& estimates,
             const std::optional<Interval>& motor_lag_s, const ResidualEnvelope* residual)
    : tracking_(tracking),
      network_age_s_(network_age_s),
      residual_(residual),
      motor_lag_s_(motor_lag_s ? *motor_lag_s : Interval(tracking.gains.motor_lag_s)),
      learned_(network, tracking.model.kind, vehicles - 1),
      truth_(truth, tracking.plant.largest_thrust_N),
      motion_(sliced(task, vehicles, network_age_s,
                     is_sampled && tracking.gains.rate_hz > 0
                         ? whole_periods_s(task.duration_s(), 1 / tracking.gains.rate_hz, longest_slice_s)
                         : longest_slice_s,
                     is_sampled && tracking.gains.rate_hz > 0 ? up(1 / tracking.gains.rate_hz) : 0)),
      loops_(motion_.slices > 0
                 ? error_loops(tracking, motion_.slice_s, motion_.slices, is_sampled, motor_lag_s)
                 : ErrorLoops{}),
      estimates_(estimates),
      excess_N_(static_cast<std::size_t>(vehicles), Interval(0)) {
  if (!refusal().empty()) return;
  for (std::size_t k = 0; k < 3; ++k) {
    estimate_answers_[k] =
        analysis::estimate_answer(loops_.axis[k], estimates.velocity_m_s[k], estimates.position_m[k],
                                  static_cast<std::size_t>(motion_.slices));
  }
  add_lag_parts(is_sampled);
  if (!refusal().empty() || !loops_.axis[2].has_lag) return;
  // Vehicles start at their setpoints; the prediction is the truth plus the difference f_hat - f_a.
  const Deviations none(static_cast<std::size_t>(vehicles));
  for (int i = 0; i < vehicles; ++i) {
    const int first = motion_.stretch_of[static_cast<std::size_t>(i)].front();
    const Stretch& stretch = motion_.stretches[static_cast<std::size_t>(first)];
    const Interval prediction_N =
        ForceDifference(*this, stretch, none).over(none) + true_force_N(stretch, none)[2];
    excess_N_[static_cast<std::size_t>(i)] = hull(0, -prediction_N);
  }
}

void Scene::add_lag_parts(bool is_sampled) {
  const double low_s = motor_lag_s_.lower, high_s = motor_lag_s_.upper;
  const int count =
      has_lag_interval()
          ? std::clamp(static_cast<int>(std::ceil(std::log(high_s / low_s) / kLagPart)), 1, kMostLagParts)
          : 1;
  double from_s = low_s;
  for (int p = 1; p <= count; ++p) {
    const double to_s =
        p == count ? high_s : low_s * std::pow(high_s / low_s, static_cast<double>(p) / count);
    LagPart part;
    part.loops = count == 1 ? loops_
                            : error_loops(tracking_, motion_.slice_s, motion_.slices, is_sampled,
                                          Interval(from_s, to_s));
    // If there are kernels for the whole interval, there are kernels for each part, unless rounding decides otherwise.
    if (!part.loops.refusal.empty()) loops_.refusal = part.loops.refusal;
    if (part.loops.refusal.empty() && part.loops.axis[2].has_lag)
      part.start_z = lag_start(part.loops.axis[2], motion_.slice_s);
    lag_parts_.push_back(std::move(part));
    from_s = to_s;
  }
}

std::string Scene::refusal() const {
  if (motion_.slices == 0) return "the task's trajectories have no enclosure";
  return !truth_.refusal().empty() ? truth_.refusal() : loops_.refusal;
}

std::vector<Interval> Scene::states(const Stretch& stretch, const Deviations& deviations) const {
  std::vector<Interval> states = stretch.state;
  const Deviation& own = deviations[static_cast<std::size_t>(stretch.vehicle)];
  std::size_t at = 0;
  for (int n = 0; n + 1 < vehicles(); ++n) {
    const Deviation& other = deviations[static_cast<std::size_t>(neighbour(stretch.vehicle, n))];
    for (std::size_t k = 0; k < 3; ++k, ++at) states[at] += other.position_m[k] - own.position_m[k];
    for (std::size_t k = 0; k < 3; ++k, ++at) states[at] += other.velocity_m_s[k] - own.velocity_m_s[k];
  }
  states[at] += own.position_m[2];
  for (std::size_t k = 0; k < 3; ++k) states[at + 1 + k] += own.velocity_m_s[k];
  return states;
}

std::vector<Interval> Scene::seen_states(const Stretch& stretch, const Deviations& deviations) const {
  std::vector<Interval> states = this->states(stretch, deviations);
  if (estimates_.are_zero()) return states;
  std::size_t at = 0;
  for (int n = 0; n + 1 < vehicles(); ++n) {
    // The vehicle's own error plus that of its neighbour.
    for (std::size_t k = 0; k < 3; ++k, ++at) states[at] = widened(states[at], 2 * estimates_.position_m[k]);
    for (std::size_t k = 0; k < 3; ++k, ++at)
      states[at] = widened(states[at], 2 * estimates_.velocity_m_s[k]);
  }
  states[at] = widened(states[at], estimates_.position_m[2]);
  for (std::size_t k = 0; k < 3; ++k)
    states[at + 1 + k] = widened(states[at + 1 + k], estimates_.velocity_m_s[k]);
  return states;
}

std::vector<Offset> Scene::offsets(const std::vector<Interval>& states, const std::vector<Interval>& all,
                                   bool are_seen) const {
  std::vector<Offset> result;
  for (int n = 0; n + 1 < vehicles(); ++n) {
    const auto at = static_cast<std::size_t>(n * kPerNeighbour);
    Offset offset;
    for (std::size_t k = 0; k < 3; ++k) {
      const double aged_m = up(network_age_s_ * all[at + 3 + k].mag());
      offset[k] = widened(states[at + k], are_seen ? up(aged_m + 2 * estimates_.position_m[k]) : aged_m);
    }
    result.push_back(offset);
  }
  return result;
}

Forces_N Scene::without_wakes_N(const Stretch& stretch, const Deviations& deviations) const {
  const std::vector<Interval> states = this->states(stretch, deviations);
  const Interval* const own = &states[states.size() - kOwnState];
  Forces_N force_N =
      truth_.rest_N(widened(own[0], up(network_age_s_ * own[3].mag())), {own[1], own[2], own[3]});
  if (residual_ == nullptr) return force_N;
  const std::vector<Offset> reach = offsets(states, states);
  for (std::size_t k = 0; k < 3; ++k) force_N[k] += residual_->over(reach, k);
  return force_N;
}

Forces_N Scene::true_force_N(const Stretch& stretch, const Deviations& deviations) const {
  const std::vector<Interval> all = states(stretch, deviations);
  Forces_N force_N = without_wakes_N(stretch, deviations);
  force_N[2] += truth_.wake(offsets(all, all)).value_N;
  return force_N;
}

LoopHistory Scene::in_slice(int slice, double position_m, double velocity_m_s) const {
  return {position_m, velocity_m_s, (slice + 1) * motion_.slice_s * (1 + 1e-12)};
}

}  // namespace swarmcert::analysis
