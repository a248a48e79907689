/// @file Bounds on the force of declared physical effects over a set of motions.
///
/// A network's certificate bounds the rate of f_hat. The learning error f_hat - f_a also requires f_a, which cannot be
/// measured exactly: here it is declared by the effects of a model file, and their bounds are computed.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "nn/base/interval.h"
#include "stability/model.h"

namespace swarmcert::stability {

/// Motions over which a declared truth is bounded. Infinite: unknown.
struct MotionSet {
  double relative_speed_m_s = std::numeric_limits<double>::infinity();  ///< |v_j - v| of every neighbour
  double speed_m_s = std::numeric_limits<double>::infinity();           ///< |v| of every vehicle
  double acceleration_m_s2 = std::numeric_limits<double>::infinity();   ///< |v'| of every vehicle
  int neighbours = 1;                                                   ///< number that act at once
  double neighbour_mass_kg = 0;                                         ///< mass of the heaviest
  /// Height difference to every neighbour, whichever is higher; from zero to infinity if unknown.
  double least_gap_m = 0, largest_gap_m = std::numeric_limits<double>::infinity();
  double least_height_m = 0, largest_height_m = std::numeric_limits<double>::infinity();
  double largest_thrust_N = 0;
  double thrust_rate_N_s = std::numeric_limits<double>::infinity();  ///< |(T b3)'|, the thrust as a vector
};

/// Force of one effect over a motion set. Every number is an upper bound in real arithmetic.
struct EffectBounds {
  std::string effect;
  double bias_N[3] = {0, 0, 0};       ///< constant part
  double amplitude_N[3] = {0, 0, 0};  ///< of the rest
  double rate_N_s[3] = {0, 0, 0};
  /// For fields of the position only: slopes of one neighbour's force, horizontal and vertical, as the small-gain test
  /// needs.
  double slope_across_N_m = 0, slope_along_N_m = 0;
  /// Rate attained at some motion of the set, by evaluation at a point; shows how tight the bound is. 0: unknown.
  double reached_rate_N_s = 0;
  std::string unbounded;  ///< why amplitude or rate is infinite; empty if both are finite
  std::string note;
};

/// Returns the bounds of one effect:
///   downwash, upper_lift   largest slope of the field by interval subdivision of the plane of distance and gap; N
///                          neighbours composed with the p-norm give at most N^(1/p) times one (Hoelder);
///   drags, inflow, ground, ceiling   by the product rule, from bounds of speed, acceleration, thrust and its rate;
///   voltage_sag, thrust_saturation, translational_lift, vortex_ring, wall, wind_field   likewise;
///   payload_step           its weight; the step itself has no bounded rate;
///   constant_force         a bias.
/// The swing of a pendulum depends on the whole past and has no bounds here. Effects that act through the loop
/// (motor_lag, delay, thrust_ratio) or on rotation alone contribute nothing. For all others (networks, user formulas)
/// the bounds are infinite and `unbounded` says why. The Gaussian tails that downwash and upper_lift cut off at seven
/// spreads are bounded as if they were not cut off.
EffectBounds truth_bounds(const EffectSpec& effect, const Model& model, const MotionSet& motion);

/// Returns the bounds of every effect of `model`.
std::vector<EffectBounds> truth_bounds(const Model& model, const MotionSet& motion);

}  // namespace swarmcert::stability
