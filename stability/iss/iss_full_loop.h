/// @file Repeats the worst disturbances of an IssCheck with attitude, rotors and thrust limits.
#pragma once

#include "stability/iss/iss_check.h"

namespace swarmcert::stability {

/// One disturbance in the full loop.
struct FullLoopRun {
  int run;       ///< index in IssCheck::runs, which has its kind and disturbance
  double ratio;  ///< largest |p~| / ball
  double at_s;
  double largest_tilt_rad;
  std::string left;      ///< the hypothesis whose violation ended the flight; empty: none
  double left_at_s = 0;  ///< when
  std::string failure;   ///< why the integration failed; empty: it did not
};

/// Flies the ramps and worst linear inputs of `check` along the three axes, as far as it has them, through the
/// continuous closed loop on SE(3) (ContinuousFlight): a hover including attitude law and rotors, with the motor lag of
/// the model or of the gains. While the attitude turns, the thrust vector differs from f_d, which the theorem's
/// hypotheses exclude: the ratio shows how much this costs. Only runs that satisfy the hypotheses without attitude are
/// flown. A flight ends when its thrust saturates, an integral reaches its clamp, the vehicle tips over or the
/// integration fails.
std::vector<FullLoopRun> fly_full_loop(const Gains& gains, const Model& model, const IssCheck& check);

}  // namespace swarmcert::stability
