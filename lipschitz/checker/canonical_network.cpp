#include "lipschitz/checker/canonical_network.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>

#include "lipschitz/checker/certificate_text.h"
#include "nn/weights/chain.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::check {
namespace {

using files::Json;
using files::Layer;
using files::Network;
using files::Weights;

constexpr int kMostWidth = 1 << 25;

/// Joins numbers into one string, because a JSON document should not have a node for each weight.
std::string joined(const double* numbers, std::size_t count) {
  std::string text;
  for (std::size_t k = 0; k < count; ++k) text += (k == 0 ? "" : " ") + files::hex_float(numbers[k]);
  return text;
}

Json layer_json(const Layer& layer) {
  const auto inputs = static_cast<std::size_t>(layer.inputs);
  Json rows = Json::array();
  for (int i = 0; i < layer.outputs; ++i)
    rows.push_back(joined(layer.weights.data() + static_cast<std::size_t>(i) * inputs, inputs));
  return {{"name", layer.name},
          {"tensor", layer.tensor.empty() ? Json() : Json(layer.tensor)},
          {"weights", std::move(rows)},
          {"biases", joined(layer.biases.data(), layer.biases.size())},
          {"weight_rounding", files::hex_float(layer.weight_rounding)},
          {"bias_rounding", files::hex_float(layer.bias_rounding)}};
}

/// Returns the place of a weight file: relative to the folder of network.toml, else its name.
std::string file_of(const Network& network, const Weights& weights) {
  const std::filesystem::path path(weights.path);
  if (network.path.empty()) return path.filename().string();
  return path.lexically_relative(std::filesystem::path(network.path).parent_path()).generic_string();
}

Json weights_json(const Network& network, const files::FunctionId& part, const Weights& weights) {
  Json layers = Json::array(), data_files = Json::object();
  for (const Layer& layer : weights.layers) layers.push_back(layer_json(layer));
  for (const auto& [name, hash] : weights.data_files) data_files[name] = hash;
  return {{"file", file_of(network, weights)},   {"sha256", weights.sha256},
          {"data_files", std::move(data_files)}, {"precision", files::name(weights.precision)},
          {"assumed", weights.assumed},          {"chain", files::chain_json(files::chain(network, part))},
          {"layers", std::move(layers)}};
}

Json hex_floats(const std::vector<double>& numbers) {
  Json list = Json::array();
  for (const double number : numbers) list.push_back(files::hex_float(number));
  return list;
}

// --- reading

/// Returns `json`, which must be an array: the members of an object would be iterated as well.
const Json& list(const Json& json, const std::string& where) {
  require(json.is_array(), where + " is not an array");
  return json;
}

std::vector<std::string> texts(const Json& json) { return json.get<std::vector<std::string>>(); }

/// Sets the activation and the number of outputs that keep their values: "tanh", or "tanh:8" for the first 8 only.
void set_activation(const std::string& op, Layer& layer, const std::string& where) {
  std::optional<files::Activation> found = files::activation_called(op);
  const std::size_t mark = op.rfind(':');
  if (!found && mark != std::string::npos) {
    int changed = 0;
    const char* const last = op.data() + op.size();
    const auto [end, error] = std::from_chars(op.data() + mark + 1, last, changed);
    found = files::activation_called(op.substr(0, mark));
    require(found && error == std::errc() && end == last && 0 < changed && changed < layer.outputs &&
                *found != files::Activation::kRelu && !files::function_of(*found).sorts(),
            where + ": unknown operation " + op);
    layer.kept = layer.outputs - changed;
  }
  require(found.has_value(), where + ": unknown operation " + op);
  require(layer.outputs % files::function_of(*found).group == 0, where + ": a layer does not fit " + op);
  layer.activation = *found;
}

Layer layer_of(const Json& json, const std::string& where) {
  files::require_keys(json, {"name", "tensor", "weights", "biases", "weight_rounding", "bias_rounding"},
                      where);
  Layer layer;
  layer.name = json["name"].get<std::string>();
  if (!json["tensor"].is_null()) layer.tensor = json["tensor"].get<std::string>();
  layer.biases = hex_floats_in(json["biases"]);
  for (const Json& row : list(json["weights"], where + ".weights")) {
    const std::vector<double> numbers = hex_floats_in(row);
    require(!numbers.empty() && numbers.size() < kMostWidth &&
                (layer.inputs == 0 || numbers.size() == static_cast<std::size_t>(layer.inputs)),
            where + ": rows of different lengths");
    layer.inputs = static_cast<int>(numbers.size());
    layer.weights.insert(layer.weights.end(), numbers.begin(), numbers.end());
    ++layer.outputs;
  }
  require(layer.outputs > 0 && layer.biases.size() == static_cast<std::size_t>(layer.outputs),
          where + ": not one bias per row");
  layer.weight_rounding = files::parse_hex_float(json["weight_rounding"].get<std::string>());
  layer.bias_rounding = files::parse_hex_float(json["bias_rounding"].get<std::string>());
  require(layer.weight_rounding >= 0 && layer.bias_rounding >= 0, where + ": a rounding is negative");
  return layer;
}

/// Requires that every number has the precision, which bounds on float32 evaluations rest on.
void require_precision(const Weights& weights, const std::string& where) {
  if (weights.precision != files::Precision::kFloat32) return;
  const auto is_float = [](double number) {
    return std::fabs(number) <= 0x1.fffffep127 && static_cast<double>(static_cast<float>(number)) == number;
  };
  for (const Layer& layer : weights.layers)
    require(std::all_of(layer.weights.begin(), layer.weights.end(), is_float) &&
                std::all_of(layer.biases.begin(), layer.biases.end(), is_float),
            where + ": a number is no float32");
}

/// Reads the layers and the activations, which only the chain states. check_chain() compares the rest of the chain.
Weights weights_of(const Json& json, const std::string& where) {
  Weights weights;
  weights.path = json.at("file").get<std::string>();
  weights.sha256 = json.at("sha256").get<std::string>();
  require(json.at("data_files").is_object(), where + ".data_files is not an object");
  for (const auto& [name, hash] : json.at("data_files").items())
    weights.data_files.emplace_back(name, hash.get<std::string>());
  weights.assumed = texts(json.at("assumed"));
  const std::string precision = json.at("precision").get<std::string>();
  require(precision == "float32" || precision == "float64", where + ": unknown precision");
  weights.precision = precision == "float32" ? files::Precision::kFloat32 : files::Precision::kFloat64;
  for (const Json& layer : list(json.at("layers"), where + ".layers"))
    weights.layers.push_back(layer_of(layer, where + ".layers"));
  require(!weights.layers.empty() && weights.layers.size() <= 10000, where + ".layers is empty or too long");
  std::size_t next = 0;
  for (const Json& step : list(json.at("chain"), where + ".chain")) {
    const std::string op = step.at("op").get<std::string>();
    if (op == "linear" || op == "clamp") continue;
    require(next + 1 < weights.layers.size(), where + ".chain has more activations than layers allow");
    set_activation(op, weights.layers[next++], where + ".chain");
  }
  require(next + 1 == weights.layers.size(), where + ".chain lacks an activation");
  for (std::size_t k = 1; k < weights.layers.size(); ++k)
    require(weights.layers[k].inputs == weights.layers[k - 1].outputs,
            where + ".layers do not fit one another");
  require_precision(weights, where);
  return weights;
}

/// The class invariant of Network.
void require_consistent(const Network& network) {
  const auto fits = [](bool holds) { require(holds, "network: its parts do not fit one another"); };
  const std::size_t stated = network.input_order.size();
  const std::size_t clamped = network.clamp ? network.clamp->lower.size() : 0;
  fits(stated == 0 || clamped == 0 || stated == clamped);
  std::size_t inputs = stated > 0 ? stated : clamped;
  if (network.plain) {
    fits(network.phi.empty() && network.rho.empty() && network.silent.empty());
    return fits(inputs == 0 || inputs == static_cast<std::size_t>(network.plain->inputs()));
  }
  fits(!network.phi.empty() && !network.rho.empty());
  const int hidden = network.phi.begin()->second.outputs(), outputs = network.rho.begin()->second.outputs();
  for (const auto& [kind, phi] : network.phi) {
    fits(phi.outputs() == hidden);
    if (kind == files::kGroundKind) {
      fits(phi.inputs() == files::kGroundInputs);
      continue;
    }
    if (inputs == 0) inputs = static_cast<std::size_t>(phi.inputs());
    fits(static_cast<std::size_t>(phi.inputs()) == inputs);
  }
  const int components = files::components(network.output_quantity);
  for (const auto& [kind, rho] : network.rho)
    fits(rho.inputs() == hidden && rho.outputs() == outputs && (components == 0 || components == outputs));
}

void read_input(const Json& json, Network& network) {
  files::require_keys(json, {"order", "clamp"}, "network.input");
  network.input_order = texts(json["order"]);
  std::vector<std::string> sorted = network.input_order;
  std::sort(sorted.begin(), sorted.end());
  require(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(), "network.input names one twice");
  if (json["clamp"].is_null()) return;
  files::require_keys(json["clamp"], {"lower", "upper"}, "network.input.clamp");
  files::InputClamp clamp = {files::parse_hex_floats(json["clamp"]["lower"]),
                             files::parse_hex_floats(json["clamp"]["upper"])};
  require(!clamp.lower.empty() && clamp.lower.size() == clamp.upper.size(),
          "network.input.clamp has other sizes");
  for (std::size_t k = 0; k < clamp.lower.size(); ++k)
    require(clamp.lower[k] <= clamp.upper[k], "network.input.clamp is empty");
  network.clamp = std::move(clamp);
}

/// Reads compositions "large+small>small", with kinds that the network has, sorted.
void read_silent(const Json& json, Network& network) {
  for (const std::string& name : texts(json)) {
    const std::size_t arrow = name.find('>');
    require(arrow != std::string::npos && network.rho.count(name.substr(arrow + 1)) == 1,
            "network.silent: " + name + " is not a composition");
    std::vector<std::string> kinds;
    for (std::size_t begin = 0; arrow > 0 && begin <= arrow;) {
      const std::size_t end = std::min(name.find('+', begin), arrow);
      kinds.push_back(name.substr(begin, end - begin));
      require(kinds.back() != files::kGroundKind && network.phi.count(kinds.back()) == 1,
              "network.silent: there is no phi of " + kinds.back());
      begin = end + 1;
    }
    require(std::is_sorted(kinds.begin(), kinds.end()), "network.silent: kinds are not sorted");
    require(network.silent[name.substr(arrow + 1)].insert(std::move(kinds)).second,
            "network.silent names a composition twice");
  }
}

std::string difference_of_layers(const Layer& a, const Layer& b, bool is_last) {
  if (a.name != b.name || a.tensor != b.tensor)
    return "another tensor, " + (b.tensor.empty() ? b.name : b.tensor);
  if (a.inputs != b.inputs || a.outputs != b.outputs) return "another shape";
  const auto first = std::mismatch(a.weights.begin(), a.weights.end(), b.weights.begin());
  if (first.first != a.weights.end()) {
    const auto at = first.first - a.weights.begin();
    return "weight [" + std::to_string(at / a.inputs) + ", " + std::to_string(at % a.inputs) + "]";
  }
  if (a.biases != b.biases) return "a bias";
  if (a.weight_rounding != b.weight_rounding || a.bias_rounding != b.bias_rounding) return "a rounding";
  if (!is_last && (a.activation != b.activation || a.kept != b.kept))
    return "another operation of the chain after it";
  return {};
}

std::string difference_of_parts(const Weights& a, const Weights& b, const std::string& where) {
  if (a.sha256 != b.sha256 || a.data_files != b.data_files || a.precision != b.precision)
    return where + " differs: the certificate was made for other weights than " + b.path;
  if (a.layers.size() != b.layers.size()) return where + ".chain is another one";
  for (std::size_t k = 0; k < a.layers.size(); ++k) {
    const std::string difference = difference_of_layers(a.layers[k], b.layers[k], k + 1 == a.layers.size());
    if (!difference.empty())
      return where + ".layers " + a.layers[k].name + ": " + b.path + " holds " + difference;
  }
  return {};
}

}  // namespace

Json canonical_json(const Network& network) {
  Json weights = Json::object();
  for (const auto& [part, stored] : files::parts(network))
    weights[part.name()] = weights_json(network, part, *stored);
  Json clamp;
  if (network.clamp)
    clamp = {{"lower", hex_floats(network.clamp->lower)}, {"upper", hex_floats(network.clamp->upper)}};
  return {{"description_sha256", network.sha256},
          {"options", files::options_json(network.options)},
          {"output", {{"quantity", network.output_quantity}, {"unit", network.output_unit}}},
          {"input", {{"order", network.input_order}, {"clamp", std::move(clamp)}}},
          {"silent", files::silent_compositions(network)},
          {"weights", std::move(weights)}};
}

Network canonical_network(const Json& json) {
  Network network;
  network.sha256 = json.at("description_sha256").get<std::string>();
  network.options = files::options_of(json.at("options"));
  files::require_keys(json.at("output"), {"quantity", "unit"}, "network.output");
  network.output_quantity = json["output"]["quantity"].get<std::string>();
  network.output_unit = json["output"]["unit"].get<std::string>();
  read_input(json.at("input"), network);
  for (const auto& [name, entry] : json.at("weights").items()) {
    const std::optional<files::FunctionId> part = files::FunctionId::parse(name);
    require(part && !part->is_set(), "network.weights: " + name + " is no network");
    Weights weights = weights_of(entry, "network.weights." + name);
    if (part->is_plain()) {
      network.plain = std::move(weights);
    } else {
      (part->is_phi() ? network.phi : network.rho).emplace(part->kind(), std::move(weights));
    }
  }
  require_consistent(network);
  read_silent(json.at("silent"), network);
  return network;
}

std::string first_difference(const Network& stated, const Network& read) {
  if (stated.sha256 != read.sha256)
    return "network.description_sha256 differs: the certificate was made for another network";
  const files::Parts a = files::parts(stated), b = files::parts(read);
  if (a.size() != b.size()) return "network.weights lists another number of networks";
  for (const auto& [part, weights] : a) {
    const auto other = b.find(part);
    if (other == b.end()) return "network.weights: the files hold no network " + part.name();
    const std::string difference =
        difference_of_parts(*weights, *other->second, "network.weights." + part.name());
    if (!difference.empty()) return difference;
  }
  const auto clamp = [](const Network& network) {
    return network.clamp ? std::make_pair(network.clamp->lower, network.clamp->upper)
                         : std::pair<std::vector<double>, std::vector<double>>();
  };
  const bool is_same = clamp(stated) == clamp(read) && stated.input_order == read.input_order &&
                       stated.silent == read.silent && stated.output_quantity == read.output_quantity &&
                       stated.output_unit == read.output_unit;
  return is_same ? ""
                 : "network.output, its unit, input or silent differ from the description of the network";
}

}  // namespace swarmcert::check
