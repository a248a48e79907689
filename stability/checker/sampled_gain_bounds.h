/// @file Upper bounds of the gains of one sampled loop, verified from a witness. No search is trusted.
#pragma once

#include <vector>

#include "stability/checker/gain_bounds.h"

namespace swarmcert::check {

/// A sampled loop, and the witness that its responses decay.
struct SampledWitness : LoopNumbers {
  double period_s = 0;
  double integrator_step_s = 0;

  long steps = 0;          ///< number of periods that are propagated; the rest is the tail
  double contraction = 0;  ///< sqrt(r P r') of a row r falls at least by this factor per period
  std::vector<std::vector<double>> P;
};

/// Upper bounds at all times, per unit of each input; see kTrackingStatement.
struct SampledGainBounds {
  GainBounds force, command, velocity, position;
};

/// Returns the size of P: e, e', one number per lag, the integral if Ki > 0, and past commands that are still to act.
std::size_t order(const SampledWitness& loop);

/// Returns the rounded map M from one period to the next, whose contraction P must prove.
std::vector<std::vector<double>> period_map(const SampledWitness& loop);

/// Let the row r over the state before the control of a period give an output at a later time; r M then gives the same
/// output from the state one period earlier. M is enclosed in integers over 2^128, by Taylor sums of the plant's
/// exponential. gamma^2 P - M P M' > 0 is verified by exact elimination; round-off errors therefore never grow in the
/// norm of P, and are summed. A force acts within a period through r_2 + r_1 u, u the time until its end; an error of
/// the command or of an estimate acts through a column. The response to a constant input after j periods is its limit
/// less r (I - M)^-1 b, enclosed by its residual. Sums over the periods, and over the tail by the contraction, give the
/// gains of e at the sampling times and of the command. Between them |e| <= max of both ends + period^2/8 sup|e''|: e''
/// is the force plus an average of commands, whose mean age is at most the sum of the lags, the delay and one period.
/// @throws std::runtime_error with the reason if the witness proves nothing, or a number is out of range.
SampledGainBounds sampled_upper_gains(const SampledWitness& loop);

}  // namespace swarmcert::check
