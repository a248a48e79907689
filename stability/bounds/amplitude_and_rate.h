/// @file Largest output under a force bounded in amplitude and in rate, given the output's step response.
#pragma once

#include <vector>

namespace swarmcert::stability {

/// The step response h of an output, from node to node: h(0) = value[0] = 0, value[i+1] at length[i] after value[i];
/// on each cell |h - chord| integrates to at most bend[i]; after the last node |h| integrates to at most `after`.
struct StepResponse {
  std::vector<double> value;
  std::vector<double> length;
  std::vector<double> bend;
  double after = 0;
  bool falls_after = false;  ///< whether |h| falls to zero there without changing its sign
};

/// sup |y| over all f with |f| <= amplitude, |f'| <= rate, from rest. It is a linear program in f; its dual is
///   min over u of  amplitude TV(u) + rate |h - u|_1,
/// a split of h: part of it sees f through its amplitude, the rest through its rate. Every u proves a bound, also the u
/// found here: the best that is linear between some twenty thousand nodes (weighted total-variation denoising, solved
/// exactly by slope trick), evaluated on all of them.
double split_bound(const StepResponse& h, double amplitude, double rate);

}  // namespace swarmcert::stability
