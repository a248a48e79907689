/// @file Conversion between rotor force, PWM and battery voltage, with calibration polynomials from load cell data.
///
/// p = PWM / 65536, v = battery voltage / 4.2 V, g = force of one rotor in gram-force.
#pragma once

#include <cstdint>

#include "controller/position_law.h"
#include "controller/scalar.h"

namespace swarmcert::controller {

/// Newton per gram-force.
inline constexpr double kNewtonPerGramForce = 1e-3 * kGravity_m_s2;
/// Voltage of a fully charged cell, at which v = 1.
inline constexpr double kReferenceVoltage_V = 4.2;
/// Readings outside this range are impossible: the sensor has failed.
inline constexpr double kLowestVoltage_V = 2.0, kHighestVoltage_V = 5.0;

/// g = c00 + c10 p + c01 v + c20 p^2 + c11 p v.
template <typename Scalar>
struct ThrustMap {
  Scalar c00, c10, c01, c20, c11;
};

/// Maximum force g = e00 + e10 p + e01 v, where p is the mean over the motors: the voltage sags under load.
template <typename Scalar>
struct LargestForceMap {
  Scalar e00, e10, e01;
  Scalar lower_gf, upper_gf;  ///< limits on the result for any voltage reading
};

/// Returns the force of one rotor in newton, at least 0: outside the calibrated range the polynomial may be negative.
template <typename Scalar>
inline Scalar force_of_pwm(const ThrustMap<Scalar>& map, const Scalar& p, const Scalar& voltage_V) {
  const Scalar v = voltage_V / Scalar(kReferenceVoltage_V);
  const Scalar g = map.c00 + product(map.c10, p) + product(map.c01, v) + product(map.c20, product(p, p)) +
                   product(map.c11, product(p, v));
  return g < Scalar(0) ? Scalar(0) : product(g, Scalar(kNewtonPerGramForce));
}

/// Returns the p in [0, 1] at which `map` gives the force: the exact inverse of force_of_pwm() on its rising branch, by
/// the quadratic formula. Returns 0 if every p gives a larger force, for forces at or below zero and for NaN; 1 if
/// every p gives a smaller force.
template <typename Scalar>
inline Scalar pwm_of_force(const ThrustMap<Scalar>& map, const Scalar& force_N, const Scalar& voltage_V) {
  const Scalar zero(0), one(1), two(2), four(4);
  if (!(force_N > zero)) return zero;
  const Scalar v = voltage_V / Scalar(kReferenceVoltage_V);
  const Scalar a = map.c20;
  const Scalar b = map.c10 + product(map.c11, v);
  const Scalar c = map.c00 + product(map.c01, v) - force_N / Scalar(kNewtonPerGramForce);
  const Scalar discriminant = product(b, b) - product(four, product(a, c));
  // The force is below the minimum of the parabola (a > 0), or above its maximum (a < 0).
  if (discriminant < zero) return a > zero ? zero : one;
  // The root with slope 2 a p + b = +sqrt(discriminant), in the form without cancellation.
  const Scalar root = square_root(discriminant);
  const Scalar p = b > zero ? product(-two, c) / (b + root) : (root - b) / product(two, a);
  return p > zero ? (p < one ? p : one) : zero;
}

/// Returns the maximum force of one rotor in newton at this battery voltage, with the motors running at `mean_p`.
template <typename Scalar>
inline Scalar largest_force(const LargestForceMap<Scalar>& map, const Scalar& mean_p,
                            const Scalar& voltage_V) {
  const Scalar v = voltage_V / Scalar(kReferenceVoltage_V);
  const Scalar g = map.e00 + product(map.e10, mean_p) + product(map.e01, v);
  return product(clamp(g, map.lower_gf, map.upper_gf), Scalar(kNewtonPerGramForce));
}

/// Returns the PWM register value of p: rounded to the nearest of 0 to 65535, ties up; 0 for NaN. Converting an
/// out-of-range float to an integer is undefined, and hosts and targets differ in practice, so the range is checked
/// first.
template <typename Scalar>
inline std::uint16_t pwm_register(const Scalar& p) {
  const Scalar value = product(p, Scalar(65536)) + Scalar(0.5);
  if (!(value > Scalar(0))) return 0;
  if (value >= Scalar(65535)) return 65535;
  return static_cast<std::uint16_t>(value);
}

}  // namespace swarmcert::controller
