/// @file Which neurons a box decides: linear relaxation in double, every rounding accounted for. Shares no code with the
/// search (lipschitz/reach.h), which does the same for its own purposes.
#pragma once

#include <vector>

namespace swarmcert::check {

/// Inputs beyond this are not looked at: a coefficient that underflows could then matter.
inline constexpr double kLargestInput = 0x1p100;

/// y = W h + b of a hidden layer; h of the next one is relu(y). Exactly these doubles.
struct HiddenLayer {
  int outputs = 0, inputs = 0;
  std::vector<double> weights;  ///< [outputs x inputs], row-major
  std::vector<double> biases;
};

/// l <= y <= u for every neuron of every hidden layer, over one box.
struct NeuronBounds {
  std::vector<std::vector<double>> lower, upper;  ///< by layer
};

/// Bounds on all neurons over the box {lower <= x <= upper}, which hold in exact arithmetic.
///
/// A neuron y_ki = w h + b is substituted backwards layer by layer: with l < 0 < u,
///   max(0, y) <= s y + t  for any s >= 0 and t >= max(u - s u, -s l), and  max(0, y) >= a y  for 0 <= a <= 1,
/// so a linear form in h_j becomes one in y_j, whose coefficient is as stored. Rounding: multiplying a form by W_j in
/// floating point changes sum_c lambda_c W_jc h_c by at most gamma_n sum_c |lambda_c| |W_jc| max|h_c| in whatever order the
/// terms are added; constants are sums of at most N terms, wrong by at most N u times the sum of their absolute values
/// (Higham 2002, sections 3.1 and 4.2), twice that is added, and what underflow can cost for values up to 2^100. Larger
/// values and overflow make a bound infinite, a NaN is never used.
/// @param lower, upper at most kLargestInput in absolute value.
/// @param around bounds over a larger box, which hold here too; neurons that they decide keep them. May be null.
NeuronBounds neuron_bounds(const std::vector<HiddenLayer>& layers, const std::vector<double>& lower,
                           const std::vector<double>& upper, const NeuronBounds* around);

}  // namespace swarmcert::check
