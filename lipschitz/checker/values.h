/// @file Values over boxes in exact arithmetic: intervals of layers and of sums, and how far off a float32 evaluation
/// is. Not for users.
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

/// What is known of a vector: where it lies, and how far off float32 arithmetic may have computed it.
struct Bounded {
  Intervals values;
  std::vector<Dyadic> error;  ///< entry by entry; empty: nothing is said of float32
};

/// Of W h + b for h in `inputs`.
/// @param inputs as many as the layer takes.
Intervals layer_intervals(const files::Layer& layer, const Intervals& inputs);
Intervals relu_intervals(Intervals intervals);
/// Of what leaves `layer`, behind its activation: number by number (values_between()), sorted, or kept.
Intervals activated_intervals(const files::Layer& layer, const Intervals& values);
/// Of what leaves the last layer of `weights`. At a point exact, without width, where all activations are ReLU or sort.
Intervals network_intervals(const files::Weights& weights, Intervals inputs);

/// Between `fewest` and `most` vectors of which all the same is known.
struct SumTerm : Bounded {
  long fewest = 0, most = 0;
};
/// Of the sum of all terms.
Intervals sum_intervals(const std::vector<SumTerm>& terms, std::size_t size);

/// How far, entry by entry, what float32 arithmetic computes of W h + b at most is from its value at h, if what it
/// computed before is within `error` of h. Sums of products in any order, with or without fused multiply-adds. Nothing
/// where it might overflow, or with more than 2^23 summands.
///
/// With u = 2^-24, an operation with exact result r returns r (1 + d) + e, |d| <= u, |e| <= 2^-150. A sum of n such
/// summands whose absolute values sum up to m is off by at most ((1 + u)^n - 1) m + (2 n - 1) 2^-150 (1 + u)^n (by
/// induction over the additions), and that by at most (n u + n^2 u^2) m + n 2^-148 while n u <= 1/2.
std::optional<std::vector<Dyadic>> layer_error(const files::Layer& layer, const Intervals& inputs,
                                               const std::vector<Dyadic>& error);
/// The same of a sum of terms that starts from zero.
std::optional<std::vector<Dyadic>> sum_error(const std::vector<SumTerm>& terms, std::size_t size);

/// The sum of squares of the largest absolute values.
Dyadic largest_square(const Intervals& intervals);
/// At least |f|^2 of the set function `function` among all neighbours from which one of its own kind comes or goes to a
/// composition in which NET is silent, by exact intervals layer by layer: the square of what f steps by there.
/// @param inputs the box of a part, as its first layer sees it.
Dyadic silent_step_square(const files::Network& network, const files::FunctionId& function,
                          const std::function<Intervals(const files::FunctionId& part)>& inputs);
const Dyadic& larger(const Dyadic& a, const Dyadic& b);
/// The sum of squares.
Dyadic square(const std::vector<Dyadic>& values);

}  // namespace swarmcert::check
