/// @file Largest output under a force bounded in amplitude and in rate, given the output's step response.
#pragma once

#include <vector>

namespace swarmcert::stability {

/// The step response h of an output on a grid of nodes: h(0) = value[0] = 0, and value[i+1] is reached length[i] after
/// value[i]. On each cell the integral of |h - chord| is at most bend[i]; beyond the last node the integral of |h| is
/// at most `after`.
struct StepResponse {
  std::vector<double> value;
  std::vector<double> length;
  std::vector<double> bend;
  double after = 0;
  bool falls_after = false;  ///< true if |h| then decreases to zero without a sign change
};

/// Returns a bound on sup |y| over all f with |f| <= amplitude and |f'| <= rate, from rest. The supremum is a linear
/// program in f, whose dual is
///   min over u of  amplitude TV(u) + rate |h - u|_1.
/// It splits h into a part u that f excites through its amplitude and a rest that f excites through its rate. Every u
/// proves a bound. The u used here is the best one that is linear between some twenty thousand nodes (weighted
/// total-variation denoising, solved exactly by the slope trick), with the bound evaluated on all of them.
double split_bound(const StepResponse& h, double amplitude, double rate);

}  // namespace swarmcert::stability
