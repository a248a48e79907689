/// @file Bounds on all neurons over a box by linear relaxation in double, with bounds on all round-off errors. Shares
/// no code with the search (lipschitz/values/reach.h), which has its own implementation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace swarmcert::check {

/// Larger inputs are refused, because a coefficient that underflows could then matter.
inline constexpr double kLargestInput = 0x1p100;

/// A hidden layer y = W h + b, exactly these doubles. The input h of the next layer is relu(y).
struct HiddenLayer {
  int outputs = 0, inputs = 0;
  std::vector<double> weights;  ///< [outputs x inputs], row-major
  std::vector<double> biases;
  int without_relu = 0;  ///< number of outputs, the last ones, without ReLU: h = y
  /// If not empty, y = W h + b + e with any e, least <= e <= most: the other terms of a sum.
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
  std::vector<std::vector<double>> lower, upper;   ///< by layer
  std::vector<std::vector<double>> terms;          ///< at least |W| |h| + |b|: the scale of round-off errors
  std::vector<std::vector<double>> slope, offset;  ///< max(0, y) <= slope y + offset if l < 0 < u
};

/// A neuron whose state is decided by better lower slopes: among the undecided neurons of the layers before it, those
/// that are on at a given corner of the box get the lower slope 1, the others 0. Here a neuron counts as on if
/// y > kOnAtCorner (|W| |h| + |b|), so that round-off hardly ever changes the choice. The choice does not affect
/// soundness, because every slope in [0, 1] is valid.
struct Decision {
  std::size_t neuron = 0;    ///< index over all outputs of hidden layers
  bool is_on = false;        ///< true: y >= 0, false: y <= 0
  std::uint64_t corner = 0;  ///< bit k set: the upper end of input k, else the lower end
};
inline constexpr double kOnAtCorner = 0x1p-30;
/// Boxes of more inputs have no decisions, because a corner would not fit into `corner`.
inline constexpr int kMostCornerInputs = 48;

/// `weight` times y of one neuron.
struct WeightedNeuron {
  std::size_t layer = 0;
  int output = 0;
  double weight = 0;
};

/// Returns bounds on all neurons over the box {lower <= x <= upper} that hold in exact arithmetic.
///
/// A neuron y_ki = w h + b is expressed in the inputs by backward substitution, layer by layer. With l < 0 < u,
///   max(0, y) <= s y + t  for any s >= 0 and t >= max(u - s u, -s l), and  max(0, y) >= a y  for 0 <= a <= 1,
/// so that a linear form in h_j becomes one in y_j; its coefficient is taken exactly as stored. Outputs without a ReLU
/// are substituted unchanged.
///
/// Round-off: multiplying a form by W_j in floating point changes sum_c lambda_c W_jc h_c by at most
/// gamma_n sum_c |lambda_c| |W_jc| max|h_c|, whatever the order of summation. Constants are sums of at most N terms,
/// whose error is at most N u times the sum of the absolute values (Higham 2002, sections 3.1 and 4.2). Twice that is
/// added, and the largest effect of underflow for values up to 2^100. Larger values and overflow make a bound infinite;
/// a NaN is never used.
/// @param lower, upper at most kLargestInput in absolute value.
/// @param around bounds over a larger box, which hold here too; neurons decided by them keep these bounds. May be null.
NeuronBounds neuron_bounds(const std::vector<HiddenLayer>& layers, const std::vector<double>& lower,
                           const std::vector<double>& upper, const NeuronBounds* around);

/// Completes `bounds`, which contains bounds of the first layers over the same box, by those of the remaining layers.
/// @param around bounds of all layers over a larger box; may be null.
/// @param decisions decisions for neurons of the added layers; decisions for other layers, and for neurons that are
///   decided anyway, are ignored.
/// @returns whether all these decisions hold; the bounds are valid in either case.
bool add_layers(NeuronBounds& bounds, const std::vector<HiddenLayer>& layers,
                const std::vector<double>& lower, const std::vector<double>& upper,
                const NeuronBounds* around, const std::vector<Decision>& decisions = {});

/// Returns an upper bound on first + second over the box of `bounds`, rounded up, from the sum of their linear forms in
/// x.
double largest_sum(const std::vector<HiddenLayer>& layers, const NeuronBounds& bounds,
                   const std::vector<double>& lower, const std::vector<double>& upper,
                   const WeightedNeuron& first, const WeightedNeuron& second);

}  // namespace swarmcert::check
