#include "stability/bounds/tracking_bounds.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "nn/base/doubles.h"
#include "stability/bounds/around_attitude.h"
#include "stability/bounds/sampled_bounds.h"
#include "stability/bounds/thrust_ratio.h"

namespace swarmcert::stability {
namespace {

constexpr double kPositionNoise_m = 1e-3;
constexpr double kVelocityNoise_m_s = 0.05;

AxisFacts facts_of(const FlownLoop& flown, int axis, double bias_N) {
  const AxisLoop loop = *flown.continuous(axis);
  AxisFacts facts;
  facts.axis = axis;
  facts.stable = is_stable(loop);
  facts.lag_floor = lag_floor(loop);
  facts.lag_limit_s = lag_limit(loop);
  facts.delay_limit_s = delay_limit(loop);
  facts.effective_Ki = loop.Ki;
  const double limit_m_s = flown.integral_limit_m_s(axis);
  facts.clamp_authority_N = loop.Ki > 0 ? loop.mass_kg * loop.Ki * limit_m_s : 0;
  facts.clamp_residual_m = clamp_residual(loop, bias_N, limit_m_s);
  const std::optional<SampledLoop> sampled = flown.sampled(axis);
  facts.written_Ki = sampled ? sampled->plant.Ki : loop.Ki;
  facts.effort_gain = sampled ? effort_gain(*sampled) : effort_gain(loop);
  if (sampled) {
    facts.spectral_radius = spectral_radius(*sampled);
    facts.stable = facts.spectral_radius < 1;
    facts.noise = noise_deviation(*sampled, kPositionNoise_m, kVelocityNoise_m_s);
  }
  return facts;
}

using AddAssumption = std::function<void(const char* name, const char* status, const std::string& note)>;

void assume_attitude(const FlownLoop& loop, const AddAssumption& add) {
  const bool has_lag = loop.gains.attitude_lag_s > 0;
  const char* const name = has_lag ? "first-order lag of the thrust's direction"
                                   : "the thrust's direction follows the command at once";
  const std::string objection = attitude_objection(loop);
  if (objection.empty()) return add(name, "assumed", has_lag ? "as in [lag]" : "[lag] states no attitude_s");
  const std::optional<double> enough_s = lag_that_contains_attitude_s(loop);
  add(name, "refuted",
      objection + (enough_s ? "; [lag] attitude_s = " + decimals(*enough_s) + " contains it" : ""));
}

/// Visits one fact of the loop that flies: adds what the bounds assume about it.
void assume(Fact fact, const FlownLoop& loop, const DisturbanceSource& source, const Saturation& thrust,
            const AddAssumption& add) {
  switch (fact) {
    case Fact::kGainsOfLaw:
    case Fact::kIntegratorStep:   // the Ki that acts is used
    case Fact::kIntegratorClamp:  // contained in every total
    case Fact::kThrustScale:      // scales the gains
      return;
    case Fact::kSampling:
      return add(kContinuousLoop, "assumed", "not needed for rows named 'sampled'");
    case Fact::kMotorLag:
      return add("first-order lag of the thrust", "assumed", "as in [lag]");
    case Fact::kAttitude:
      assume_attitude(loop, add);
      return add(
          "attitude error small", "assumed",
          "the direction of thrust is treated as linear" +
              (std::isfinite(thrust.most_N)
                   ? ": up to a tilt of " + decimals(thrust.tilt_rad() * 180 / std::acos(-1.0)) +
                         " degrees, which leaves out about " + decimals(thrust.beyond_linear_N()) + " N"
                   : ""));
    case Fact::kDelay:
      return add("constant delay", "assumed", "as in [lag]");
    case Fact::kNetworkRate:
    case Fact::kNetworkLatency:
      if (!source.bounds_learning_error() || source.f_hat_rate_known) return;
      if (fact == Fact::kNetworkLatency && loop.gains.network_rate_hz > 0) return;  // stated already
      add("the learned force follows its inputs immediately", "assumed",
          "[network] makes it a staircase or late; --network NET --speed V bounds the effect");
      return;
    case Fact::kThrustLimits:
      return add("single rotors have thrust left for the torques of the attitude law", "assumed", "");
  }
}

void assume_saturation(const Saturation& found, const DisturbanceSource& source, const AddAssumption& add) {
  const bool is_refuted = found.verdict == Saturation::Verdict::kRefuted;
  const char* const status = is_refuted                  ? "refuted"
                             : !found.is_proved()        ? "assumed"
                             : source.kind == "measured" ? "measured"
                                                         : "proved";
  add("no saturation of the collective thrust", status,
      found.is_proved() ? "for all forces that the declared inputs make the law command, of all axes together"
                        : found.why);
}

void add_assumptions(const FlownLoop& loop, const DisturbanceSource& source, TrackingReport& report) {
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
  assume_saturation(report.saturation, source, add);
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
  for (const Fact fact : loop.facts()) assume(fact, loop, source, report.saturation, add);
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

/// The gains of an axis in one loop, over the channels by which a force error may enter, and of the estimates.
void add_gains(const FlownLoop& loop, int axis, TrackingReport& report) {
  const std::optional<AxisLoop> continuous = loop.continuous(axis);
  const std::optional<SampledLoop> sampled = loop.sampled(axis);
  const auto add = [&](auto input, auto& rows) {
    const GainNorms norms = continuous_norms(*continuous, input);
    rows.push_back({axis, input, Loop::kContinuous, norms, norms});
    if (!sampled) return;
    rows.push_back({axis, input, Loop::kSampled, sampled_norms(*sampled, input, Instants::kSampling),
                    sampled_norms(*sampled, input, Instants::kAll)});
  };
  for (const Channel channel : {Channel::kForce, Channel::kCommand}) add(channel, report.exact);
  for (const Estimate estimate : {Estimate::kVelocity, Estimate::kPosition})
    add(estimate, report.of_estimates);
}

/// Appends to `rows` a copy of the rows of the previous axis, for this one.
template <class Row>
void repeat(int axis, std::vector<Row>& rows) {
  const std::size_t count = rows.size();
  for (std::size_t k = 0; k < count; ++k) {
    if (rows[k].axis != axis - 1) continue;
    Row row = rows[k];
    row.axis = axis;
    rows.push_back(row);
  }
}

/// Returns the demand of the disturbance on the integrator of the loop as flown.
double integrator_need_m_s(const FlownLoop& loop, int axis, const DisturbanceSource& source,
                           const InitialError& initial) {
  OtherErrors other = source.other(axis, initial, loop.plant);
  if (source.classes_contain_bias) other.bias_N = other.start_N = 0;
  const auto need = [&](const auto& one, double limit_m_s) {
    return clamp_demand(one, Channel::kForce, source.axis[axis], other, limit_m_s).demand_m_s;
  };
  if (const auto sampled = loop.sampled(axis)) return need(*sampled, loop.integrator_limit_m_s(axis));
  return need(*loop.continuous(axis), loop.integral_limit_m_s(axis));
}

/// Computes the bounds of an axis, one row per row of gains.
void add_bounds(const FlownLoop& loop, int axis, const DisturbanceSource& source, const InitialError& initial,
                TrackingReport& report) {
  for (const ExactGains& of : report.exact) {
    if (of.axis != axis) continue;
    AxisBounds row = axis_bounds(loop, of, source, initial);
    if (source.f_hat_rate_known) {
      row.staircase_m = staircase_error(of.all_times, loop.gains.network_rate_hz,
                                        loop.gains.network_latency_s, source.f_hat_rate_N_s);
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
void add_theorem(const FlownLoop& loop, const DisturbanceSource& source, const InitialError& initial,
                 TrackingReport& report) {
  const Plant& plant = loop.plant;
  Theorem& theorem = report.theorem;
  const auto object = [&theorem](std::string why) {
    theorem.applies = false;
    theorem.why_not.push_back(std::move(why));
  };
  if (source.has_estimate_errors()) object("the estimated position or velocity has errors, as declared");
  if (source.thrust_ratio_error > 0) object("the thrust ratio has an error, as declared");
  if (source.has_moving_reference()) object("the setpoint moves, as declared");
  if (!theorem.composite) return;
  report.vector = vector_peak_gain(theorem.composite->Lambda_1_s, theorem.composite->K_kg_s, plant.mass_kg);
  report.transient = transient_of(theorem, plant, source, initial);
  if (theorem.applies && source.bounds_learning_error() && std::isfinite(source.rate_norm_N_s)) {
    report.ball_m = source.rate_norm_N_s * theorem.ball_per_rate();
    if (const std::optional<double> per_rate = flown_ball_per_rate(loop, theorem))
      report.flown_ball_m = source.rate_norm_N_s * *per_rate;
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

AxisBounds axis_bounds(const FlownLoop& loop, const ExactGains& of, const DisturbanceSource& source,
                       const InitialError& initial) {
  const Disturbance& known = source.axis[of.axis];
  const OtherErrors other = source.other(of.axis, initial, loop.plant);
  AxisBounds row;
  if (of.loop == Loop::kSampled) {
    const SampledLoop one = loop.sampled(of.axis).value();
    row = bounds_of(one, disturbance_bounds(one, of.channel, of.all_times, known), of.channel, of.all_times,
                    known, other, source.classes_contain_bias, loop.integrator_limit_m_s(of.axis));
  } else {
    const AxisLoop one = loop.continuous(of.axis).value();
    row = bounds_of(one, disturbance_bounds(one, of.channel, known), of.channel, of.all_times, known, other,
                    source.classes_contain_bias, loop.integral_limit_m_s(of.axis));
  }
  row.axis = of.axis;
  row.loop = of.loop;
  return row;
}

ExactGains flown_gains(const FlownLoop& loop, int axis, Channel channel) {
  if (const auto sampled = loop.sampled(axis)) {
    return {axis, channel, Loop::kSampled, sampled_norms(*sampled, channel, Instants::kSampling),
            sampled_norms(*sampled, channel, Instants::kAll)};
  }
  const GainNorms norms = continuous_norms(loop.continuous(axis).value(), channel);
  return {axis, channel, Loop::kContinuous, norms, norms};
}

TrackingReport tracking_bounds(const FlownLoop& loop, const DisturbanceSource& source,
                               const InitialError& initial) {
  TrackingReport report;
  PerAxis integrator_needs{};
  bool needs_known = true;
  for (int axis = 0; axis < 3; ++axis) {
    const Disturbance& known = source.axis[axis];
    needs_known = needs_known && (std::isfinite(known.amplitude_N) || std::isfinite(known.impulse_N_s));
    const std::optional<AxisLoop> one = loop.continuous(axis);
    if (!one) {
      needs_known = false;
      continue;
    }
    report.facts.push_back(facts_of(loop, axis, source.bias_N[axis]));
    const bool is_same_loop = axis > 0 && loop.continuous(axis - 1) == one;
    if (is_same_loop) {
      repeat(axis, report.exact);
      repeat(axis, report.of_estimates);
    } else {
      add_gains(loop, axis, report);
    }
    const bool is_same =
        is_same_loop && known == source.axis[axis - 1] &&
        source.other(axis, initial, loop.plant) == source.other(axis - 1, initial, loop.plant) &&
        loop.integrator_limit_m_s(axis) == loop.integrator_limit_m_s(axis - 1);
    const auto i = static_cast<std::size_t>(axis);
    integrator_needs[i] =
        is_same ? integrator_needs[i - 1] : integrator_need_m_s(loop, axis, source, initial);
    if (source.kind == "none") continue;
    if (is_same) {
      repeat(axis, report.bounds);
    } else {
      add_bounds(loop, axis, source, initial, report);
    }
  }
  report.is_stable = loop.is_stable();
  report.saturation = saturation(loop, source, initial);
  report.theorem = check_theorem(loop, needs_known ? std::optional<PerAxis>(integrator_needs) : std::nullopt);
  add_theorem(loop, source, initial, report);
  add_assumptions(loop, source, report);
  return report;
}

}  // namespace swarmcert::stability
