#include "stability/bounds/saturation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "nn/base/doubles.h"
#include "stability/bounds/around_attitude.h"
#include "stability/bounds/sampled_bounds.h"
#include "stability/bounds/thrust_ratio.h"

namespace swarmcert::stability {
namespace {

template <class AnyLoop>
double integral_replaced_N(AnyLoop& loop, double limit_m_s) {
  AxisLoop& plant = plant_of(loop);
  Disturbance integral;
  integral.amplitude_N = plant.mass_kg * plant.Ki * limit_m_s;
  plant.Ki = 0;
  return effort_of_class_N(loop, Channel::kCommand, integral);
}

/// sup |u| due to the class and the other errors of one axis.
template <class AnyLoop>
double commanded_N(AnyLoop loop, Channel channel, const Disturbance& known, const OtherErrors& other,
                   double limit_m_s) {
  const ClampBounds clamp = clamp_demand(loop, channel, known, other, limit_m_s);
  if (!clamp.exists || clamp.never_acts)
    return effort_of_class_N(loop, channel, known) + effort_N(loop, other, channel);
  const double integral_N = replace_integral_N(loop, limit_m_s);
  return effort_of_class_N(loop, channel, known) + effort_N(loop, other, channel) + integral_N;
}

/// The same with an unknown constant thrust ratio: d u acts like a force (thrust_ratio.h).
template <class AnyLoop>
double with_ratio_N(const AnyLoop& loop, double commanded_N, double ratio_error) {
  if (ratio_error == 0) return commanded_N;
  const double by_feedback = ratio_error * effort_gain(loop);
  return by_feedback < 1 ? commanded_N / (1 - by_feedback) : kInfinity;
}

bool has_network(const FlownLoop& loop, const DisturbanceSource& source) {
  return loop.gains.network_rate_hz > 0 || loop.gains.network_latency_s > 0 || source.f_hat_rate_known;
}

double feedback_N(const FlownLoop& loop, const DisturbanceSource& source, const InitialError& initial,
                  int axis) {
  Disturbance known = source.axis[axis];
  if (source.kind == "none") known.amplitude_N = 0;
  if (source.f_hat_rate_known && axis == 2) {
    const Gains& gains = loop.gains;
    const double age_s =
        (gains.network_rate_hz > 0 ? 1 / gains.network_rate_hz : 0) + gains.network_latency_s;
    known.amplitude_N += age_s * source.f_hat_rate_N_s;
  }
  OtherErrors other = with_hover_share(source.other(axis, initial, loop.plant));
  if (source.classes_contain_bias) other.bias_N = other.start_N = 0;
  const double fed_forward_N = loop.plant.mass_kg * other.reference.fed_forward_m_s2();
  if (known.largest_N() == 0 && other == OtherErrors{}) return fed_forward_N;
  const auto of = [&](const auto& one, double limit_m_s) {
    double most_N = commanded_N(one, Channel::kForce, known, other, limit_m_s);
    if (has_network(loop, source))
      most_N = std::max(most_N, commanded_N(one, Channel::kCommand, known, other, limit_m_s));
    return with_ratio_N(one, most_N, other.thrust_ratio_error);
  };
  if (const auto sampled = loop.sampled(axis))
    return fed_forward_N + of(*sampled, loop.integrator_limit_m_s(axis));
  if (const auto continuous = loop.continuous(axis))
    return fed_forward_N + of(*continuous, loop.integral_limit_m_s(axis));
  return kInfinity;
}

/// True if the class contains every force within the amplitude.
bool has_only_amplitude(const Disturbance& d) {
  return std::isfinite(d.amplitude_N) && !std::isfinite(d.rate_N_s) && !std::isfinite(d.variation_N) &&
         !std::isfinite(d.impulse_N_s);
}
bool has_only_rate(const Disturbance& d) {
  return d.rate_N_s > 0 && std::isfinite(d.rate_N_s) && !std::isfinite(d.amplitude_N) &&
         !std::isfinite(d.variation_N) && !std::isfinite(d.impulse_N_s);
}

/// Returns |u| that a force within the amplitude attains, N; 0 if none is known to.
double attained_N(const FlownLoop& loop, int axis, double amplitude_N) {
  if (const auto sampled = loop.sampled(axis))
    return effort_of_worst_force_N(*sampled, amplitude_N, loop.integrator_limit_m_s(axis));
  const std::optional<AxisLoop> one = loop.continuous(axis);
  if (!one || !is_stable(*one)) return 0;
  Disturbance force;
  force.amplitude_N = amplitude_N;
  const ClampBounds clamp = clamp_demand(*one, Channel::kForce, force, {}, loop.integral_limit_m_s(axis));
  return !clamp.exists || clamp.never_acts ? effort_gain(*one) * amplitude_N : 0;
}

/// Looks for an input of the declared class that exceeds a limit of the thrust.
void refute(const FlownLoop& loop, const DisturbanceSource& source, Saturation& result) {
  const bool has_others =
      source.has_moving_reference() || source.thrust_ratio_error > 0 || source.kind == "measured";
  if (has_others || source.kind == "none" || source.kind == "rate of f_hat") return;
  const double weight_N = loop.plant.mass_kg * kGravity_m_s2;
  const Interval available = result.available_N;
  if (has_only_rate(source.axis[2])) {
    if (!std::isfinite(available.upper)) return;
    result.verdict = Saturation::Verdict::kRefuted;
    result.why = "a force error that grows at " + decimals(source.axis[2].rate_N_s) + " N/s for about " +
                 decimals((available.upper - weight_N) / source.axis[2].rate_N_s) +
                 " s asks for more than the " + decimals(available.upper) +
                 " N of the rotors: state how large it may become (--amplitude)";
    return;
  }
  double u[3] = {};
  for (int axis = 0; axis < 3; ++axis) {
    const double bias = source.bias_N[axis];
    if (bias == 0 && has_only_amplitude(source.axis[axis]))
      u[axis] = attained_N(loop, axis, source.axis[axis].amplitude_N);
  }
  const double most_N = std::hypot(u[0], u[1], weight_N + u[2]), least_N = weight_N - u[2];
  if (most_N > available.upper * (1 + 1e-9)) {
    result.why = "forces within the amplitudes make the law command " + decimals(most_N) +
                 " N; the rotors give " + decimals(available.upper) + " N";
  } else if (least_N < available.lower * (1 - 1e-9)) {
    result.why = "forces within the amplitudes make the law command a vertical force of " +
                 decimals(least_N) + " N; the rotors give at least " + decimals(available.lower) + " N";
  } else {
    return;
  }
  result.verdict = Saturation::Verdict::kRefuted;
}

std::string why_undecided(const FlownLoop& loop, const DisturbanceSource& source, const Saturation& found) {
  if (!std::isfinite(found.available_N.upper)) return "the thrust of the rotors is not known";
  if (loop.is_stable() != true) return "the loop is not stable";
  if (!loop.continuous(0) || !loop.continuous(2)) return "Lambda or K couples the axes";
  if (std::isfinite(found.most_N)) {
    return "the declared inputs may make the law command " + decimals(found.least_N) + " to " +
           decimals(found.most_N) + " N, the rotors give " + decimals(found.available_N.lower) + " to " +
           decimals(found.available_N.upper) + " N";
  }
  for (const ReferenceMotion& motion : source.reference) {
    if (!std::isfinite(motion.fed_forward_m_s2()))
      return "the set point's acceleration, which is fed forward, is not bounded (reference_accel_m_s2)";
  }
  return "the size of the force error is not known (--amplitude)";
}

}  // namespace

double Saturation::beyond_linear_N() const {
  const double sine = std::sin(std::min(tilt_rad(), std::acos(0.0)));
  return 2 * most_N * sine * sine + (most_N - least_N) * sine;
}

std::string decimals(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

double Saturation::tilt_rad() const {
  return least_N > 0 ? std::atan2(std::hypot(feedback_N[0], feedback_N[1]), least_N) : std::acos(-1.0);
}

double replace_integral_N(AxisLoop& loop, double limit_m_s) { return integral_replaced_N(loop, limit_m_s); }
double replace_integral_N(SampledLoop& loop, double limit_m_s) {
  return integral_replaced_N(loop, limit_m_s);
}

Saturation saturation_of(const FlownLoop& loop, const PerAxis& feedback_N, double ratio_error) {
  Saturation result;
  result.feedback_N = feedback_N;
  const double weight_N = loop.plant.mass_kg * kGravity_m_s2;
  result.available_N = loop.thrust_range_N();
  result.available_N.lower *= 1 + ratio_error;
  result.available_N.upper *= 1 - ratio_error;
  result.most_N = std::hypot(feedback_N[0], feedback_N[1], weight_N + feedback_N[2]);
  result.least_N = weight_N - feedback_N[2];
  if (std::isfinite(result.available_N.upper) && result.margin_N() >= 0)
    result.verdict = Saturation::Verdict::kProved;
  return result;
}

Saturation thrust_demand(const FlownLoop& loop, const DisturbanceSource& source,
                         const InitialError& initial) {
  PerAxis feedback{};
  for (int axis = 0; axis < 3; ++axis)
    feedback[static_cast<std::size_t>(axis)] = feedback_N(loop, source, initial, axis);
  const std::string objection = attitude_objection(loop);
  if (!objection.empty()) feedback[0] = feedback[1] = kInfinity;
  Saturation result = saturation_of(loop, feedback, source.thrust_ratio_error);
  result.why = objection;
  return result;
}

Saturation saturation(const FlownLoop& loop, const DisturbanceSource& source, const InitialError& initial) {
  Saturation result = thrust_demand(loop, source, initial);
  if (result.is_proved() || !result.why.empty()) return result;
  refute(loop, source, result);
  if (result.verdict == Saturation::Verdict::kUndecided) result.why = why_undecided(loop, source, result);
  return result;
}

const char* name(Saturation::Verdict verdict) {
  return verdict == Saturation::Verdict::kProved    ? "proved"
         : verdict == Saturation::Verdict::kRefuted ? "refuted"
                                                    : "undecided";
}

}  // namespace swarmcert::stability
