#include "stability/bounds/tracking_bounds.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nn/base/doubles.h"
#include "stability/bounds/sampled_bounds.h"
#include "stability/bounds/thrust_ratio.h"
#include "stability/model.h"

namespace swarmcert::stability {
namespace {

constexpr double kPositionNoise_m = 1e-3;
constexpr double kVelocityNoise_m_s = 0.05;

bool same(const AxisLoop& a, const AxisLoop& b) {
  return a.mass_kg == b.mass_kg && a.Kp == b.Kp && a.Kd == b.Kd && a.Ki == b.Ki && a.lags_s == b.lags_s &&
         a.delay_s == b.delay_s;
}

AxisFacts facts_of(const Gains& gains, const AxisLoop& loop, const std::optional<SampledLoop>& sampled,
                   int axis, double bias_N) {
  AxisFacts facts;
  facts.axis = axis;
  facts.stable = is_stable(loop);
  facts.lag_floor = lag_floor(loop);
  facts.effort_gain = effort_gain(loop);
  facts.lag_limit_s = lag_limit(loop);
  facts.delay_limit_s = delay_limit(loop);
  facts.written_Ki = loop.Ki;
  facts.effective_Ki = sampled ? effective_Ki(*sampled) : loop.Ki;
  const double limit_m_s = gains.integrator_limit_m_s[static_cast<std::size_t>(axis)];
  facts.clamp_authority_N = loop.Ki > 0 ? loop.mass_kg * loop.Ki * limit_m_s : 0;
  facts.clamp_residual_m = clamp_residual(loop, bias_N, limit_m_s);
  if (sampled) {
    facts.spectral_radius = spectral_radius(*sampled);
    facts.noise = noise_deviation(*sampled, kPositionNoise_m, kVelocityNoise_m_s);
  }
  return facts;
}

void add_assumptions(const Gains& gains, const DisturbanceSource& source, TrackingReport& report) {
  const auto add = [&report](const std::string& name, const std::string& status, const std::string& note) {
    report.assumptions.push_back({name, status, note});
  };
  if (source.kind == "rate of f_hat") {
    add("rate of f_hat", "proved", "bounds the learned force, not its error: gives no ball");
  } else if (source.kind == "declared truth") {
    add("the force is that of the declared truth", "assumed", source.note);
    add("constants of the declared truth", "proved", "enclosed over the stated motions");
    if (source.f_hat_rate_known) add("rate of f_hat", "proved", "from the network's Lipschitz constant");
  } else if (source.kind != "none") {
    add("disturbance class", source.kind == "measured" ? "measured" : "assumed",
        source.kind + " numbers bound the learning error: " + source.note);
  }
  for (const std::string& assumption : source.further_assumptions) add(assumption, "assumed", "");
  if (source.thrust_ratio_error > 0) {
    add("mass as in the model; thrust ratio constant, within the declared error", "assumed",
        "the network's feedforward times that error belongs to the force error");
  } else {
    add("mass and thrust scale as in the model", "assumed", "--uncertain encloses intervals");
  }
  const bool has_thrust = report.thrust_margin_N && *report.thrust_margin_N >= 0;
  add("no saturation of the collective thrust",
      !has_thrust                 ? "assumed"
      : source.kind == "measured" ? "measured"
                                  : "proved",
      report.thrust_margin_N
          ? "under all declared disturbances, about hover, by the effort gain of the continuous loop"
          : "");
  if (source.has_moving_reference())
    add("the setpoint moves as declared", "assumed",
        "its acceleration is fed forward, and the actual force is the commanded force");
  if (source.has_estimate_errors()) {
    const bool is_measured = source.kind == "measured" && !source.declares_velocity_error;
    add("errors of the estimated position and velocity", is_measured ? "measured" : "assumed",
        is_measured ? "of the velocity, over the same windows" : "as declared");
  } else {
    add("exact position and velocity", "assumed",
        "--velocity-error and --position-error bound the effect of estimation errors");
  }
  if (source.bounds_learning_error() && !source.f_hat_rate_known &&
      (gains.network_rate_hz > 0 || gains.network_latency_s > 0)) {
    add("the learned force follows its inputs immediately", "assumed",
        "[network] makes it a staircase or late; --network NET --speed V bounds the effect");
  }
  if (gains.rate_hz > 0) {
    add("continuous position loop", "assumed", "not needed for rows named 'sampled'");
  }
  if (gains.motor_lag_s > 0 || gains.attitude_lag_s > 0 || gains.delay_s > 0) {
    add("first-order lags and a constant delay", "assumed", "as in [lag]");
  }
  if (gains.attitude_lag_s > 0) {
    add("attitude error small", "assumed", "the direction of thrust is treated as linear");
  }
}

double integrator_limit(const Gains& gains, int axis) {
  return gains.integrator_limit_m_s[static_cast<std::size_t>(axis)];
}

/// @param of_class disturbance_bounds() of the class alone.
template <class AnyLoop>
AxisBounds bounds_of(const AnyLoop& loop, DisturbanceBounds of_class, Channel channel, const GainNorms& gains,
                     const Disturbance& known, const OtherErrors& other, bool classes_contain_bias,
                     double limit_m_s) {
  AxisBounds row;
  row.channel = channel;
  row.bounds = of_class;
  row.parts = error_parts(loop, gains.edge, other);
  std::optional<ThrustRatioGains> ratio;
  if (other.thrust_ratio_error > 0) {
    ratio = thrust_ratio_gains(loop, channel, other.thrust_ratio_error);
    of_class = row.bounds = disturbance_bounds(*ratio, known);
    row.parts.thrust_ratio_m = thrust_ratio_part(*ratio, other, effort_N(loop, with_hover_share(other)));
  }
  row.bounds.add(row.parts.total_m());
  OtherErrors beside_amplitude = other;
  if (classes_contain_bias) {
    // A rate says nothing about the force at the start; a measured amplitude or impulse contains it.
    ErrorParts parts = row.parts;
    parts.bias_m = 0;
    row.bounds.by_amplitude = of_class.by_amplitude + parts.total_m();
    row.bounds.by_impulse = of_class.by_impulse + parts.total_m();
    // The edge bound per pass includes the first rise by the amplitude.
    if (known.variation_per_pass) row.bounds.by_edges = of_class.by_edges + parts.total_m();
    beside_amplitude.bias_N = beside_amplitude.start_N = 0;
  }
  row.clamp = clamp_bounds(loop, channel, known, beside_amplitude, limit_m_s);
  if (ratio) row.clamp = clamp_bounds(loop, channel, row.clamp, *ratio, known, beside_amplitude, limit_m_s);
  return row;
}

/// Computes the gains of an axis, or copies them if its loop equals that of the previous axis.
void add_gains(const AxisLoop& loop, const std::optional<SampledLoop>& sampled, int axis, bool is_as_before,
               TrackingReport& report) {
  const auto copy = [axis](auto& rows) {
    const std::size_t count = rows.size();
    for (std::size_t k = 0; k < count; ++k) {
      if (rows[k].axis != axis - 1) continue;
      auto row = rows[k];
      row.axis = axis;
      rows.push_back(row);
    }
  };
  if (is_as_before) {
    copy(report.exact);
    copy(report.of_estimates);
    return;
  }
  for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
    const GainNorms norms = continuous_norms(loop, channel);
    report.exact.push_back({axis, channel, Loop::kContinuous, norms, norms});
    if (!sampled) continue;
    report.exact.push_back({axis, channel, Loop::kSampled,
                            sampled_norms(*sampled, channel, Instants::kSampling),
                            sampled_norms(*sampled, channel, Instants::kAll)});
  }
  for (const Estimate estimate : {Estimate::kVelocity, Estimate::kPosition}) {
    const GainNorms norms = continuous_norms(loop, estimate);
    report.of_estimates.push_back({axis, estimate, Loop::kContinuous, norms, norms});
    if (!sampled) continue;
    report.of_estimates.push_back({axis, estimate, Loop::kSampled,
                                   sampled_norms(*sampled, estimate, Instants::kSampling),
                                   sampled_norms(*sampled, estimate, Instants::kAll)});
  }
}

/// Returns the demand of the disturbance on the integrator of the loop as flown.
double integrator_need(const Gains& gains, const Plant& plant, const AxisLoop& loop,
                       const std::optional<SampledLoop>& sampled, int axis, const DisturbanceSource& source,
                       const InitialError& initial) {
  const double limit_m_s = integrator_limit(gains, axis);
  const Disturbance& known = source.axis[axis];
  OtherErrors other = source.other(axis, initial, plant);
  if (source.classes_contain_bias) other.bias_N = other.start_N = 0;
  const ClampBounds clamp = sampled ? clamp_bounds(*sampled, Channel::kForce, known, other, limit_m_s)
                                    : clamp_bounds(loop, Channel::kForce, known, other, limit_m_s);
  return clamp.demand_m_s;
}

/// Computes the bounds of an axis, one row per row of gains, or copies them if nothing differs from the previous axis.
void add_bounds(const Gains& gains, const Plant& plant, const AxisLoop& loop,
                const std::optional<SampledLoop>& sampled, int axis, bool is_as_before,
                const DisturbanceSource& source, const InitialError& initial, TrackingReport& report) {
  const std::size_t count = report.bounds.size();
  for (std::size_t k = 0; k < count && is_as_before; ++k) {
    if (report.bounds[k].axis != axis - 1) continue;
    AxisBounds row = report.bounds[k];
    row.axis = axis;
    report.bounds.push_back(row);
  }
  if (is_as_before) return;
  const Disturbance& known = source.axis[axis];
  const OtherErrors other = source.other(axis, initial, plant);
  const double limit_m_s = integrator_limit(gains, axis);
  for (const ExactGains& of : report.exact) {
    if (of.axis != axis) continue;
    AxisBounds row = of.loop == Loop::kSampled ? axis_bounds(*sampled, of.channel, of.all_times, known, other,
                                                             source.classes_contain_bias, limit_m_s)
                                               : axis_bounds(loop, of.channel, of.all_times, known, other,
                                                             source.classes_contain_bias, limit_m_s);
    row.axis = axis;
    row.loop = of.loop;
    if (source.f_hat_rate_known) {
      row.staircase_m = staircase_error(of.all_times, gains.network_rate_hz, gains.network_latency_s,
                                        source.f_hat_rate_N_s);
    }
    report.bounds.push_back(row);
  }
}

/// Largest row sum of absolute values, an upper bound on the 2-norm of a symmetric matrix.
double row_sum_norm(const Matrix3& m) {
  const auto sum = [](const controller::Vector3<double>& row) {
    return std::abs(row.x) + std::abs(row.y) + std::abs(row.z);
  };
  return std::max({sum(m.x), sum(m.y), sum(m.z)});
}

Transient transient_of(const Theorem& theorem, const Plant& plant, const DisturbanceSource& source,
                       const InitialError& initial) {
  Transient transient;
  transient.l = theorem.min_Lambda;
  transient.k = theorem.min_K;
  transient.mass_kg = plant.mass_kg;
  transient.error_m = initial.position_m;
  transient.speed_m_s = initial.velocity_m_s;
  // With zero integral, m e'' = -(m 2 Lambda + K) e' - (m Lambda^2 + 2 K Lambda) e - K Lambda^2 0 - eps(0), so
  // m s' = -K (e' + 2 Lambda e) - eps(0).
  const double bias_N = std::hypot(source.bias_N[0], source.bias_N[1], source.bias_N[2]);
  transient.s_dot_m_s2 =
      (row_sum_norm(theorem.composite->K_kg_s) *
           (initial.velocity_m_s + 2 * row_sum_norm(theorem.composite->Lambda_1_s) * initial.position_m) +
       std::max(initial.learning_error_N, bias_N)) /
      plant.mass_kg;
  transient.rate_N_s =
      source.bounds_learning_error() && std::isfinite(source.rate_norm_N_s) ? source.rate_norm_N_s : 0;
  return transient;
}

/// Checks the hypotheses that do not concern the gains; then adds vector gain, transient and ball.
void add_theorem(const Plant& plant, const DisturbanceSource& source, const InitialError& initial,
                 TrackingReport& report) {
  Theorem& theorem = report.theorem;
  const auto object = [&theorem](std::string why) {
    theorem.applies = false;
    theorem.why_not.push_back(std::move(why));
  };
  if (plant.thrust_scale != 1) {
    object("the actual force is not the commanded force: thrust scale " + std::to_string(plant.thrust_scale));
  }
  if (source.has_estimate_errors()) object("the estimated position or velocity has errors, as declared");
  if (source.thrust_ratio_error > 0) object("the thrust ratio has an error, as declared");
  if (source.has_moving_reference()) object("the setpoint moves, as declared");
  if (!theorem.composite) return;
  report.vector = vector_peak_gain(theorem.composite->Lambda_1_s, theorem.composite->K_kg_s, plant.mass_kg);
  report.transient = transient_of(theorem, plant, source, initial);
  if (theorem.applies && source.bounds_learning_error() && std::isfinite(source.rate_norm_N_s)) {
    report.ball_m = source.rate_norm_N_s * theorem.ball_per_rate();
  }
}

}  // namespace

const char* axis_name(int axis) { return axis == 0 ? "x" : axis == 1 ? "y" : "z"; }
int axis_of_name(const std::string& name) {
  for (const int axis : {0, 1, 2})
    if (name == axis_name(axis)) return axis;
  throw std::invalid_argument("axis_of_name: no axis is called " + name);
}
const char* name(Channel channel) { return channel == Channel::kForce ? "force" : "command"; }
const char* name(Estimate estimate) { return estimate == Estimate::kVelocity ? "velocity" : "position"; }
const char* name(Loop loop) { return loop == Loop::kContinuous ? "continuous" : "sampled"; }

std::optional<AxisLoop> axis_loop(const Gains& gains, const Plant& plant, int axis) {
  const std::optional<controller::AxisPid<double>> pid = axis_gains(gains, plant.mass_kg, axis);
  if (!pid) return std::nullopt;
  AxisLoop loop;
  loop.mass_kg = plant.mass_kg;
  loop.Kp = pid->Kp_1_s2 * plant.thrust_scale;
  loop.Kd = pid->Kd_1_s * plant.thrust_scale;
  loop.Ki = pid->Ki_1_s3 * plant.thrust_scale;
  if (gains.motor_lag_s > 0) loop.lags_s.push_back(gains.motor_lag_s);
  if (axis < 2 && gains.attitude_lag_s > 0) loop.lags_s.push_back(gains.attitude_lag_s);
  loop.delay_s = gains.delay_s;
  return loop;
}

std::optional<SampledLoop> sampled_axis_loop(const Gains& gains, const Plant& plant, int axis) {
  const std::optional<AxisLoop> loop = axis_loop(gains, plant, axis);
  if (!loop || gains.rate_hz == 0) return std::nullopt;
  return SampledLoop{*loop, 1 / gains.rate_hz, gains.integrator_step_s};
}

bool DisturbanceSource::has_estimate_errors() const {
  const auto is_given = [](const EstimateError& error) { return !error.is_zero(); };
  return std::any_of(std::begin(velocity_error), std::end(velocity_error), is_given) ||
         std::any_of(std::begin(position_error), std::end(position_error), is_given);
}

bool DisturbanceSource::has_moving_reference() const {
  return std::any_of(std::begin(reference), std::end(reference),
                     [](const ReferenceMotion& motion) { return !(motion == ReferenceMotion{}); });
}

bool DisturbanceSource::amplitudes_reach_bias() const {
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(bias_N[i]) > axis[i].amplitude_N) return false;
  }
  return true;
}

OtherErrors DisturbanceSource::other(int of_axis, const InitialError& initial, const Plant& plant) const {
  OtherErrors errors;
  errors.bias_N = bias_N[of_axis];
  errors.start_N = initial.learning_error_N;
  errors.position_m = initial.position_m;
  errors.velocity_m_s = initial.velocity_m_s;
  errors.reference = reference[of_axis];
  errors.velocity_error = velocity_error[of_axis];
  errors.position_error = position_error[of_axis];
  errors.thrust_ratio_error = thrust_ratio_error;
  if (of_axis == 2 && thrust_ratio_error > 0)
    errors.hover_N = plant.thrust_scale * plant.mass_kg * kGravity_m_s2;
  return errors;
}

AxisBounds axis_bounds(const AxisLoop& loop, Channel channel, const GainNorms& gains,
                       const Disturbance& known, const OtherErrors& other, bool classes_contain_bias,
                       double limit_m_s) {
  return bounds_of(loop, disturbance_bounds(loop, channel, known), channel, gains, known, other,
                   classes_contain_bias, limit_m_s);
}

AxisBounds axis_bounds(const SampledLoop& loop, Channel channel, const GainNorms& gains,
                       const Disturbance& known, const OtherErrors& other, bool classes_contain_bias,
                       double limit_m_s) {
  return bounds_of(loop, disturbance_bounds(loop, channel, gains, known), channel, gains, known, other,
                   classes_contain_bias, limit_m_s);
}

std::optional<double> thrust_margin_N(const Plant& plant, const AxisLoop& vertical,
                                      const DisturbanceSource& source, const InitialError& initial) {
  const double amplitude_N = source.axis[2].amplitude_N;
  if (!(plant.largest_thrust_N > 0) || !std::isfinite(amplitude_N)) return std::nullopt;
  if (source.has_moving_reference())
    return std::nullopt;  // the feedforward also uses thrust, and is not bounded
  OtherErrors other = source.other(2, initial, plant);
  if (source.classes_contain_bias) other.bias_N = other.start_N = 0;
  const double weight_N = plant.mass_kg * kGravity_m_s2;
  const double effort = effort_gain(vertical);
  const double ratio = other.thrust_ratio_error;
  double needed_N = effort * amplitude_N + effort_N(vertical, with_hover_share(other));
  // d u is an additional force on the loop of the model; see thrust_ratio.h.
  if (ratio > 0) needed_N = ratio * effort < 1 ? needed_N / (1 - ratio * effort) : kInfinity;
  if (!std::isfinite(needed_N)) return std::nullopt;
  return std::min((1 - ratio) * plant.thrust_scale * plant.largest_thrust_N - weight_N,
                  (1 - ratio) * weight_N) -
         needed_N;
}

TrackingReport tracking_bounds(const Gains& gains, const Plant& plant, const DisturbanceSource& source,
                               const InitialError& initial) {
  TrackingReport report;
  PerAxis integrator_needs{};
  bool needs_known = true;
  for (int axis = 0; axis < 3; ++axis) {
    const Disturbance& known = source.axis[axis];
    needs_known = needs_known && (std::isfinite(known.amplitude_N) || std::isfinite(known.impulse_N_s));
    const std::optional<AxisLoop> loop = axis_loop(gains, plant, axis);
    if (!loop) {
      needs_known = false;
      continue;
    }
    const std::optional<SampledLoop> sampled = sampled_axis_loop(gains, plant, axis);
    report.facts.push_back(facts_of(gains, *loop, sampled, axis, source.bias_N[axis]));
    const std::optional<AxisLoop> before =
        axis > 0 ? axis_loop(gains, plant, axis - 1) : std::optional<AxisLoop>();
    const bool is_same_loop = before && same(*before, *loop);
    add_gains(*loop, sampled, axis, is_same_loop, report);
    const bool is_same =
        is_same_loop && source.other(axis, initial, plant) == source.other(axis - 1, initial, plant) &&
        known == source.axis[axis - 1] && integrator_limit(gains, axis) == integrator_limit(gains, axis - 1);
    const auto i = static_cast<std::size_t>(axis);
    integrator_needs[i] = is_same ? integrator_needs[i - 1]
                                  : integrator_need(gains, plant, *loop, sampled, axis, source, initial);
    if (source.kind != "none") {
      add_bounds(gains, plant, *loop, sampled, axis, is_same, source, initial, report);
    }
    if (axis == 2) report.thrust_margin_N = thrust_margin_N(plant, *loop, source, initial);
  }
  report.theorem = check_theorem(gains, plant.mass_kg,
                                 needs_known ? std::optional<PerAxis>(integrator_needs) : std::nullopt);
  add_theorem(plant, source, initial, report);
  add_assumptions(gains, source, report);
  return report;
}

}  // namespace swarmcert::stability
