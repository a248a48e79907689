/// @file Upper bounds of the gains of one sampled loop, verified from a witness. Trusts no search.
#pragma once

#include <vector>

#include "stability/checker/gain_bounds.h"

namespace swarmcert::check {

/// A sampled loop, and what shows that its responses decay.
struct SampledWitness : LoopNumbers {
  double period_s = 0;
  double integrator_step_s = 0;

  long steps = 0;  ///< periods that are followed; the rest is the tail
  double contraction =
      0;  ///< sqrt(r P r') falls at least by this factor when the row r goes to the period before
  std::vector<std::vector<double>> P;
};

/// Upper bounds, per unit of each input, at all times; see kTrackingStatement.
struct SampledGainBounds {
  GainBounds force, command, velocity, position;
};

/// The size of P: e, e', a number per lag, the integral where Ki > 0, and past commands that are still to act.
std::size_t order(const SampledWitness& loop);

/// The map M from one period to the next, rounded: what P has to show the contraction of.
std::vector<std::vector<double>> period_map(const SampledWitness& loop);

/// A row r over the state before the control of a period gives an output later on; r M gives the same output from the
/// state one period before. M is enclosed in integers over 2^128, from Taylor sums of the plant's exponential.
/// gamma^2 P - M P M' > 0 is verified by exact elimination, so that what rounding changes never grows, in the norm of
/// P, and is added up. A force acts within a period through r_2 + r_1 u, u the time until its end; an error of the
/// command or of an estimate through a column. What a constant input leaves after j periods is its limit less r (I -
/// M)^-1 b, enclosed by its residual. Sums over the periods, and over the tail by the contraction, give the gains of e
/// at the sampling times and of the command. Between them |e| <= max of both ends + period^2/8 sup|e''|: e'' is the
/// force plus an average of commands, whose mean age is at most the sum of the lags, the delay and one period.
/// @throws std::runtime_error with the reason where the witness shows nothing, or a number is out of range.
SampledGainBounds sampled_upper_gains(const SampledWitness& loop);

}  // namespace swarmcert::check
