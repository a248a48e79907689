/// @file Lower bounds on Lipschitz constants, proved by the slope between two points in exact arithmetic.
#pragma once

#include <gmpxx.h>

#include <string>
#include <vector>

#include "lipschitz/checker/bounds.h"
#include "nn/weights/function_id.h"
#include "nn/weights/network.h"
#include "nn/weights/weights.h"

namespace swarmcert::lipschitz {

/// g(x) = network(clamp(x)): one term of a deep set's sum, or a plain network. The pointers are not owned.
struct Term {
  const files::Weights* network = nullptr;
  const files::InputClamp* clamp = nullptr;  ///< null: none
};

/// A function of one vector x, the input of the one neighbour that moves; the points x_j are fixed:
///   f(x) = rho(moved(x) + sum_j others_j(x_j)),   or, if `rho` is null,   f(x) = moved(x).
/// The networks of `others` may differ in kind and in number of inputs; the ground's term is one of them.
struct SlopeFunction {
  Term moved;
  std::vector<Term> others;
  const files::Weights* rho = nullptr;
};

/// float32 points at which the slope of a SlopeFunction is taken, in the units of its inputs.
struct SlopePoints {
  std::vector<float> x, y;                 ///< [moved.network->inputs()], x != y
  std::vector<std::vector<float>> others;  ///< [number of others][inputs of that other]
};

/// Returns the function of NET named `function` ("network", "phi:<kind>", "rho:<kind>", "set:<phi kind>:<rho kind>"),
/// with its clamp and, for a set function, with the fixed neighbours `others` ("phi:<kind>" each).
/// @throws std::invalid_argument or std::out_of_range if NET has no such part, one of `others` is not a neighbour, the
///   ground, if NET has one, does not enter the sum exactly once, or NET is silent among these neighbours.
SlopeFunction slope_function(const files::Network& network, const files::FunctionId& function,
                             const std::vector<files::FunctionId>& others);

/// Returns the exact value of "network" at one point, or of a set function at the sum of its terms. `networks` names
/// the part of each point; it may be empty for a set function. The value is 0 if NET is silent among these neighbours.
/// @throws std::invalid_argument or std::out_of_range as slope_function(), or if a point does not fit its network, or
///   an activation is not ReLU.
std::vector<mpq_class> value(const files::Network& network, const files::FunctionId& function,
                             const std::vector<files::FunctionId>& networks,
                             const std::vector<std::vector<float>>& points);

/// Returns |f(x) - f(y)|_2^2 / |x - y|_2^2 for the weights as stored, as a rational number.
///
/// If all activations are ReLU or sort, nothing is rounded. Otherwise f(x) and f(y) are enclosed to about 2^-64 times
/// the gains of the layers behind an activation (network_intervals()), and the smallest value that the enclosures allow
/// is returned. By the definition of a Lipschitz constant, the square root is a lower bound on that of f over any
/// convex set that contains x and y, whether or not they lie on kinks. With a `block`, x and y agree outside of it, so
/// that the same number bounds the constant with respect to these coordinates alone.
/// @param block input coordinates that may differ between x and y; empty: all.
/// @param scale empty, or one positive number per input: |x - y|^2 is then sum_k ((x_k - y_k) / scale_k)^2.
/// Cost: about a millisecond for 6-25-40-40-20.
/// @throws std::invalid_argument if the sizes do not match, a coordinate is not finite, x == y, x and y differ outside
///   of `block`, or `block` names a coordinate that does not exist.
mpq_class slope_squared(const SlopeFunction& f, const SlopePoints& points, const std::vector<int>& block = {},
                        const std::vector<double>& scale = {});

/// Returns sqrt(slope_squared(...)), rounded down to a double whose square does not exceed the exact value.
LowerBound slope(const SlopeFunction& f, const SlopePoints& points, const std::vector<int>& block = {},
                 const std::vector<double>& scale = {});

/// Returns the largest double whose square is at most `square` >= 0, or the double below it; never above.
/// @throws std::invalid_argument if `square` is negative.
double sqrt_down(const mpq_class& square);

/// Returns whether all networks of f are ReLU networks.
bool is_relu(const SlopeFunction& f);

/// Validates a function.
/// @throws std::invalid_argument unless networks are given, their sizes compose, the clamps have one interval
///   lower <= upper per input, and `others` is empty if `rho` is null.
void check_function(const SlopeFunction& f);

}  // namespace swarmcert::lipschitz
