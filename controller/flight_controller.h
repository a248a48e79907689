/// @file One control period, from measured state to PWM, with a defined response to every invalid input.
///
/// The components (position law, attitude law, mixing, battery) have their own headers. This header combines them,
/// chooses a safe response when an input cannot be trusted, and reports it.
#pragma once

#include <cstdint>
#include <utility>

#include "controller/attitude_law.h"
#include "controller/battery.h"
#include "controller/desired_attitude.h"
#include "controller/mixing.h"
#include "controller/neighbours.h"
#include "controller/position_law.h"

namespace swarmcert::controller {

enum class AttitudeLaw : std::uint8_t { kLee, kRobust };

/// Settings that do not change in flight. `Gains` is PidGains or CompositeGains.
template <typename Scalar, typename Gains>
struct FlightSettings {
  Scalar mass_kg;
  Matrix3<Scalar> inertia_kg_m2;
  Gains position;
  Integrator<Scalar> integrator;
  ThrustRule thrust_rule = ThrustRule::kProjected;
  AttitudeLaw attitude_law = AttitudeLaw::kRobust;
  LeeGains<Scalar> lee;
  RobustGains<Scalar> robust;
  Scalar attitude_step_s;  ///< period of flight_step()
  Allocation<Scalar> allocation;
  ThrustMap<Scalar> thrust_map;
  LargestForceMap<Scalar> largest_force;
  Scalar idle_force_N;  ///< minimum force per rotor; below it motors may stop
};

/// Measurements with their time stamps.
template <typename Scalar>
struct Measured {
  Vector3<Scalar> position_W_m;
  Vector3<Scalar> velocity_W_m_s;
  std::uint32_t position_stamp_ms;
  AttitudeState<Scalar> attitude;
  std::uint32_t attitude_stamp_ms;
  Scalar battery_V;
};

/// The setpoint.
template <typename Scalar>
struct FlightReference {
  Vector3<Scalar> position_W_m;
  Vector3<Scalar> velocity_W_m_s;
  Vector3<Scalar> acceleration_W_m_s2;
  Heading<Scalar> heading;
  Vector3<Scalar> omega_R_rad_s;
  Vector3<Scalar> omega_dot_R_rad_s2;
};

/// Inputs that were not used. The values are bit flags.
enum Fault : std::uint8_t {
  kNoFault = 0,
  kPositionFault = 1,    ///< position or velocity: not finite, out of range or stale. Response: level descent
  kAttitudeFault = 2,    ///< attitude or rate: as above, or not a rotation. Response: motors off
  kReferenceFault = 4,   ///< not finite or out of range. Response: hold the last valid position setpoint
  kBatteryFault = 8,     ///< outside kLowestVoltage_V to kHighestVoltage_V. Response: kAssumedVoltage_V
  kPredictionFault = 16  ///< f_a_hat or tau_a_hat not finite or out of range. Response: use 0 instead
};

/// Maximum age of valid measurements: three consecutive losses at 30 Hz, ten at 500 Hz.
inline constexpr std::uint32_t kMaxPositionAge_ms = 100, kMaxAttitudeAge_ms = 20;
/// Larger values are treated as invalid.
inline constexpr int kLargestSpeed_m_s = 50, kLargestAcceleration_m_s2 = 50, kLargestRate_rad_s = 100;
inline constexpr int kLargestRateDerivative_rad_s2 = 10000;
/// Maximum ratio of |f_a_hat| to the vehicle's weight.
inline constexpr int kLargestEffectPerWeight = 2;
/// Maximum ratio of |tau_a_hat| to the vehicle's weight, in metre.
inline constexpr double kLargestTorquePerWeight_m = 0.1;
/// Assumed if the sensor has failed: low, so that the motors get too much rather than too little.
inline constexpr double kAssumedVoltage_V = 3.4;
/// Ratio of thrust to weight in the level descent: drag and the ground limit the speed to a few m/s.
inline constexpr double kDescentThrust = 0.9;

/// State that is carried from one period to the next.
template <typename Scalar>
struct FlightMemory {
  Vector3<Scalar> integral_m_s;
  Vector3<Scalar> rate_integral_rad;
  Vector3<Scalar> force_W_N;
  Matrix3<Scalar> R_WR = identity<Scalar>();
  FlightReference<Scalar> last_reference{};
  bool has_reference = false;
  bool thrust_saturated = false;
  Scalar mean_p{};
};

template <typename Scalar>
struct FlightCommand {
  std::uint8_t faults = kNoFault;  ///< sum of Fault
  bool motors_off = false;
  Vector3<Scalar> force_W_N;  ///< f_d
  AttitudeCase attitude_case = AttitudeCase::kRegular;
  Wrench<Scalar> wanted;
  Mixed<Scalar> mixed;
  decltype(pwm_register(std::declval<Scalar>())) pwm[kMostRotors] = {};
};

namespace detail {

template <typename Scalar>
inline bool is_usable(const FlightReference<Scalar>& r) {
  const Scalar length = product(r.heading.cosine, r.heading.cosine) + product(r.heading.sine, r.heading.sine);
  return is_within(r.position_W_m, Scalar(kFarthestPosition_m)) &&
         is_within(r.velocity_W_m_s, Scalar(kLargestSpeed_m_s)) &&
         is_within(r.acceleration_W_m_s2, Scalar(kLargestAcceleration_m_s2)) &&
         absolute(length - Scalar(1)) <= Scalar(0.01) &&
         is_within(r.omega_R_rad_s, Scalar(kLargestRate_rad_s)) &&
         is_within(r.omega_dot_R_rad_s2, Scalar(kLargestRateDerivative_rad_s2));
}

template <typename Scalar>
inline std::uint8_t faults(const Measured<Scalar>& m, std::uint32_t now_ms) {
  unsigned result = kNoFault;
  if (!is_within(m.position_W_m, Scalar(kFarthestPosition_m)) ||
      !is_within(m.velocity_W_m_s, Scalar(kLargestSpeed_m_s)) ||
      age_ms(now_ms, m.position_stamp_ms) > kMaxPositionAge_ms) {
    result |= kPositionFault;
  }
  if (!is_rotation(m.attitude.R_WB, Scalar(0.01)) ||
      !is_within(m.attitude.omega_B_rad_s, Scalar(kLargestRate_rad_s)) ||
      age_ms(now_ms, m.attitude_stamp_ms) > kMaxAttitudeAge_ms) {
    result |= kAttitudeFault;
  }
  if (!(m.battery_V >= Scalar(kLowestVoltage_V) && m.battery_V <= Scalar(kHighestVoltage_V)))
    result |= kBatteryFault;
  return static_cast<std::uint8_t>(result);
}

/// Runs the position loop and stores f_d and the desired attitude in `memory`.
template <typename Scalar, typename Gains>
inline AttitudeCase position_step(const FlightSettings<Scalar, Gains>& settings, FlightMemory<Scalar>& memory,
                                  const Measured<Scalar>& measured, const FlightReference<Scalar>& reference,
                                  const Vector3<Scalar>& effect_W_N, bool descend) {
  const Scalar weight_N = product(settings.mass_kg, Scalar(kGravity_m_s2));
  if (descend) {
    memory.force_W_N = {Scalar(0), Scalar(0), product(Scalar(kDescentThrust), weight_N)};
  } else {
    const TrackingError<Scalar> error{measured.position_W_m - reference.position_W_m,
                                      measured.velocity_W_m_s - reference.velocity_W_m_s};
    const HeldAxes held =
        held_axes(settings.position, error.position_m, memory.force_W_N, memory.thrust_saturated);
    memory.integral_m_s = integrate(settings.integrator, memory.integral_m_s, error.position_m, held);
    memory.force_W_N = desired_force(settings.position, settings.mass_kg, error, memory.integral_m_s,
                                     {reference.acceleration_W_m_s2, effect_W_N});
  }
  const DesiredAttitude<Scalar> desired =
      desired_attitude(memory.force_W_N, reference.heading, memory.R_WR, product(Scalar(0.05), weight_N));
  memory.R_WR = desired.R_WR;
  return desired.which;
}

template <typename Scalar, typename Gains>
inline Vector3<Scalar> attitude_torque(const FlightSettings<Scalar, Gains>& settings,
                                       FlightMemory<Scalar>& memory, const AttitudeState<Scalar>& state,
                                       const FlightReference<Scalar>& reference) {
  const AttitudeError<Scalar> error =
      attitude_error(state, {memory.R_WR, reference.omega_R_rad_s, reference.omega_dot_R_rad_s2});
  if (settings.attitude_law == AttitudeLaw::kLee) {
    return lee_torque(settings.lee, settings.inertia_kg_m2, state, error);
  }
  const ReferenceRate<Scalar> rate =
      reference_rate(settings.robust.Lambda_1_s, modified_rodrigues(error.R_RB), error);
  memory.rate_integral_rad = integrate_rate(settings.robust, memory.rate_integral_rad, state.omega_B_rad_s,
                                            rate.omega_r_rad_s, settings.attitude_step_s);
  return robust_torque(settings.robust, settings.inertia_kg_m2, state.omega_B_rad_s, rate,
                       memory.rate_integral_rad);
}

}  // namespace detail

/// Runs one period of the attitude loop, and one of the position loop if `position_is_due`.
/// @param effect_W_N       f_a_hat; zero if there is no network.
/// @param torque_effect_Nm tau_a_hat in the body frame; subtracted from the torque of the attitude law.
template <typename Scalar, typename Gains>
inline FlightCommand<Scalar> flight_step(const FlightSettings<Scalar, Gains>& settings,
                                         FlightMemory<Scalar>& memory, const Measured<Scalar>& measured,
                                         const FlightReference<Scalar>& wanted,
                                         const Vector3<Scalar>& effect_W_N, std::uint32_t now_ms,
                                         bool position_is_due, const Vector3<Scalar>& torque_effect_Nm = {}) {
  FlightCommand<Scalar> command;
  unsigned faults = detail::faults(measured, now_ms);

  FlightReference<Scalar> reference = wanted;
  if (detail::is_usable(wanted)) {
    memory.last_reference = wanted;
    memory.has_reference = true;
  } else {
    faults |= kReferenceFault;
    reference = {};
    reference.heading = memory.last_reference.heading;
    reference.position_W_m = memory.last_reference.position_W_m;
    // There has been no valid setpoint, so there is no position to hold.
    if (!memory.has_reference) faults |= kPositionFault;
  }
  Vector3<Scalar> effect = effect_W_N;
  const Scalar weight_N = product(settings.mass_kg, Scalar(kGravity_m_s2));
  if (!is_within(effect, product(Scalar(kLargestEffectPerWeight), weight_N))) {
    faults |= kPredictionFault;
    effect = {};
  }
  Vector3<Scalar> torque_effect = torque_effect_Nm;
  if (!is_within(torque_effect, product(Scalar(kLargestTorquePerWeight_m), weight_N))) {
    faults |= kPredictionFault;
    torque_effect = {};
  }
  command.faults = static_cast<std::uint8_t>(faults);
  if ((faults & kAttitudeFault) != 0) {
    command.motors_off = true;
    memory.rate_integral_rad = {};
    memory.mean_p = Scalar(0);
    return command;
  }

  if (position_is_due) {
    command.attitude_case =
        detail::position_step(settings, memory, measured, reference, effect, (faults & kPositionFault) != 0);
  }
  command.force_W_N = memory.force_W_N;
  command.wanted.thrust_N = collective_thrust(settings.thrust_rule, memory.force_W_N, measured.attitude.R_WB);
  command.wanted.torque_N_m =
      detail::attitude_torque(settings, memory, measured.attitude, reference) - torque_effect;

  const Scalar volts = (faults & kBatteryFault) != 0 ? Scalar(kAssumedVoltage_V) : measured.battery_V;
  const ForceLimits<Scalar> limits{settings.idle_force_N,
                                   largest_force(settings.largest_force, memory.mean_p, volts)};
  command.mixed = mix(settings.allocation, limits, command.wanted);
  if (!command.mixed.valid) {
    command.motors_off = true;
    return command;
  }
  memory.thrust_saturated = command.mixed.thrust_limited && command.mixed.thrust_N < command.wanted.thrust_N;
  Scalar sum(0);
  for (int i = 0; i < settings.allocation.count; ++i) {
    const Scalar p = pwm_of_force(settings.thrust_map, command.mixed.forces.at_N[i], volts);
    command.pwm[i] = pwm_register(p);
    sum = sum + p;
  }
  memory.mean_p = sum / static_cast<Scalar>(settings.allocation.count);
  return command;
}

}  // namespace swarmcert::controller
