#include "nn/weights/activation.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "nn/base/input_error.h"
#include "nn/weights/affine_map.h"
#include "nn/weights/relu_chain.h"

namespace swarmcert::files {
namespace {

/// constant + sum of factor relu(scale x + shift).
struct ActivationTerms {
  struct Term {
    double scale, shift, factor;
  };
  std::vector<Term> terms;
  double constant = 0;
};

std::optional<ActivationTerms> terms_of(const std::string& name) {
  if (name == "relu6") return ActivationTerms{{{1, 0, 1}, {1, -6, -1}}, 0};
  if (name == "hardtanh") return ActivationTerms{{{1, 1, 1}, {1, -1, -1}}, -1};
  constexpr std::string_view kLeaky = "leaky_relu";
  if (name.compare(0, kLeaky.size(), kLeaky) != 0) return std::nullopt;
  double slope = 0.01;
  if (name.size() > kLeaky.size()) {
    const char* const last = name.data() + name.size();
    if (name[kLeaky.size()] != ':') return std::nullopt;
    const auto [end, error] = std::from_chars(name.data() + kLeaky.size() + 1, last, slope);
    if (error != std::errc() || end != last || !(std::fabs(slope) <= 1e6)) return std::nullopt;
  }
  return ActivationTerms{{{1, 0, 1}, {-1, 0, -slope}}, 0};
}

AffineMap map_of(const Layer& layer) {
  AffineMap map;
  map.inputs = layer.inputs;
  for (int i = 0; i < layer.outputs; ++i) {
    AffineMap::Row row;
    for (int j = 0; j < layer.inputs; ++j) {
      const double weight =
          layer.weights[static_cast<std::size_t>(i) * static_cast<std::size_t>(layer.inputs) +
                        static_cast<std::size_t>(j)];
      if (weight != 0) row.push_back({j, {weight, 0}});
    }
    map.rows.push_back(std::move(row));
    map.shift.push_back({layer.biases[static_cast<std::size_t>(i)], 0});
  }
  return map;
}

/// The activation of `before`, as a map of a new ReLU layer's outputs.
AffineMap activated(ReluChain& chain, const AffineMap& before, const ActivationTerms& activation,
                    const std::string& name) {
  std::vector<AffineMap> rows;
  for (const ActivationTerms::Term& term : activation.terms) {
    rows.push_back(before);
    scale_rows(rows.back(), {{term.scale, 0}});
    shift_rows(rows.back(), {{term.shift, 0}}, 1);
  }
  std::vector<const AffineMap*> pointers;
  for (const AffineMap& part : rows) pointers.push_back(&part);
  const AffineMap rectified = chain.relu(stacked(pointers), {}, name);
  AffineMap sum;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    std::vector<int> which;
    for (int i = 0; i < before.outputs(); ++i) which.push_back(static_cast<int>(k) * before.outputs() + i);
    AffineMap part = selected(rectified, which);
    scale_rows(part, {{activation.terms[k].factor, 0}});
    sum = k == 0 ? std::move(part) : sum_of(sum, part, 1);
  }
  shift_rows(sum, {{activation.constant, 0}}, 1);
  return sum;
}

}  // namespace

std::string activations() {
  return "relu, leaky_relu (slope 0.01), leaky_relu:SLOPE, relu6, hardtanh, " + smooth_activations();
}

bool is_activation(const std::string& name) {
  return activation_called(name).has_value() || terms_of(name).has_value();
}

bool Weights::has_groups_of(Activation other) const {
  const int group = function_of(other).group;
  return std::all_of(layers.begin(), layers.end(), [&](const Layer& layer) {
    return &layer == &layers.back() || layer.outputs % group == 0;
  });
}

Weights with_activation(Weights weights, const std::string& activation) {
  const std::optional<Activation> as_is = activation_called(activation);
  const std::optional<ActivationTerms> terms = terms_of(activation);
  if (!as_is && !terms) throw std::invalid_argument("with_activation: " + activation + " is unknown");
  if (weights.layers.size() == 1) return weights;  // nothing is between its layers
  if (weights.states_activation()) {
    if (as_is == weights.activation) return weights;
    throw InputError({weights.path, "", "--activation", activation,
                      (weights.activation_is_given ? "network.toml states " : "the file itself states ") +
                          function_of(weights.activation).words + " between its layers",
                      "leave --activation out"});
  }
  weights.activation_is_given = true;
  if (as_is) {
    if (!weights.has_groups_of(*as_is))
      throw InputError(
          {weights.path, "", "--activation", activation,
           "a hidden layer has no multiple of " + std::to_string(function_of(*as_is).group) + " outputs",
           "state the size of the groups that the network was trained with"});
    weights.activation = *as_is;
    return weights;
  }
  double scales = 0, factors = 0;
  for (const ActivationTerms::Term& term : terms->terms) {
    scales += term.scale * term.scale;
    factors += term.factor * term.factor;
  }
  try {
    ReluChain chain(weights.inputs());
    AffineMap current = map_of(weights.layers.front());
    for (std::size_t k = 1; k < weights.layers.size(); ++k)
      current =
          composed(map_of(weights.layers[k]), activated(chain, current, *terms, weights.layers[k - 1].name));
    std::vector<Layer> layers = chain.finished(current, weights.layers.back().name);
    for (std::size_t k = 0; k < layers.size(); ++k) {  // what was rounded before enters every copy
      constexpr double kUp = 1 + 1e-6;
      const double copies =
          std::sqrt(k + 1 < layers.size() ? scales : 1) * std::sqrt(k > 0 ? factors : 1) * kUp;
      layers[k].weight_rounding =
          (layers[k].weight_rounding + copies * weights.layers[k].weight_rounding) * kUp;
      layers[k].bias_rounding = (layers[k].bias_rounding + copies * weights.layers[k].bias_rounding +
                                 std::fabs(terms->constant) * weights.layers[k].weight_rounding *
                                     std::sqrt(static_cast<double>(weights.layers[k].inputs))) *
                                kUp;
    }
    weights.layers = std::move(layers);
  } catch (const FoldingLimit& limit) {
    throw InputError({weights.path, "", "--activation", activation, limit.what, "certify a smaller network"});
  }
  if (weights.precision == Precision::kFloat32) weights.precision = least_precision(weights.layers);
  weights.notes.push_back(activation + " between the layers is written with ReLU");
  return weights;
}

}  // namespace swarmcert::files
