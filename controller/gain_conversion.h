/// @file Conversion between the paper's gains (Lambda, K) and PID gains, where both forms describe the same law, and of
/// gains that give forces into PID gains.
///
/// Per axis, with a = k / m: Kd = a + 2 l, Kp = 2 a l + l^2, Ki = a l^2, that is s^3 + Kd s^2 + Kp s + Ki = (s + a)(s +
/// l)^2. A PID law has this form only if its characteristic polynomial has a real double root -l with 0 < l < Kd / 2:
/// then l is a root of the derivative 3 l^2 - 2 Kd l + Kp = 0, and Ki = (Kd - 2 l) l^2. The gains shipped with firmware
/// may not have this form; the tracking theorem does not apply to them.
#pragma once

#include <cstdint>
#include <initializer_list>

#include "controller/position_law.h"

namespace swarmcert::controller {

/// Result of a conversion: success or the reason for failure.
enum class ConversionStatus : std::uint8_t {
  kOk,
  kMassNotPositive,
  kNotPositive,        ///< a gain is zero, negative or NaN
  kNoDoubleRoot,       ///< Kd^2 < 3 Kp: no real l exists, whatever Ki
  kOtherIntegralGain,  ///< a real l exists, but for a different Ki
};

/// Returns a description of the status.
inline const char* to_text(ConversionStatus status) {
  switch (status) {
    case ConversionStatus::kOk:
      return "the gains have both forms";
    case ConversionStatus::kMassNotPositive:
      return "the mass is not positive";
    case ConversionStatus::kNotPositive:
      return "a gain is not positive";
    case ConversionStatus::kNoDoubleRoot:
      return "Kd^2 < 3 Kp: no Lambda exists, whatever Ki";
    case ConversionStatus::kOtherIntegralGain:
      return "Lambda exists only for a different Ki";
  }
  return "unknown status";
}

/// PID gains of one axis.
template <typename Scalar>
struct AxisPid {
  Scalar Kp_1_s2, Kd_1_s, Ki_1_s3;
};

/// Composite gains of one axis, or the reason why there are none.
template <typename Scalar>
struct AxisComposite {
  ConversionStatus status = ConversionStatus::kNotPositive;
  Scalar lambda_1_s{}, k_kg_s{};
  /// For kOtherIntegralGain: the Ki nearest to the given one that is consistent with Kp and Kd; `lambda_1_s` belongs to
  /// it.
  Scalar needed_Ki_1_s3{};
};

template <typename Scalar>
inline AxisPid<Scalar> to_pid(const Scalar& lambda_1_s, const Scalar& k_kg_s, const Scalar& mass_kg) {
  const Scalar a = k_kg_s / mass_kg;
  const Scalar square = product(lambda_1_s, lambda_1_s);
  return {product(Scalar(2), product(a, lambda_1_s)) + square, a + product(Scalar(2), lambda_1_s),
          product(a, square)};
}

/// Gains of one axis of a law F = m_told (a_d + g) + kp e_p + kd e_v + ki int e_p, as of Mellinger's controller in the
/// Crazyflie firmware (parameters ctrlMel.*).
template <typename Scalar>
struct AxisForceGains {
  Scalar kp_N_m, kd_N_s_m, ki_N_ms;
};

/// Divides by the mass that the controller is told, not the one that a scale shows: the law is m_told times ours. If
/// both differ, so do feedforward and weight, by a constant force in steady flight that the integrator takes.
template <typename Scalar>
inline AxisPid<Scalar> to_pid(const AxisForceGains<Scalar>& force, const Scalar& mass_told_kg) {
  return {force.kp_N_m / mass_told_kg, force.kd_N_s_m / mass_told_kg, force.ki_N_ms / mass_told_kg};
}

/// @param relative_tolerance maximum deviation of Ki from (Kd - 2 l) l^2, relative to the latter; needed because gains
///   are published with few digits. Bounds for a law converted with a tolerance hold for the converted law.
template <typename Scalar>
inline AxisComposite<Scalar> to_composite(const AxisPid<Scalar>& pid, const Scalar& mass_kg,
                                          const Scalar& relative_tolerance) {
  const Scalar zero(0), two(2), three(3);
  AxisComposite<Scalar> result;
  if (!(mass_kg > zero)) {
    result.status = ConversionStatus::kMassNotPositive;
    return result;
  }
  const Scalar kp = pid.Kp_1_s2, kd = pid.Kd_1_s, ki = pid.Ki_1_s3;
  if (!(kp > zero && kd > zero && ki > zero)) return result;
  Scalar discriminant = product(kd, kd) - product(three, kp);
  // A triple root has discriminant 0, which rounding may turn negative.
  if (discriminant < zero && -discriminant <= product(relative_tolerance, product(kd, kd)))
    discriminant = zero;
  if (discriminant < zero) {
    result.status = ConversionStatus::kNoDoubleRoot;
    return result;
  }
  const Scalar root = square_root(discriminant);
  Scalar smallest_misfit = zero;
  for (const Scalar& lambda : {(kd - root) / three, (kd + root) / three}) {
    const Scalar a = kd - product(two, lambda);
    if (!(lambda > zero && a > zero)) continue;
    const Scalar needed = product(a, product(lambda, lambda));
    const Scalar misfit = absolute(ki - needed) / needed;
    if (result.lambda_1_s > zero && !(misfit < smallest_misfit)) continue;
    smallest_misfit = misfit;
    result.lambda_1_s = lambda;
    result.k_kg_s = product(mass_kg, a);
    result.needed_Ki_1_s3 = needed;
  }
  if (!(result.lambda_1_s > zero)) {
    result.status = ConversionStatus::kNoDoubleRoot;
    return result;
  }
  result.status =
      smallest_misfit <= relative_tolerance ? ConversionStatus::kOk : ConversionStatus::kOtherIntegralGain;
  return result;
}

}  // namespace swarmcert::controller
