/// @file Does the thrust of the loop that flies stay within its limits under all declared disturbances?
///
/// The law commands the force f_d = w e_z + u, with the weight w and u = feedback, fed-forward acceleration and errors
/// of the command. U_i = sup |u_i| over the declared inputs follows from the exact gains to the command of every axis
/// (of the sampled loop, and of the loop without integral plus the largest integral if its clamp may act); for x and y
/// it is infinite if attitude_objection() objects (around_attitude.h). Then
///   w - U_z <= f_d,z   and   |f_d| <= |(U_x, U_y, w + U_z)|.
/// If these are within the thrust's range, no declared input saturates the thrust, and the bounds of the linear loop
/// hold. The torques of the attitude law also use thrust of single rotors; that share is not contained.
#pragma once

#include <algorithm>
#include <string>

#include "stability/bounds/disturbance_source.h"
#include "stability/bounds/flown_loop.h"

namespace swarmcert::stability {

struct Saturation {
  enum class Verdict { kProved, kRefuted, kUndecided };
  Verdict verdict = Verdict::kUndecided;
  PerAxis feedback_N{};  ///< U, per axis; infinite if a class is unknown or the loop is unstable
  /// Largest |f_d| and smallest f_d,z that U allows, N.
  double most_N = 0, least_N = 0;
  Interval available_N;  ///< force of all rotors; the upper end is infinite if unknown
  /// Why the verdict is not `proved`: the counterexample, or what is missing; with numbers.
  std::string why;

  bool is_proved() const { return verdict == Verdict::kProved; }
  /// Returns the distance of the commanded forces from the nearer limit, N; negative: beyond it. -infinity: unknown.
  double margin_N() const { return std::min(available_N.upper - most_N, least_N - available_N.lower); }
  /// Returns the largest tilt of f_d that U allows, rad.
  double tilt_rad() const;
  /// Returns the force that the linear loop leaves out to second order at such tilts, N, an estimate: vertically, where
  /// the vehicle tilts elsewhere than commanded, 2 F sin^2 theta; horizontally, since the thrust F varies,
  /// (F_max - F_min) sin theta.
  double beyond_linear_N() const;
};

/// Returns the forces that the declared inputs may command, proved to be within the limits or undecided; `why` is that
/// of attitude_objection().
Saturation thrust_demand(const FlownLoop& loop, const DisturbanceSource& source, const InitialError& initial);

/// The same, with the reason where it is not proved. Refuted only with an input of the declared class that exceeds a
/// limit: the worst force of the linear loop, simulated with the clamp, or a ramp of a class that bounds nothing but
/// the rate.
Saturation saturation(const FlownLoop& loop, const DisturbanceSource& source, const InitialError& initial);

/// Judges commanded forces by U alone; an undecided verdict has no reason yet.
/// @param ratio_error on the thrust ratio, which narrows the range.
Saturation saturation_of(const FlownLoop& loop, const PerAxis& feedback_N, double ratio_error = 0);

/// Takes the integral out of the loop. Returns sup |u| due to the largest integral that its clamp allows, which then
/// acts as an error of the command, N.
double replace_integral_N(AxisLoop& loop, double limit_m_s);
double replace_integral_N(SampledLoop& loop, double limit_m_s);

/// Returns a number in four digits, for the reasons of verdicts.
std::string decimals(double value);

/// Returns "proved", "refuted" or "undecided".
const char* name(Saturation::Verdict verdict);

}  // namespace swarmcert::stability
