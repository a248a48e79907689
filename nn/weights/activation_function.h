/// @file The activation functions that a network can have between its layers, with their slopes.
#pragma once

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace swarmcert::files {

/// Between all layers of one stored network.
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
  kGroupSort,     ///< with the size of a group added: group_sort()
};

/// A group of GroupSort holds 2 to this many numbers.
inline constexpr int kLargestGroup = 64;

/// Sorts each `size` numbers side by side, the smallest first. @throws std::invalid_argument for another size.
Activation group_sort(int size);

/// What bounds and chains need to know of an activation s: for all t and u,
/// least_slope (t - u) <= s(t) - s(u) <= greatest_slope (t - u) where t >= u, in exact arithmetic.
/// One that sorts acts on a whole layer, has no slopes of single numbers, and is 1-Lipschitz in the Euclidean norm.
struct ActivationFunction {
  Activation activation;
  std::string op;     ///< in chains and as options take it: "tanh", "groupsort:2"
  std::string words;  ///< in texts: "ReLU", "tanh"
  double least_slope, greatest_slope;
  double (*value)(double t);  ///< s(t), rounded by a few units in the last place; null where it sorts
  int group = 1;              ///< the layer's width is a multiple of it

  bool sorts() const { return value == nullptr; }
  /// Whether s never decreases. Then s / greatest_slope has slopes in [0, 1], as ReLU has.
  bool is_monotone() const { return least_slope >= 0; }
  /// |s(t) - s(u)| <= steepest() |t - u|, for whole layers t and u.
  double steepest() const;
};

const ActivationFunction& function_of(Activation activation);

/// A layer as an activation that sorts leaves it, for numbers of any kind that < compares.
/// @throws std::invalid_argument if its width is no multiple of the group.
template <class Number>
std::vector<Number> rearranged(Activation activation, std::vector<Number> layer) {
  const auto group = static_cast<std::size_t>(function_of(activation).group);
  if (layer.size() % group != 0) throw std::invalid_argument("rearranged: no whole number of groups");
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

/// s of a whole layer. @throws std::invalid_argument if its width is no multiple of the group.
std::vector<double> activated(Activation activation, std::vector<double> layer);

/// The activation with this name; empty if the name is unknown.
std::optional<Activation> activation_called(const std::string& op);

/// "tanh, sigmoid, ..., groupsort:SIZE": all but ReLU.
std::string smooth_activations();

}  // namespace swarmcert::files
