/// @file The worst disturbances of an IssCheck once more, flown with attitude, rotors and thrust limits.
#pragma once

#include "stability/iss/iss_check.h"

namespace swarmcert::stability {

/// One disturbance in the full loop.
struct FullLoopRun {
  int run;       ///< index in IssCheck::runs: its kind and disturbance
  double ratio;  ///< largest |p~| / ball
  double at_s;
  double largest_tilt_rad;
  std::string left;      ///< the hypothesis that the flight left, which ended it; empty: none
  double left_at_s = 0;  ///< when
  std::string failure;   ///< why it could not be integrated further; empty: it could
};

/// Flies ramps and worst linear inputs along the three axes, as far as `check` has them, through the continuous closed
/// loop on SE(3) (ContinuousFlight): a hover, attitude law and rotors included, the motor lag of the model or of the
/// gains. There the thrust vector is not f_d while the attitude turns, which the theorem's hypotheses exclude: the
/// ratio says how much that costs. Only runs that keep the hypotheses without attitude are flown. A flight ends where
/// its thrust saturates, an integral reaches its clamp or the vehicle tips over, and where it cannot be integrated
/// further.
std::vector<FullLoopRun> fly_full_loop(const Gains& gains, const Model& model, const IssCheck& check);

}  // namespace swarmcert::stability
