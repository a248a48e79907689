#include "nn/weights/activation.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>

#include "nn/base/input_error.h"
#include "nn/weights/affine_map.h"
#include "nn/weights/relu_chain.h"

namespace swarmcert::files {
namespace {

constexpr char kLinear[] = "linear";  ///< no activation

/// constant + sum of factor * s(scale x + shift). Equals s(x) for every s except ReLU; x itself without terms.
struct ActivationTerms {
  struct Term {
    double scale, shift, factor;
  };
  std::vector<Term> terms;
  double constant = 0;
  Activation s = Activation::kRelu;

  bool is_s_itself() const { return terms.size() == 1; }
  bool is_linear() const { return terms.empty(); }
  /// Return the largest growth factor of a weight's rounding error in the layer before, or after, the activation.
  double share_in_front() const { return norm_of(&Term::scale); }
  double share_behind() const { return norm_of(&Term::factor); }

 private:
  double norm_of(double Term::*number) const {
    double squares = 0;
    for (const Term& term : terms) squares += term.*number * term.*number;
    return std::sqrt(squares);
  }
};

std::optional<ActivationTerms> terms_of(const std::string& name) {
  if (const std::optional<Activation> s = activation_called(name)) return ActivationTerms{{{1, 0, 1}}, 0, *s};
  if (name == kLinear) return ActivationTerms{};
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

/// Returns the activation of `before`, as a map of a new layer's outputs.
AffineMap activated(ReluChain& chain, const AffineMap& before, const ActivationTerms& activation,
                    const std::string& name) {
  if (activation.is_linear()) return before;
  if (activation.s != Activation::kRelu) return chain.activated(before, activation.s, {}, name);
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

/// Returns the layers with the activations `between` expressed as ReLU chains. @throws FoldingLimit.
std::vector<Layer> rewritten(const Weights& weights, const std::vector<ActivationTerms>& between) {
  constexpr double kUp = 1 + 1e-6;
  const std::vector<Layer>& own = weights.layers;
  ReluChain chain(weights.inputs());
  AffineMap current = map_of(own.front());
  for (std::size_t k = 1; k < own.size(); ++k)
    current = composed(map_of(own[k]), activated(chain, current, between[k - 1], own[k - 1].name));
  std::vector<Layer> layers = chain.finished(current, own.back().name);
  if (layers.size() != own.size()) {  // some were folded
    const auto is_rounded = [](const Layer& layer) {
      return layer.weight_rounding + layer.bias_rounding > 0;
    };
    if (std::any_of(own.begin(), own.end(), is_rounded))
      throw FoldingLimit{
          "layers without an activation between them are folded, but their weights were rounded"};
    return layers;
  }
  for (std::size_t k = 0; k < layers.size(); ++k) {  // earlier rounding errors enter every copy
    const double copies = (k < between.size() ? between[k].share_in_front() : 1) *
                          (k > 0 ? between[k - 1].share_behind() : 1) * kUp;
    const double constant = k > 0 ? std::fabs(between[k - 1].constant) : 0;
    layers[k].weight_rounding = (layers[k].weight_rounding + copies * own[k].weight_rounding) * kUp;
    layers[k].bias_rounding =
        (layers[k].bias_rounding + copies * own[k].bias_rounding +
         constant * own[k].weight_rounding * std::sqrt(static_cast<double>(own[k].inputs))) *
        kUp;
  }
  return layers;
}

/// Returns the activation names of the layers of `weights`: `names`, or a single name repeated between all layers.
std::vector<std::string> spread(const Weights& weights, const std::vector<std::string>& names) {
  return names.size() == 1 ? std::vector<std::string>(weights.layers.size() - 1, names.front()) : names;
}

}  // namespace

std::string activations() {
  return "relu, linear (none), leaky_relu (slope 0.01), leaky_relu:SLOPE, relu6, hardtanh, " +
         smooth_activations();
}

bool is_activation(const std::string& name) { return terms_of(name).has_value(); }

std::vector<std::string> listed_activations(const std::string& text) {
  std::vector<std::string> names = {""};
  for (const char c : text) {
    if (c == ',') {
      names.emplace_back();
    } else {
      names.back() += c;
    }
  }
  return names;
}

std::string activation_misfit(const Weights& weights, const std::string& text) {
  const std::vector<std::string> names = spread(weights, listed_activations(text));
  const std::size_t layers = weights.layers.size();
  if (weights.states_activation() && layers > 1) {
    const bool agrees =
        std::equal(names.begin(), names.end(), weights.layers.begin(), weights.layers.end() - 1,
                   [](const auto& name, const Layer& layer) { return op_after(layer) == name; });
    if (agrees) return "";
    const bool is_given = weights.activation_source == ActivationSource::kUser;
    return std::string(is_given ? "network.toml states " : "the file itself states ") +
           weights.activation_names() + " between its layers";
  }
  if (names.size() + 1 != layers && names.size() != layers)
    return "names " + std::to_string(names.size()) + " activations for " + std::to_string(layers) +
           (layers == 1 ? " layer: name one"
                        : " layers: name one, or " + std::to_string(layers - 1) +
                              " for those between the layers, or " + std::to_string(layers) +
                              " with one after the last layer");
  for (std::size_t k = 0; k < names.size(); ++k) {
    const std::optional<Activation> s = activation_called(names[k]);
    const int group = s ? function_of(*s).group : 1;
    if (weights.layers[k].outputs % group != 0)
      return names[k] + " follows the layer " + in_quotes(weights.layers[k].name) + " of " +
             std::to_string(weights.layers[k].outputs) + " outputs, no multiple of " + std::to_string(group);
  }
  return "";
}

namespace {

/// Returns the names as a list, or the only name that is in it.
std::string once_if_alike(const std::vector<std::string>& names) {
  std::string text = names.front();
  if (std::adjacent_find(names.begin(), names.end(), std::not_equal_to<>()) == names.end()) return text;
  for (std::size_t k = 1; k < names.size(); ++k) text += "," + names[k];
  return text;
}

/// Applies one name for each layer but the last, or one more.
Weights applied(Weights weights, const std::vector<std::string>& names, ActivationSource source) {
  std::vector<ActivationTerms> between;
  for (const std::string& name : names) {
    const std::optional<ActivationTerms> terms = terms_of(name);
    if (!terms) throw std::invalid_argument("with_activation: " + in_quotes(name) + " is unknown");
    between.push_back(*terms);
  }
  weights.activation_source = source;
  const bool states_end = names.size() == weights.layers.size();
  const auto is_settled = [states_end](const std::string& guess) {
    return guess.rfind(kBetweenGuess, 0) == 0 || (states_end && guess.rfind(kEndGuess, 0) == 0);
  };
  std::vector<std::string>& assumed = weights.assumed;
  assumed.erase(std::remove_if(assumed.begin(), assumed.end(), is_settled), assumed.end());
  const std::vector<Layer> stored = weights.layers;
  if (between.size() == weights.layers.size() && between.back().is_linear()) between.pop_back();
  if (between.size() == weights.layers.size()) {
    weights.end_in(between.back().s);
    weights.notes.push_back("the network ends in " + names.back() + ", which an identity layer follows");
  }
  std::vector<Activation> functions;
  for (const ActivationTerms& terms : between) functions.push_back(terms.s);
  weights.set_activations(functions);
  const auto is_itself = [](const ActivationTerms& terms) { return terms.is_s_itself(); };
  if (std::all_of(between.begin(), between.end(), is_itself)) return weights;
  const std::string text = once_if_alike(names);
  try {
    weights.layers = rewritten(weights, between);
  } catch (const FoldingLimit& limit) {
    throw InputError({weights.path, "", "activation", text, limit.what, "certify a smaller network"});
  }
  if (weights.stored.empty()) weights.stored = stored;
  if (weights.precision == Precision::kFloat32) weights.precision = least_precision(weights.layers);
  weights.notes.push_back("piecewise linear activations of " + text + " are written with ReLU");
  return weights;
}

/// Returns the name in activations() of an activation as MATLAB and PyTorch call it: "poslin", "LeakyReLU".
std::string known_name(std::string word) {
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  static const std::map<std::string, std::string> kOthers = {
      {"poslin", "relu"}, {"purelin", kLinear},  {"identity", kLinear},       {"none", kLinear},
      {"tansig", "tanh"}, {"logsig", "sigmoid"}, {"logistic", "sigmoid"},     {"satlins", "hardtanh"},
      {"swish", "silu"},  {"lin", kLinear},      {"leakyrelu", "leaky_relu"}, {"hard_tanh", "hardtanh"},
      {"rectify", "relu"}};
  const auto found = kOthers.find(word);
  return found == kOthers.end() ? word : found->second;
}

}  // namespace

Weights with_activation(Weights weights, const std::string& text) {
  const std::vector<std::string> names = spread(weights, listed_activations(text));
  for (const std::string& name : names)
    if (!is_activation(name))
      throw std::invalid_argument("with_activation: " + in_quotes(name) + " is unknown");
  const std::string misfit = activation_misfit(weights, text);
  if (!misfit.empty()) {
    const bool is_other = weights.states_activation();
    throw InputError({weights.path, "", "--activation", text, misfit,
                      is_other ? "leave --activation out" : "state what the network was trained with"});
  }
  if (weights.states_activation() || names.empty()) return weights;  // already stated, or nothing to set
  return applied(std::move(weights), names, ActivationSource::kUser);
}

Weights with_activation_of_file(Weights weights, const std::vector<std::string>& words,
                                const std::string& field) {
  std::vector<std::string> names;
  for (const std::string& word : words) names.push_back(known_name(word));
  names = spread(weights, names);
  const auto refuse = [&](const std::string& what) {
    throw InputError({weights.path, "", field, in_quotes(once_if_alike(words)), what,
                      "save the matrices alone, and state what is between them with --activation"});
  };
  for (const std::string& name : names)
    if (!is_activation(name)) refuse("names an activation that is not known");
  if (names.size() + 1 != weights.layers.size() && names.size() != weights.layers.size())
    refuse("names " + std::to_string(names.size()) + " activations for " +
           std::to_string(weights.layers.size()) + " layers");
  return applied(std::move(weights), names, ActivationSource::kFile);
}

}  // namespace swarmcert::files
