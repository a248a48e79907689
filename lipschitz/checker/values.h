/// @file Values over boxes in exact arithmetic: intervals of layers and sums, and errors of a float32 evaluation. Not
/// for users.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/checker/dyadic.h"
#include "lipschitz/checker/statement.h"
#include "nn/weights/activation_function.h"
#include "nn/weights/network.h"

namespace swarmcert::check {

/// lower[i] <= x_i <= upper[i].
struct Intervals {
  std::vector<Dyadic> lower, upper;
};

/// Intervals of a vector, and bounds on the error of its float32 evaluation, by Summation.
struct Bounded {
  Intervals values;
  std::array<std::vector<Dyadic>, 2> error = {};  ///< entry by entry; empty: no bound on float32 errors
  std::array<Dyadic, 2> added = {};  ///< norm of what the layers of this network add to the error

  bool has_error() const { return !error[kAnyOrder].empty(); }
};

/// Returns intervals of W h + b for h in `inputs`.
/// @param inputs one interval per input of the layer.
Intervals layer_intervals(const files::Layer& layer, const Intervals& inputs);
Intervals relu_intervals(Intervals intervals);
/// Returns intervals of the output of `layer` after its activation, which acts entry by entry (values_between()),
/// sorts, or leaves entries unchanged.
Intervals activated_intervals(const files::Layer& layer, const Intervals& values);
/// Returns intervals of the output of `weights`. At a point they are exact (without width) if all activations are ReLU
/// or sort.
Intervals network_intervals(const files::Weights& weights, Intervals inputs);

/// Between `fewest` and `most` terms that share the same bounds.
struct SumTerm : Bounded {
  long fewest = 0, most = 0;
};
/// Returns intervals of the sum of all terms.
Intervals sum_intervals(const std::vector<SumTerm>& terms, std::size_t size);

/// Returns what a layer makes of its input: exact intervals of W h + b and, where the input has errors, bounds on the
/// error of the float32 evaluation. Returns nothing if float32 might overflow or there are more than 2^23 summands.
///
/// With u = 2^-24, an operation with exact result r returns r (1 + d) + e, |d| <= u, |e| <= 2^-150. In any order, a sum
/// of n summands whose absolute values add up to m has an error of at most
///   ((1 + u)^n - 1) m + (2 n - 1) 2^-150 (1 + u)^n
/// (by induction over the additions), which is at most (n u + n^2 u^2) m + n 2^-148 as long as n u <= 1/2. In order,
/// each operation is off by at most half the distance between floats below a power of two above its result, which lies
/// between the ends of the partial sum. `added` grows by the norm of this after the norm of the matrix.
/// @param norm at least the spectral norm of the layer.
std::optional<Bounded> through_layer(const files::Layer& layer, const Dyadic& norm, const Bounded& input);
/// Returns what a sum of terms that starts from zero makes of them, in any order. Nothing as above.
std::optional<Bounded> through_sum(const std::vector<SumTerm>& terms, std::size_t size);
/// Returns a bound on the norm of the error behind a network: the smaller one of that of its entries and of that of the
/// input's error after `slope`, a Lipschitz bound of the network, with what the layers added.
Dyadic error_norm(const Bounded& output, const std::vector<Dyadic>& input_error, const Dyadic& slope,
                  Summation summation);

/// Returns the sum of squares of the largest absolute values.
Dyadic largest_square(const Intervals& intervals);
/// Returns an upper bound on the squared step of the set function `function` next to compositions in which NET is
/// silent: on |f|^2 over all compositions that become silent when one neighbour of the function's own kind enters or
/// leaves. By exact intervals, layer by layer.
/// @param inputs returns the box of a part as the input of its first layer.
Dyadic silent_step_square(const files::Network& network, const files::FunctionId& function,
                          const std::function<Intervals(const files::FunctionId& part)>& inputs);
const Dyadic& larger(const Dyadic& a, const Dyadic& b);

}  // namespace swarmcert::check
