/// @file Which neurons a box decides: linear relaxation in double, every rounding accounted for. Shares no code with
/// the search (lipschitz/values/reach.h), which does the same for its own purposes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace swarmcert::check {

/// Inputs beyond this are not looked at: a coefficient that underflows could then matter.
inline constexpr double kLargestInput = 0x1p100;

/// y = W h + b of a hidden layer; h of the next one is relu(y). Exactly these doubles.
struct HiddenLayer {
  int outputs = 0, inputs = 0;
  std::vector<double> weights;  ///< [outputs x inputs], row-major
  std::vector<double> biases;
  int without_relu = 0;  ///< of the outputs, the last so many pass as they are: h = y
  /// Empty, or y = W h + b + e with any e, least <= e <= most: what else enters a sum.
  std::vector<double> least = {}, most = {};
  bool has_relu(std::size_t output) const {
    return output + without_relu < static_cast<std::size_t>(outputs);
  }
};

/// {lower <= x <= upper}, one interval per input.
struct Sides {
  std::vector<double> lower, upper;
};

/// l <= y <= u for every neuron of every hidden layer, over one box.
struct NeuronBounds {
  std::vector<std::vector<double>> lower, upper;  ///< by layer
  std::vector<std::vector<double>> terms;         ///< |W| |h| + |b|, at least: what roundings are measured by
  std::vector<std::vector<double>> slope, offset;  ///< max(0, y) <= slope y + offset, where l < 0 < u
};

/// A neuron that other lower slopes decide: of the undecided ones before it, those get the lower slope 1 that are on at
/// a corner of the box, the others 0. On: y > kOnAtCorner (|W| |h| + |b|), so that rounding hardly matters; to what
/// follows it does not, since any slope in [0, 1] holds.
struct Decision {
  std::size_t neuron = 0;    ///< counted over all outputs of hidden layers
  bool is_on = false;        ///< y >= 0, else y <= 0
  std::uint64_t corner = 0;  ///< bit k: the upper end of input k, else the lower one
};
inline constexpr double kOnAtCorner = 0x1p-30;
/// Boxes of more inputs have no decisions: a corner would not fit.
inline constexpr int kMostCornerInputs = 48;

/// weight y of one neuron.
struct WeightedNeuron {
  std::size_t layer = 0;
  int output = 0;
  double weight = 0;
};

/// Bounds on all neurons over the box {lower <= x <= upper}, which hold in exact arithmetic.
///
/// A neuron y_ki = w h + b is substituted backwards layer by layer: with l < 0 < u,
///   max(0, y) <= s y + t  for any s >= 0 and t >= max(u - s u, -s l), and  max(0, y) >= a y  for 0 <= a <= 1,
/// so a linear form in h_j becomes one in y_j, whose coefficient is as stored. Rounding: multiplying a form by W_j in
/// floating point changes sum_c lambda_c W_jc h_c by at most gamma_n sum_c |lambda_c| |W_jc| max|h_c| in whatever order
/// the terms are added; constants are sums of at most N terms, wrong by at most N u times the sum of their absolute
/// values (Higham 2002, sections 3.1 and 4.2), twice that is added, and what underflow can cost for values up to 2^100.
/// Larger values and overflow make a bound infinite, a NaN is never used.
/// @param lower, upper at most kLargestInput in absolute value.
/// @param around bounds over a larger box, which hold here too; neurons that they decide keep them. May be null.
/// Outputs without a ReLU are substituted as they are.
NeuronBounds neuron_bounds(const std::vector<HiddenLayer>& layers, const std::vector<double>& lower,
                           const std::vector<double>& upper, const NeuronBounds* around);

/// Adds the bounds of the layers that `bounds`, of the first ones over the same box, does not have yet.
/// @param around of all layers over a larger box; may be null.
/// @param decisions of neurons of these layers; those of other layers are not looked at, nor are those of neurons that
///   are decided without. @returns whether all of them hold; the bounds hold in any case.
bool add_layers(NeuronBounds& bounds, const std::vector<HiddenLayer>& layers,
                const std::vector<double>& lower, const std::vector<double>& upper,
                const NeuronBounds* around, const std::vector<Decision>& decisions = {});

/// The largest value of first + second over the box that `bounds` are for, rounded up: each by its own form in x.
double largest_sum(const std::vector<HiddenLayer>& layers, const NeuronBounds& bounds,
                   const std::vector<double>& lower, const std::vector<double>& upper,
                   const WeightedNeuron& first, const WeightedNeuron& second);

}  // namespace swarmcert::check
