/// @file Values over boxes in exact arithmetic: intervals of layers and sums, and errors of a float32 evaluation. Not
/// for users.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "lipschitz/checker/dyadic.h"
#include "nn/weights/activation_function.h"
#include "nn/weights/network.h"

namespace swarmcert::check {

/// lower[i] <= x_i <= upper[i].
struct Intervals {
  std::vector<Dyadic> lower, upper;
};

/// Intervals of a vector, and bounds on the error of its float32 evaluation.
struct Bounded {
  Intervals values;
  std::vector<Dyadic> error;  ///< entry by entry; empty: no bound on float32 errors
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

/// Returns a bound, entry by entry, on the difference between the float32 evaluation of W h + b and its exact value at
/// h, if the float32 input is within `error` of h. Sums of products may be computed in any order, with or without fused
/// multiply-adds. Returns nothing if float32 might overflow or there are more than 2^23 summands.
///
/// With u = 2^-24, an operation with exact result r returns r (1 + d) + e, |d| <= u, |e| <= 2^-150. A sum of n such
/// summands whose absolute values add up to m has an error of at most ((1 + u)^n - 1) m + (2 n - 1) 2^-150 (1 + u)^n
/// (by induction over the additions), which is at most (n u + n^2 u^2) m + n 2^-148 as long as n u <= 1/2.
std::optional<std::vector<Dyadic>> layer_error(const files::Layer& layer, const Intervals& inputs,
                                               const std::vector<Dyadic>& error);
/// The same for a sum of terms that starts from zero.
std::optional<std::vector<Dyadic>> sum_error(const std::vector<SumTerm>& terms, std::size_t size);

/// Returns the sum of squares of the largest absolute values.
Dyadic largest_square(const Intervals& intervals);
/// Returns an upper bound on the squared step of the set function `function` next to compositions in which NET is
/// silent: on |f|^2 over all compositions that become silent when one neighbour of the function's own kind enters or
/// leaves. By exact intervals, layer by layer.
/// @param inputs returns the box of a part as the input of its first layer.
Dyadic silent_step_square(const files::Network& network, const files::FunctionId& function,
                          const std::function<Intervals(const files::FunctionId& part)>& inputs);
const Dyadic& larger(const Dyadic& a, const Dyadic& b);
/// Returns the sum of squares.
Dyadic square(const std::vector<Dyadic>& values);

}  // namespace swarmcert::check
