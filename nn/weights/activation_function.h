/// @file The activation functions supported between the layers of a network, with bounds on their slopes.
#pragma once

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace swarmcert::files {

/// Activation function after a layer of a stored network.
enum class Activation : int {
  kRelu,
  kTanh,
  kSigmoid,
  kSoftplus,
  kElu,
  kSelu,
  kSilu,
  kGelu,
  kMaxMinHalves,  ///< of t_1 .. t_2h: max(t_i, t_(i+h)) for each i, then min(t_i, t_(i+h))
  kMaxMinPairs,   ///< of t_1 .. t_2h: max(t_(2i-1), t_2i) for each i, then min(t_(2i-1), t_2i)
  kGroupSort,     ///< plus the group size: see group_sort()
};

/// Maximum group size of GroupSort; the minimum is 2.
inline constexpr int kLargestGroup = 64;

/// Returns the activation that sorts each group of `size` adjacent numbers in ascending order.
/// @throws std::invalid_argument if `size` is out of range.
Activation group_sort(int size);

/// The properties of an activation s that bounds and chains need. For all t >= u, in exact arithmetic, least_slope (t -
/// u) <= s(t) - s(u) <= greatest_slope (t - u). A sorting activation acts on a whole layer, has no scalar slopes, and
/// is 1-Lipschitz in the Euclidean norm.
struct ActivationFunction {
  Activation activation;
  std::string op;     ///< name in chains and options: "tanh", "groupsort:2"
  std::string words;  ///< name in prose: "ReLU", "tanh"
  double least_slope, greatest_slope;
  double (*value)(double t);  ///< s(t), accurate to a few units in the last place; null if it sorts
  int group = 1;              ///< the layer's width must be a multiple of it

  bool sorts() const { return value == nullptr; }
  /// Returns whether s never decreases. If so, the slopes of s / greatest_slope are in [0, 1], as for ReLU.
  bool is_monotone() const { return least_slope >= 0; }
  /// Returns the Lipschitz constant in |s(t) - s(u)| <= steepest() |t - u|, for whole layers t and u.
  double steepest() const;
};

const ActivationFunction& function_of(Activation activation);

/// Applies a sorting activation to a layer of numbers of any type that has operator<.
/// @throws std::invalid_argument if the width is not a multiple of the group size.
template <class Number>
std::vector<Number> rearranged(Activation activation, std::vector<Number> layer) {
  const auto group = static_cast<std::size_t>(function_of(activation).group);
  if (layer.size() % group != 0)
    throw std::invalid_argument("rearranged: the width is not a multiple of the group size");
  if (activation != Activation::kMaxMinHalves && activation != Activation::kMaxMinPairs) {
    for (std::size_t first = 0; first < layer.size(); first += group)
      std::sort(&layer[first], &layer[first] + group);
    return layer;
  }
  const std::size_t half = layer.size() / 2;
  std::vector<Number> result(layer.size());
  for (std::size_t i = 0; i < half; ++i) {
    const bool is_halves = activation == Activation::kMaxMinHalves;
    const Number &a = layer[is_halves ? i : 2 * i], &b = layer[is_halves ? i + half : 2 * i + 1];
    result[i] = std::max(a, b);
    result[i + half] = std::min(a, b);
  }
  return result;
}

/// Applies s to a whole layer. @throws std::invalid_argument if its width is not a multiple of the group size.
std::vector<double> activated(Activation activation, std::vector<double> layer);

/// Returns the activation with this name, or nothing if the name is unknown.
std::optional<Activation> activation_called(const std::string& op);

/// Returns the names of all activations but ReLU: "tanh, sigmoid, ..., groupsort:SIZE".
std::string smooth_activations();

}  // namespace swarmcert::files
