/// @file The activation functions that a network can have between its layers, with their slopes.
#pragma once

#include <optional>
#include <string>

namespace swarmcert::files {

/// Between all layers of one stored network.
enum class Activation { kRelu, kTanh, kSigmoid, kSoftplus, kElu, kSelu, kSilu, kGelu };

/// What bounds and chains need to know of an activation s: for all t and u,
/// least_slope (t - u) <= s(t) - s(u) <= greatest_slope (t - u) where t >= u, in exact arithmetic.
struct ActivationFunction {
  Activation activation;
  const char* op;     ///< in chains and as options take it: "tanh"
  const char* words;  ///< in texts: "ReLU", "tanh"
  double least_slope, greatest_slope;
  double (*value)(double t);  ///< s(t), rounded by a few units in the last place

  /// Whether s never decreases. Then s / greatest_slope has slopes in [0, 1], as ReLU has.
  bool is_monotone() const { return least_slope >= 0; }
  /// |s(t) - s(u)| <= steepest() |t - u|.
  double steepest() const;
};

const ActivationFunction& function_of(Activation activation);

/// The activation with this name; empty if the name is unknown.
std::optional<Activation> activation_called(const std::string& op);

/// "tanh, sigmoid, ...": all but ReLU.
std::string smooth_activations();

}  // namespace swarmcert::files
