#include "stability/bounds/truth_bounds.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "nn/base/doubles.h"
#include "stability/bounds/enclosures/interval_functions.h"
#include "stability/bounds/field_slope.h"
#include "stability/effects/registry.h"

namespace swarmcert::stability {
namespace {

/// Product of nonnegative numbers, rounded up; 0 if one factor is 0, even if the other is infinite.
double times_up(double a, double b) { return a == 0 || b == 0 ? 0 : up(a * b); }
double plus(double a, double b) { return up(a + b); }

/// Returns 1/x, rounded up.
double one_over(double x) { return x > 0 ? up(1 / x) : kInfinity; }

/// Bounds the force along every axis. @param why the rate may be infinite
void bound_all(double amplitude_N, double rate_N_s, const char* why, EffectBounds& result) {
  std::fill(result.amplitude_N, result.amplitude_N + 3, amplitude_N);
  std::fill(result.rate_N_s, result.rate_N_s + 3, rate_N_s);
  if (std::isinf(amplitude_N) || std::isinf(rate_N_s)) result.unbounded = why;
}

/// Parameters of a spec by name.
using Values = std::function<double(const char*)>;

/// Upper bound on N^(1/p), the ratio of N equal forces composed with the p-norm to one of them.
double composed(int neighbours, double p) {
  return neighbours <= 1 ? 1 : pow(Interval(neighbours), 1 / p).upper * (1 + 1e-15 * neighbours);
}

/// Bounds a field of the position: the amplitude along z, and the rate from slope and relative speed.
void field_bounds(const WakeField& field, double strength_N, double composition, const MotionSet& motion,
                  EffectBounds& result) {
  const FieldSlopes slopes = field_slopes(field, motion.least_gap_m, motion.largest_gap_m);
  const double factor = times_up(strength_N, composition);
  result.amplitude_N[2] = times_up(factor, slopes.value.upper);
  result.slope_across_N_m = times_up(strength_N, slopes.across.upper);
  result.slope_along_N_m = times_up(strength_N, slopes.along.upper);
  double rate = times_up(factor, times_up(slopes.total.upper, motion.relative_speed_m_s));
  if (field.convection_s_m > 0) {
    // The wake's centre moves with the neighbour: the rate of r - k dz v_j has the additional terms k |dz'| |v_j| + k
    // dz |v_j'|.
    const double drift = plus(times_up(motion.relative_speed_m_s, motion.speed_m_s),
                              times_up(motion.largest_gap_m, motion.acceleration_m_s2));
    rate = plus(rate, times_up(times_up(factor, slopes.across.upper), times_up(field.convection_s_m, drift)));
  }
  result.rate_N_s[2] = rate;
  if (std::isinf(slopes.total.upper)) {
    result.unbounded = "the field jumps at a height difference of 0.05 m: choose a --gap above that";
  } else if (std::isinf(rate)) {
    result.unbounded = field.convection_s_m > 0
                           ? "the wake is carried along: needs --speed, --own-speed, --own-accel and --gap"
                           : "needs the relative speed: --speed";
  } else {
    result.reached_rate_N_s = strength_N * slopes.total.lower * motion.relative_speed_m_s;
  }
}

/// Motion of neighbours that are seen `delay_s` ago, extrapolated with their velocity: dp - d v_j has the rate dv - d
/// v_j'.
MotionSet seen_late(MotionSet motion, double delay_s) {
  const double moved_m = times_up(delay_s, motion.speed_m_s);
  motion.relative_speed_m_s = plus(motion.relative_speed_m_s, times_up(delay_s, motion.acceleration_m_s2));
  motion.least_gap_m = std::max(0.0, down(motion.least_gap_m - moved_m));
  motion.largest_gap_m = plus(motion.largest_gap_m, moved_m);
  return motion;
}

void bound_wake(const std::string& name, const Values& value, const MotionSet& motion, EffectBounds& result) {
  WakeField field;
  if (name == "wake_delay") {
    // For rotors of equal area: the mass enters as in downwash with the exponent 1/2.
    field.decay = value("decay_exponent");
    field.spread_m = value("spread_m");
    field.spread_slope = value("spread_slope");
    field.fades = true;
    const Interval mass = Interval(motion.neighbour_mass_kg) / Interval(0.034);
    const double strength_N = times_up(value("amplitude_N"), pow(mass, 0.5).upper);
    field_bounds(field, strength_N, composed(motion.neighbours, value("norm_exponent")),
                 seen_late(motion, value("delay_s")), result);
    result.reached_rate_N_s = 0;
    return;
  }
  const bool is_downwash = name == "downwash";
  field.decay = value("decay_exponent");
  field.spread_m = value("spread_m");
  field.fades = is_downwash;
  double composition = motion.neighbours;
  double strength_N = value("amplitude_N");
  if (is_downwash) {
    field.spread_slope = value("spread_slope");
    field.convection_s_m = value("convection_s_m");
    composition = composed(motion.neighbours, value("norm_exponent"));
    const Interval mass = Interval(motion.neighbour_mass_kg) / Interval(0.034);
    strength_N = times_up(strength_N, std::max(1.0, pow(mass, value("mass_exponent")).upper));
    if (motion.neighbour_mass_kg < 0.034)
      strength_N = times_up(value("amplitude_N"), pow(mass, value("mass_exponent")).upper);
  }
  field_bounds(field, strength_N, composition, motion, result);
}

void bound_drag(const std::string& name, const Values& value, const Model& model, const MotionSet& m,
                EffectBounds& result) {
  double amplitude = 0;
  double rate = 0;
  if (name == "drag_linear") {
    amplitude = times_up(value("drag_N_s_m"), m.speed_m_s);
    rate = times_up(value("drag_N_s_m"), m.acceleration_m_s2);
  } else if (name == "drag_quadratic") {
    // |(|v| v)'| <= 2 |v| |v'|
    amplitude = times_up(value("drag_N_s2_m2"), times_up(m.speed_m_s, m.speed_m_s));
    rate = times_up(value("drag_N_s2_m2"), times_up(2 * m.speed_m_s, m.acceleration_m_s2));
  } else if (name == "drag_rotor") {
    // (T (I - b b') v)' = T' (I - b b') v - T (b' b + b b')' v + T (I - b b') v', and |T'| + |T b'| <= sqrt(2) |(T b)'|
    const double k = times_up(value("drag_N_s_m"), one_over(down(model.mass_kg * kGravity_m_s2)));
    amplitude = times_up(k, times_up(m.largest_thrust_N, m.speed_m_s));
    rate = times_up(k, plus(times_up(1.4142135623730952, times_up(m.thrust_rate_N_s, m.speed_m_s)),
                            times_up(m.largest_thrust_N, m.acceleration_m_s2)));
  } else {
    // inflow: (T (b'v) b)', with the rates of b'v, b and T bounded separately
    const double k = value("loss_s_m");
    amplitude = times_up(k, times_up(m.largest_thrust_N, m.speed_m_s));
    rate = times_up(k, plus(times_up(2 * m.thrust_rate_N_s, m.speed_m_s),
                            times_up(m.largest_thrust_N, m.acceleration_m_s2)));
  }
  const bool needs_thrust = name == "drag_rotor" || name == "inflow";
  bound_all(
      amplitude, rate,
      needs_thrust ? "needs --own-speed, --own-accel and --thrust-rate" : "needs --own-speed and --own-accel",
      result);
}

/// Rotors only push: |sum (rotor_k - 1) f_k| <= max |rotor_k - 1| sum f_k. The rate at which thrust moves between
/// rotors is not declared, so it has no bound.
void bound_rotors(const Values& value, const MotionSet& m, EffectBounds& result) {
  double most = 0;
  for (const char* const rotor : {"rotor_1", "rotor_2", "rotor_3", "rotor_4"})
    most = std::max(most, up(std::abs(value(rotor) - 1)));
  bound_all(times_up(most, m.largest_thrust_N), most == 0 ? 0 : kInfinity,
            "the rate of a single rotor's thrust is not bounded by that of the sum", result);
}

void bound_surface(const std::string& name, const Values& value, const MotionSet& m, EffectBounds& result) {
  // f = a g T b3 with g = exp(-distance/b): |f'| <= a g (|(T b3)'| + T |v_z|/b). The clamps at the surfaces can only
  // reduce this.
  const double decay_m = value("decay_m");
  const double nearest_m = name == "ground"
                               ? down(std::max(m.least_height_m, 0.0) - value("height_reference_m"))
                               : std::max(0.0, down(value("height_m") - m.largest_height_m));
  const double g = exp(-(Interval(nearest_m) / Interval(decay_m))).upper;
  const double strength = times_up(value("amplitude"), g);
  const double by_motion = times_up(m.largest_thrust_N, times_up(m.speed_m_s, one_over(decay_m)));
  bound_all(times_up(strength, m.largest_thrust_N), times_up(strength, plus(m.thrust_rate_N_s, by_motion)),
            "needs --own-speed and --thrust-rate", result);
}

/// f = T R w with w fixed in the body: the yaw rate is not declared, so the rate has no bound.
void bound_tilt(const Values& value, const MotionSet& m, EffectBounds& result) {
  const double x = value("tilt_x_rad"), y = value("tilt_y_rad");
  const double tilt = up(std::sqrt(plus(up(x * x), up(y * y))));
  bound_all(times_up(tilt, m.largest_thrust_N), tilt == 0 ? 0 : kInfinity,
            "turns with the body, whose yaw rate is not bounded", result);
}

/// The pull is the gradient of a convex function, with slope at most k, and grows with the distance.
void bound_tether(const Values& value, const MotionSet& m, EffectBounds& result) {
  const double k = value("stiffness_N_m");
  bound_all(k == 0 ? 0 : kInfinity, times_up(k, m.speed_m_s),
            "the pull grows with the distance from the anchor, which is not bounded", result);
}

/// f = g T b3 with a factor g that depends on the motion: |(T b3)'| bounds |T'| and T |b3'|; |g'| is bounded per
/// effect.
void bound_thrust_factor(const std::string& name, const Values& value, const Model& model, const MotionSet& m,
                         EffectBounds& result) {
  constexpr double kRootOfTwoOverE = 0.8577638849607070;  // largest |2 u exp(-u^2)|, rounded up
  constexpr double kOneOverRootOfE = 0.6065306597126335;  // largest |u exp(-u^2 / 2)|, rounded up
  const double T = m.largest_thrust_N, rate = m.thrust_rate_N_s;
  // Bounds both T (b3'v)' and T |v - b3 (b3'v)|'.
  const double turning = plus(times_up(T, m.acceleration_m_s2), times_up(rate, m.speed_m_s));
  double amplitude = 0, change = 0;
  if (name == "voltage_sag") {
    // g = -s ((T/W)^(3/2) - 1), and T |g'| <= s 3/2 (T/W)^(3/2) |T'|
    const Interval load = Interval(T) / Interval(down(model.mass_kg * kGravity_m_s2));
    const double power = load.upper > 0 ? pow(load, 1.5).upper : 0;
    const double most = std::max(1.0, up(power - 1)), s = value("sag");
    amplitude = times_up(s, times_up(most, T));
    change = times_up(s, times_up(rate, plus(most, up(1.5 * power))));
  } else if (name == "thrust_saturation") {
    // |((T - K) b3)'|^2 = T'^2 + (T - K)^2 |b3'|^2 <= |(T b3)'|^2 for K >= 0
    const double knee_N = down(value("knee_weights") * down(model.mass_kg * kGravity_m_s2));
    amplitude = times_up(value("loss"), std::max(0.0, up(T - knee_N)));
    change = times_up(value("loss"), rate);
  } else if (name == "translational_lift") {
    amplitude = times_up(value("gain"), T);
    change = times_up(value("gain"),
                      plus(rate, times_up(up(kRootOfTwoOverE * one_over(value("speed_m_s"))), turning)));
  } else {
    amplitude = times_up(value("loss"), T);
    change = times_up(value("loss"),
                      plus(rate, times_up(up(kOneOverRootOfE * one_over(value("width_m_s"))), turning)));
  }
  bound_all(amplitude, change, "needs --own-speed, --own-accel and --thrust-rate", result);
}

/// Bounds functions of the position: their slope times the speed, plus the rate of the thrust.
void bound_place(const std::string& name, const Values& value, const MotionSet& m, EffectBounds& result) {
  if (name == "wall") {
    // f = p g T n with n fixed and g = exp(-d/b)
    const double push = std::abs(value("push"));
    for (int i = 0; i < 2; ++i) {
      result.amplitude_N[i] = times_up(push, m.largest_thrust_N);
      const double along = times_up(m.largest_thrust_N, times_up(m.speed_m_s, one_over(value("decay_m"))));
      result.rate_N_s[i] = times_up(push, plus(m.thrust_rate_N_s, along));
    }
  } else {
    // The logistic function has a slope of at most 1 / (4 d), exp(-u^2 / 2) one of at most exp(-1/2).
    constexpr double kOneOverRootOfE = 0.6065306597126335;
    const char* const forces[] = {"shear_x_N", "shear_y_N", "thermal_N"};
    for (int i = 0; i < 3; ++i) {
      result.amplitude_N[i] = std::abs(value(forces[i]));
      const double slope = i < 2 ? up(0.25 * one_over(value("thickness_m")))
                                 : up(kOneOverRootOfE * one_over(value("radius_m")));
      result.rate_N_s[i] = times_up(result.amplitude_N[i], times_up(slope, m.speed_m_s));
    }
  }
  const double most = *std::max_element(result.rate_N_s, result.rate_N_s + 3);
  if (std::isinf(most))
    result.unbounded = name == "wall" ? "needs --own-speed and --thrust-rate" : "needs --own-speed";
}

/// Bounds the force except for the step itself.
void bound_step(const Values& value, EffectBounds& result) {
  const double before = value("mass_before_kg"), after = value("mass_after_kg");
  if (before == after) {
    result.bias_N[2] = up(std::abs(after) * kGravity_m_s2);
    return;
  }
  result.amplitude_N[2] = up(std::max(std::abs(before), std::abs(after)) * kGravity_m_s2);
  result.rate_N_s[2] = kInfinity;
  result.unbounded =
      "the load changes instantaneously: bound the motion before and after it with one constant_force each";
}

}  // namespace

EffectBounds truth_bounds(const EffectSpec& effect, const Model& model, const MotionSet& motion) {
  EffectBounds result;
  result.effect = effect.name;
  const auto nothing_known = [&](const char* why) { bound_all(kInfinity, kInfinity, why, result); };
  if (effect.is_expression()) {
    nothing_known("user-defined formulas have no enclosure");
    return result;
  }
  const std::string& name = effect.name;
  const EffectInfo& info = effect_info(name);
  const Values value = [&effect](const char* parameter) { return effect_value(effect, parameter); };
  if (name == "motor_lag" || name == "delay" || name == "thrust_ratio") {
    result.note = "acts through the loop";
  } else if (info.traits.shown_by == ShownBy::kTurning || name == "torque_bias" ||
             name == "downwash_torque" || name == "com_offset") {
    result.note = "a torque: no force";
  } else if (name == "sensor_delay" || name == "accelerometer_scale") {
    result.note = "affects only the accelerometer: no force";
  } else if (name == "constant_force") {
    const char* const axes[] = {"force_x_N", "force_y_N", "force_z_N"};
    for (int i = 0; i < 3; ++i) result.bias_N[i] = std::abs(value(axes[i]));
  } else if ((name == "downwash" || name == "ceiling") && value("tail") != 0) {
    nothing_known("wakes and ceilings have an enclosure only for tail = 0");
  } else if (name == "downwash" || name == "upper_lift" || name == "wake_delay") {
    bound_wake(name, value, motion, result);
  } else if (name == "drag_linear" || name == "drag_quadratic" || name == "drag_rotor" || name == "inflow") {
    bound_drag(name, value, model, motion, result);
  } else if (name == "ground" || name == "ceiling") {
    bound_surface(name, value, motion, result);
  } else if (name == "rotor_thrust") {
    bound_rotors(value, motion, result);
  } else if (name == "voltage_sag" || name == "thrust_saturation" || name == "translational_lift" ||
             name == "vortex_ring") {
    bound_thrust_factor(name, value, model, motion, result);
  } else if (name == "wall" || name == "wind_field") {
    bound_place(name, value, motion, result);
  } else if (name == "imu_tilt") {
    bound_tilt(value, motion, result);
  } else if (name == "tether") {
    bound_tether(value, motion, result);
  } else if (name == "payload_step") {
    bound_step(value, result);
  } else if (name == "pendulum") {
    nothing_known("the swing of a load depends on the whole past and has no enclosure");
  } else if (name == "battery") {
    nothing_known("scales the thrust with the voltage: use --uncertain battery=A:B");
  } else {
    nothing_known("has no enclosure; for the rate of a network use --network or --certificate");
  }
  return result;
}

std::vector<EffectBounds> truth_bounds(const Model& model, const MotionSet& motion) {
  std::vector<EffectBounds> result;
  for (const EffectSpec& effect : model.effects) result.push_back(truth_bounds(effect, model, motion));
  return result;
}

}  // namespace swarmcert::stability
