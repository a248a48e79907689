/// @file LipSDP-Neuron bounds of chains whose neurons have slopes in any [a, b], or are sorted in groups: SiLU and
/// GELU, MaxMin and GroupSort, and boxes.
#pragma once

#include "lipschitz/upper/sdp_bound.h"

namespace swarmcert::lipschitz {

/// The program is dense if the neurons of a layer have different slope ranges. Such chains with more variables than
/// this (neurons plus inputs, after the inputs of a wide first stage are reduced to its rows) get the product of norms
/// only.
inline constexpr int kMostBentVariables = 1400;

/// sdp_bound() for such a chain. The optimum is at most the product of the norms times the steepest slope of each
/// layer.
///
/// Long chains in which all neurons of a layer have the same range [1 - c, c] are solved by minimise_chain(). Others
/// are solved by minimise() in the variables w = (z - a y) / sqrt(b - a), where y is the input and z the output of a
/// neuron. The constraint of a neuron is then w (sqrt(b - a) y - w) >= 0, which has rank two and involves a single w,
/// as RankTwoInequality requires. The matrix over (x, w) is dense, because y depends on all previous layers. The square
/// root keeps the multipliers of similar size even for narrow ranges. Groups are turned such that their sum is a neuron
/// of slope 1, which is eliminated, and the others share a multiplier.
/// @param chain a < b in each range.
/// @returns no proof if the slope ranges have another form and the chain has more than kMostBentVariables variables.
SdpBound bent_bound(const check::BentChain& chain, const SdpOptions& options = {});

/// (rho, t) of a program, in the units of the chain, in floating point: to be proved.
struct BentPoint {
  double rho = 0;
  std::vector<double> t;  ///< BentChain::multipliers() of them; those of sums are 0, to be chosen for a proof
};
/// The points that the solver of bent_bound() passes, best last, and how it ended.
struct BentPoints {
  std::vector<BentPoint> points;
  LipSdpStop stop = LipSdpStop::kNothingRun;
  int iterations = 0;
};
BentPoints bent_points(const check::BentChain& chain, const SdpOptions& options = {});

}  // namespace swarmcert::lipschitz
