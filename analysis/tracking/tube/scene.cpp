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

double length(double x, double y, double z) {
  return sqrt(Interval(x) * Interval(x) + Interval(y) * Interval(y) + Interval(z) * Interval(z)).upper;
}

Interval widened(Interval x, double by) { return x + Interval(-by, by); }

template <class Compare>
bool every(const Radii& a, const Radii& b, const Compare& compare) {
  for (std::size_t i = 0; i < a.position_m.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!compare(a.position_m[i][k], b.position_m[i][k]) ||
          !compare(a.velocity_m_s[i][k], b.velocity_m_s[i][k])) {
        return false;
      }
    }
  }
  return true;
}

template <class Choose>
Radii each_of(const Radii& a, const Radii& b, const Choose& choose) {
  Radii result = a;
  for (std::size_t i = 0; i < a.position_m.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      result.position_m[i][k] = choose(a.position_m[i][k], b.position_m[i][k]);
      result.velocity_m_s[i][k] = choose(a.velocity_m_s[i][k], b.velocity_m_s[i][k]);
    }
  }
  return result;
}

}  // namespace

Radii Radii::none(int vehicles) {
  const std::vector<std::array<double, 3>> zero(static_cast<std::size_t>(vehicles), {0, 0, 0});
  return {zero, zero};
}

bool Radii::within(const Radii& other) const {
  return every(*this, other, [](double a, double b) { return a <= b; });
}

bool Radii::below(const Radii& other) const {
  return every(*this, other, [](double a, double b) { return a < b; });
}

Radii Radii::scaled(double factor, double more) const {
  Radii result = *this;
  for (auto* all : {&result.position_m, &result.velocity_m_s}) {
    for (auto& of_vehicle : *all) {
      for (double& x : of_vehicle) x = factor * x + more;
    }
  }
  return result;
}

double Radii::largest_position_m(int axis) const {
  double largest = 0;
  for (const auto& p : position_m) largest = std::max(largest, p[static_cast<std::size_t>(axis)]);
  return largest;
}

double Radii::largest_position_m() const {
  return std::max({largest_position_m(0), largest_position_m(1), largest_position_m(2)});
}

Radii smaller(const Radii& a, const Radii& b) {
  return each_of(a, b, [](double x, double y) { return std::min(x, y); });
}
Radii larger(const Radii& a, const Radii& b) {
  return each_of(a, b, [](double x, double y) { return std::max(x, y); });
}

Deviations all_within(const Radii& radii) {
  Deviations result(radii.position_m.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      result[i].position_m[k] = {-radii.position_m[i][k], radii.position_m[i][k]};
      result[i].velocity_m_s[k] = {-radii.velocity_m_s[i][k], radii.velocity_m_s[i][k]};
    }
  }
  return result;
}

void unite(TruthSizes& a, const TruthSizes& b) {
  for (std::size_t k = 0; k < 3; ++k) a.force_N[k] = hull(a.force_N[k], b.force_N[k]);
  a.rest_width_N = std::max(a.rest_width_N, b.rest_width_N);
  for (std::size_t n = 0; n < a.gradient_N_m.size(); ++n)
    a.gradient_N_m[n] = std::max(a.gradient_N_m[n], b.gradient_N_m[n]);
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
  lag_start_z_ = lag_start(loops_.axis[2], motion_.slice_s);
  // Vehicles start at their setpoints; the prediction is the truth plus the difference f_hat - f_a.
  const Deviations none = all_within(Radii::none(vehicles));
  for (int i = 0; i < vehicles; ++i) {
    const int first = motion_.stretch_of[static_cast<std::size_t>(i)].front();
    const Stretch& stretch = motion_.stretches[static_cast<std::size_t>(first)];
    const Interval prediction_N =
        ForceDifference(*this, stretch, none).over(none) + truth_sizes(stretch, none).force_N[2];
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

TruthForce::Rest Scene::rest(const Stretch& stretch, const Deviations& deviations,
                             double acceleration_m_s2) const {
  const std::vector<Interval> states = this->states(stretch, deviations);
  const Interval* const own = &states[states.size() - kOwnState];
  const Interval velocity[3] = {own[1], own[2], own[3]};
  // The thrust vector follows a first-order lag: |T'| <= |command - T| / tau.
  const double tau_s = motor_lag_s_.lower;
  const double thrust_rate_N_s =
      tau_s > 0 ? up(2 * tracking_.plant.largest_thrust_N / tau_s) : std::numeric_limits<double>::infinity();
  TruthForce::Rest rest = truth_.rest(widened(own[0], up(network_age_s_ * own[3].mag())), velocity,
                                      acceleration_m_s2, thrust_rate_N_s);
  if (residual_ == nullptr) return rest;
  const std::vector<Offset> reach = offsets(states, states);
  for (std::size_t k = 0; k < 3; ++k) {
    const Interval residual_N = residual_->over(reach, k);
    rest.force_N[k] += residual_N;
    rest.abrupt_N[k] = up(rest.abrupt_N[k] + up(residual_N.upper - residual_N.lower));
  }
  return rest;
}

TruthSizes Scene::truth_sizes(const Stretch& stretch, const Deviations& deviations) const {
  TruthSizes sizes;
  const std::vector<Interval> all = states(stretch, deviations);
  const TruthForce::Wake wake = truth_.wake(offsets(all, all));
  const TruthForce::Rest rest = this->rest(stretch, deviations, 0);
  sizes.force_N[0] = rest.force_N[0];
  sizes.force_N[1] = rest.force_N[1];
  sizes.force_N[2] = rest.force_N[2] + wake.value_N;
  sizes.rest_width_N = up(rest.force_N[2].upper - rest.force_N[2].lower);
  for (const Offset& g : wake.gradient_N_m) {
    sizes.gradient_N_m.push_back(wake.has_gradient ? length(g[0].mag(), g[1].mag(), g[2].mag())
                                                   : std::numeric_limits<double>::infinity());
  }
  return sizes;
}

std::vector<TruthSizes> Scene::truth_sizes(const Radii& radii) const {
  std::vector<TruthSizes> sizes;
  for (const Stretch& stretch : motion_.stretches) sizes.push_back(truth_sizes(stretch, all_within(radii)));
  return sizes;
}

std::array<ErrorHistory, 3> Scene::other_errors(int vehicle, const std::vector<TruthSizes>& truth) const {
  std::array<ErrorHistory, 3> result;
  const double mass_kg = tracking_.plant.mass_kg;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Signal feed_forward, force;
    for (const int s : motion_.stretch_of[static_cast<std::size_t>(vehicle)]) {
      const auto at = static_cast<std::size_t>(s);
      feed_forward.size.push_back(up(mass_kg * motion_.stretches[at].acceleration_m_s2[axis].mag()));
      feed_forward.rate.push_back(up(mass_kg * motion_.stretches[at].jerk_m_s3[axis].mag()));
      force.size.push_back(truth[at].force_N[axis].mag());
    }
    feed_forward.at_start = feed_forward.size.front();
    const ErrorLoop& loop = loops_.axis[axis];
    result[axis] = respond(loop, true, feed_forward);
    result[axis].add(respond(loop, true, force));
    if (axis < 2) result[axis].add(respond(loop, false, force));
    if (axis == 2 && loop.has_lag) result[axis].add(start_errors(vehicle));
    result[axis].add(estimate_answers_[axis].errors);
  }
  return result;
}

ErrorHistory Scene::start_errors(int vehicle) const {
  const Interval excess_N = excess_at_start_N(vehicle);
  ErrorHistory history;
  for (std::size_t n = 0; n < lag_start_z_.position_m.size(); ++n) {
    history.position_m.push_back((excess_N * lag_start_z_.position_m[n]).mag());
    history.velocity_m_s.push_back((excess_N * lag_start_z_.velocity_m_s[n]).mag());
  }
  return history;
}

LoopHistory Scene::in_slice(const Stretch& stretch, int slice, std::size_t axis, double force_N,
                            const TruthSizes& truth, double position_m, double velocity_m_s) const {
  LoopHistory history;
  history.position_m = position_m;
  history.velocity_m_s = velocity_m_s;
  history.truth_N = truth.force_N[axis].mag();
  history.force_N = axis == 2 ? force_N : history.truth_N;
  history.planned_m_s2 = stretch.acceleration_m_s2[axis].mag();
  history.jerk_m_s3 = stretch.jerk_m_s3[axis].mag();
  history.time_s = (slice + 1) * motion_.slice_s * (1 + 1e-12);
  const std::vector<double>& of_estimates_m_s2 = estimate_answers_[axis].acceleration_m_s2;
  if (!of_estimates_m_s2.empty())
    history.of_estimates_m_s2 = of_estimates_m_s2[static_cast<std::size_t>(slice)];
  return history;
}

double Scene::hold_error_N(int vehicle, std::size_t axis, const LoopHistory& history) const {
  const ErrorLoop& loop = loops_.axis[axis];
  const int first = motion_.stretch_of[static_cast<std::size_t>(vehicle)].front();
  const Stretch& stretch = motion_.stretches[static_cast<std::size_t>(first)];
  const double excess_N = axis == 2 && loop.has_lag ? excess_at_start_N(vehicle).mag() : 0;
  return analysis::hold_error_N(loop, history, stretch.acceleration_m_s2[axis].mag(), excess_N);
}

std::array<std::vector<double>, 3> Scene::hold_sizes_N(int vehicle, const Radii& radii,
                                                       const std::vector<double>& force_N,
                                                       const std::vector<TruthSizes>& truth) const {
  std::array<std::vector<double>, 3> sizes;
  const auto i = static_cast<std::size_t>(vehicle);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    LoopHistory history;
    for (int n = 0; n < motion_.slices; ++n) {
      const auto s = static_cast<std::size_t>(motion_.stretch_of[i][static_cast<std::size_t>(n)]);
      history.add(in_slice(motion_.stretches[s], n, axis, force_N[s], truth[s], radii.position_m[i][axis],
                           radii.velocity_m_s[i][axis]));
      sizes[axis].push_back(hold_error_N(vehicle, axis, history));
    }
  }
  return sizes;
}

std::array<ErrorHistory, 3> Scene::hold_errors(int vehicle, const Radii& radii,
                                               const std::vector<double>& force_N,
                                               const std::vector<TruthSizes>& truth) const {
  std::array<ErrorHistory, 3> result;
  const auto count = static_cast<std::size_t>(motion_.slices);
  if (!loops_.is_sampled()) {
    result.fill({std::vector<double>(count, 0.0), std::vector<double>(count, 0.0)});
    return result;
  }
  std::array<std::vector<double>, 3> sizes_N = hold_sizes_N(vehicle, radii, force_N, truth);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Signal signal;
    signal.size = std::move(sizes_N[axis]);
    result[axis] = respond(loops_.axis[axis], false, signal);
  }
  return result;
}

std::vector<double> Scene::by_slice(int vehicle, const std::vector<double>& by_stretch) const {
  std::vector<double> result;
  for (const int s : motion_.stretch_of[static_cast<std::size_t>(vehicle)])
    result.push_back(by_stretch[static_cast<std::size_t>(s)]);
  return result;
}

ErrorHistory Scene::errors_z(int vehicle, const std::vector<double>& force_N,
                             const ErrorHistory& other) const {
  Signal signal;
  signal.size = by_slice(vehicle, force_N);
  ErrorHistory result = respond(loops_.axis[2], false, signal);
  result.add(other);
  return result;
}

double Scene::position_deviation_m(const Radii& radii, int vehicle, int neighbour) const {
  const auto& a = radii.position_m[static_cast<std::size_t>(vehicle)];
  const auto& b = radii.position_m[static_cast<std::size_t>(neighbour)];
  return length(up(a[0] + b[0]), up(a[1] + b[1]), up(a[2] + b[2]));
}

double Scene::velocity_deviation_m_s(const Radii& radii, int vehicle, int neighbour) const {
  const auto& a = radii.velocity_m_s[static_cast<std::size_t>(vehicle)];
  const auto& b = radii.velocity_m_s[static_cast<std::size_t>(neighbour)];
  return length(up(a[0] + b[0]), up(a[1] + b[1]), up(a[2] + b[2]));
}

}  // namespace swarmcert::analysis
