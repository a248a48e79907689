#include "nn/weights/network.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/base/text.h"
#include "nn/base/toml.h"
#include "nn/weights/activation.h"
#include "nn/weights/functions.h"
#include "nn/weights/vec_normalize.h"

namespace swarmcert::files {
namespace {

constexpr char kSchema[] = "swarmcert/network/1";
constexpr char kGround[] = "ground";

const std::vector<std::string> kQuantities = {"force_z", "force", "torque"};
const std::vector<std::string> kForceUnits = {"gf", "N"}, kTorqueUnits = {"mN_m", "N_m"};
const std::vector<std::string> kScopes = {"layer", "network"}, kModes = {"clip", "equal"};

void describe_output(Keys& keys) {
  std::vector<std::string> units = kForceUnits;
  units.insert(units.end(), kTorqueUnits.begin(), kTorqueUnits.end());
  keys.must("quantity", "What is predicted.", "", OneOf{kQuantities});
  keys.must("unit", "Of a force, or of a torque.", "", OneOf{units});
}

void describe_gamma(Keys& keys) {
  keys.must<double>("value", "Limit of the spectral norms.");
  keys.must("scope", "What it limits.", "", OneOf{kScopes});
  keys.must("mode", "clip: at most the limit.", "", OneOf{kModes});
}

void describe_clamp(Keys& keys) {
  keys.must<std::vector<double>>("lower", "One number per input.");
  keys.must<std::vector<double>>("upper", "One number per input.");
}

void describe_input(Keys& keys) {
  keys.may<std::vector<std::string>>("order", "Inputs of phi, units in the names: dp_x_m, ..., dv_z_m_s.");
  keys.may_table("clamp", "Values between which the inputs are clamped.", describe_clamp);
}

void describe_part(Keys& keys) {
  keys.must<std::string>("weights", "Weight file.");
  keys.may<std::vector<std::string>>("order", "Layers in the order of evaluation.");
  keys.may<TextOrTexts>("select",
                        "Prefix of the layers of one network in a file that holds several; a list names a "
                        "chain in order of evaluation. Not beside order.");
  keys.may<TextOrTexts>("activation",
                        "Where the weight file does not state it: one name for what lies between all layers, "
                        "or one for each layer but the last, and one more where it follows the last layer.");
}

class NetworkReader {
 public:
  NetworkReader(const TomlTable& top, const std::string& path, const WeightsLoader& load)
      : top_(top), path_(path), load_(load) {}

  Network run() {
    top_.require_schema(kSchema);
    top_.allow_only(key_names(describe_network_file));
    network_.path = path_;
    if (top_.has("output")) read_output(top_.table("output"));
    if (top_.has("gamma")) read_gamma(top_.table("gamma"));
    if (top_.has("input")) read_input(top_.table("input"));
    read_weights("phi", network_.phi);
    read_weights("rho", network_.rho);
    check_phi();
    check_rho();
    if (top_.has("silent")) read_silent();
    return std::move(network_);
  }

 private:
  void read_output(const TomlTable& output) {
    output.allow_only(key_names(describe_output));
    output.choice("quantity", kQuantities);
    network_.output_quantity = output.text("quantity");
    output.choice("unit", network_.output_quantity == "torque" ? kTorqueUnits : kForceUnits);
    network_.output_unit = output.text("unit");
  }

  void read_gamma(const TomlTable& gamma) {
    gamma.allow_only(key_names(describe_gamma));
    GammaStatement statement;
    statement.value = gamma.number("value");
    if (!(statement.value > 0)) gamma.refuse("value", std::to_string(statement.value), "must be positive");
    statement.scope =
        gamma.choice("scope", kScopes) == 0 ? GammaStatement::Scope::kLayer : GammaStatement::Scope::kNetwork;
    statement.mode =
        gamma.choice("mode", kModes) == 0 ? GammaStatement::Mode::kClip : GammaStatement::Mode::kEqual;
    network_.gamma = statement;
  }

  void read_input(const TomlTable& input) {
    input.allow_only(key_names(describe_input));
    if (input.has("order")) {
      network_.input_order = input.texts("order");
      std::vector<std::string> sorted = network_.input_order;
      std::sort(sorted.begin(), sorted.end());
      const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
      if (twice != sorted.end()) input.refuse("order", in_quotes(*twice), "appears twice");
      if (sorted.empty()) input.refuse("order", "", "is empty");
    }
    if (!input.has("clamp")) return;
    const TomlTable clamp = input.table("clamp");
    clamp.allow_only(key_names(describe_clamp));
    InputClamp box = {clamp.numbers("lower"), clamp.numbers("upper")};
    const std::size_t inputs = network_.input_order.empty() ? box.lower.size() : network_.input_order.size();
    check_length(clamp, "lower", box.lower, inputs, "inputs");
    check_length(clamp, "upper", box.upper, inputs, "inputs");
    for (std::size_t i = 0; i < box.lower.size(); ++i) {
      if (box.lower[i] > box.upper[i]) {
        clamp.refuse("lower", files::Json(box.lower[i]).dump(),
                     "entry " + std::to_string(i) + " is above upper, " + files::Json(box.upper[i]).dump());
      }
    }
    network_.clamp = std::move(box);
  }

  static void check_length(const TomlTable& table, const std::string& key, const std::vector<double>& numbers,
                           std::size_t expected, const std::string& of) {
    if (numbers.size() == expected && expected > 0) return;
    table.refuse(key, std::to_string(numbers.size()) + " numbers",
                 "there are " + std::to_string(expected) + " " + of);
  }

  void read_weights(const std::string& role, std::map<std::string, Weights>& weights) {
    const TomlTable kinds = top_.table(role);
    if (kinds.keys().empty()) kinds.refuse("", "", "names no kind of vehicle", "add [" + role + ".<kind>]");
    for (const std::string& kind : kinds.keys()) {
      const TomlTable entry = kinds.table(kind);
      entry.allow_only(key_names(describe_part));
      // "set:<kind>:<kind>" is the name of a function.
      if (kind.find(':') != std::string::npos)
        kinds.refuse(in_quotes(kind), "", "a kind's name must not contain ':'", "rename the kind");
      const std::string file = entry.text("weights");
      if (file.empty() || file.find('\0') != std::string::npos) {
        entry.refuse("weights", in_quotes(file), "is not the name of a file");
      }
      const std::filesystem::path folder = std::filesystem::path(path_).parent_path();
      Weights read = load_((folder / file).string(), choice_of(entry));
      if (entry.has("activation")) {
        const std::string activation = activation_of(entry);
        const std::string misfit = activation_misfit(read, activation);
        if (!misfit.empty()) entry.refuse("activation", in_quotes(activation), misfit);
        read = with_activation(std::move(read), activation);
      }
      weights.emplace(kind, std::move(read));
    }
  }

  static LayerChoice choice_of(const TomlTable& entry) {
    LayerChoice choice;
    if (entry.has("order")) choice.order = entry.texts("order");
    if (entry.has("order") && choice.order.empty())
      entry.refuse("order", "[]", "names no layer",
                   "leave it out, or name the layers in order of evaluation");
    if (!entry.has("select")) return choice;
    choice.select =
        entry.is_list("select") ? entry.texts("select") : std::vector<std::string>{entry.text("select")};
    if (choice.select.empty() || !choice.order.empty())
      entry.refuse("select", "", choice.order.empty() ? "names no prefix" : "is beside order",
                   "name prefixes of layers, or their order");
    return choice;
  }

  /// Returns a name, or a comma-separated list of names, as used in certificates. Activations that are rewritten with
  /// ReLU can only be stated by --activation.
  static std::string activation_of(const TomlTable& entry) {
    const std::vector<std::string> names = entry.is_list("activation")
                                               ? entry.texts("activation")
                                               : std::vector<std::string>{entry.text("activation")};
    std::string activation;
    for (const std::string& name : names) {
      if (!activation_called(name))
        entry.refuse("activation", in_quotes(name), "must be one of relu, " + smooth_activations());
      activation += (activation.empty() ? "" : ",") + name;
    }
    if (names.empty())
      entry.refuse("activation", "[]", "is empty", "leave it out, or name one per layer but the last");
    return activation;
  }

  /// Compares the size `found` in a kind's network with the size it must have.
  void check_size(const std::string& role, const std::string& kind, const char* what, int found,
                  std::size_t expected, const std::string& because) const {
    if (found >= 0 && static_cast<std::size_t>(found) == expected) return;
    top_.table(role).table(kind).refuse("weights", std::to_string(found) + " " + what,
                                        "must be " + std::to_string(expected) + ": " + because);
  }

  void check_phi() const {
    const auto& [first_kind, first] = *network_.phi.begin();
    std::size_t inputs = network_.input_order.size();
    std::string because = "input.order names that many";
    if (inputs == 0 && network_.clamp) {
      inputs = network_.clamp->lower.size();
      because = "input.clamp has that many";
    }
    for (const auto& [kind, phi] : network_.phi) {
      check_size("phi", kind, "outputs", phi.outputs(), static_cast<std::size_t>(first.outputs()),
                 "all phi are summed, and phi." + first_kind + " has that many");
      if (kind == kGround) {
        check_size("phi", kind, "inputs", phi.inputs(), kGroundInputs, "the vehicle's own -z and -v");
        continue;
      }
      if (inputs == 0) {
        inputs = static_cast<std::size_t>(phi.inputs());
        because = "phi." + kind + " has that many";
      }
      check_size("phi", kind, "inputs", phi.inputs(), inputs, because);
    }
  }

  void check_rho() const {
    const auto& [first_kind, first] = *network_.rho.begin();
    const auto& [phi_kind, phi] = *network_.phi.begin();
    for (const auto& [kind, rho] : network_.rho) {
      check_size("rho", kind, "inputs", rho.inputs(), static_cast<std::size_t>(phi.outputs()),
                 "phi." + phi_kind + " has that many outputs");
      check_size("rho", kind, "outputs", rho.outputs(), static_cast<std::size_t>(first.outputs()),
                 "rho." + first_kind + " has that many");
      if (const int stated = components(network_.output_quantity); stated > 0) {
        check_size("rho", kind, "outputs", rho.outputs(), static_cast<std::size_t>(stated),
                   "output.quantity is " + network_.output_quantity);
      }
    }
  }

  void read_silent() {
    const std::vector<std::string> names = top_.texts("silent");
    if (names.empty()) top_.refuse("silent", "[]", "names no composition", "leave it out");
    for (const std::string& name : names) {
      const std::size_t arrow = name.find('>');
      if (arrow == std::string::npos)
        top_.refuse("silent", in_quotes(name), "is not a composition",
                    "write the kinds of the neighbours and of the vehicle, e.g. \"large+small>small\"");
      const std::string own = name.substr(arrow + 1);
      if (network_.rho.count(own) == 0)
        top_.refuse("silent", in_quotes(name), "there is no rho." + own, "name kinds that have one");
      if (!network_.silent[own].insert(neighbours_in(name, arrow)).second)
        top_.refuse("silent", in_quotes(name), "is named twice");
    }
  }

  /// Returns the kinds before the arrow, in alphabetical order.
  std::vector<std::string> neighbours_in(const std::string& name, std::size_t arrow) const {
    std::vector<std::string> kinds;
    for (std::size_t begin = 0; arrow > 0 && begin <= arrow;) {
      const std::size_t end = std::min(name.find('+', begin), arrow);
      kinds.push_back(name.substr(begin, end - begin));
      if (kinds.back() == kGround || network_.phi.count(kinds.back()) == 0)
        top_.refuse("silent", in_quotes(name), "there is no phi." + kinds.back() + " of a neighbour",
                    "name kinds that have one");
      begin = end + 1;
    }
    std::sort(kinds.begin(), kinds.end());
    return kinds;
  }

  const TomlTable& top_;
  const std::string& path_;
  const WeightsLoader& load_;
  Network network_;
};

bool is_network_toml(const std::string& path, const std::string& bytes) {
  if (files::ends_with(path, ".toml")) return true;
  const std::string_view beginning = std::string_view(bytes).substr(0, 1024);
  return beginning.find("swarmcert/network/") != std::string_view::npos &&
         beginning.find('\0') == std::string_view::npos;
}

/// Loads --phi F --rho F, for which error messages cannot refer to a line of network.toml.
Network load_pair(const NetworkArguments& arguments) {
  Network network;
  const Weights& phi =
      network.phi.emplace("default", load_weights(arguments.phi, arguments.key, arguments.phi_order))
          .first->second;
  const Weights& rho =
      network.rho.emplace("default", load_weights(arguments.rho, arguments.key, arguments.rho_order))
          .first->second;
  if (phi.outputs() != rho.inputs()) {
    throw InputError(
        {arguments.rho, "", rho.layers.front().name + ".weight", std::to_string(rho.inputs()) + " inputs",
         "must be " + std::to_string(phi.outputs()) + ": " + arguments.phi + " has that many outputs",
         "name a phi and a rho that were trained together"});
  }
  return network;
}

}  // namespace

void describe_network_file(Keys& keys) {
  keys.schema(kSchema);
  keys.may_table("output", "Quantity and unit of the output.", describe_output);
  keys.may_table("gamma", "Limit that the spectral norms were trained to.", describe_gamma);
  keys.may_table("input", "Order of the inputs, and between which values they are clamped.", describe_input);
  keys.may<std::vector<std::string>>(
      "silent",
      "Compositions without a network, kinds of the neighbours > kind of the vehicle: with as many "
      "neighbours of each kind, and no others, its output is 0.");
  keys.must_named_tables("phi", "By the kind of the neighbour; ground: the vehicle's own -z and -v.",
                         describe_part);
  keys.must_named_tables("rho", "By the kind of the vehicle.", describe_part);
}

int components(const std::string& quantity) { return quantity.empty() ? 0 : quantity == "force_z" ? 1 : 3; }

void require_force_z(const Network& network) {
  if (network.output_quantity.empty() || network.output_quantity == "force_z") return;
  throw InputError({network.path, "", "output.quantity", in_quotes(network.output_quantity),
                    "is not the vertical force, which flight code requires",
                    "name a network of force_z; this one can be simulated as an effect of a model"});
}

void require_torque(const Network& network) {
  if (network.output_quantity == "torque") return;
  throw InputError({network.path, "", "output.quantity", in_quotes(network.output_quantity),
                    "is not a torque", "name a network of train --quantity torque"});
}

Network parse_network(const std::string& text, const std::string& path, const WeightsLoader& load) {
  const toml::table document = parse_toml(text, path);
  const TomlTable top(document, path);
  Network network = NetworkReader(top, path, load).run();
  network.sha256 = sha256(text);
  return network;
}

Network as_float32(Network network) {
  if (network.plain) network.plain = as_float32(std::move(*network.plain));
  for (auto& [kind, weights] : network.phi) weights = as_float32(std::move(weights));
  for (auto& [kind, weights] : network.rho) weights = as_float32(std::move(weights));
  return network;
}

namespace {

Network load_as_stated(const NetworkArguments& arguments) {
  const bool is_pair = !arguments.phi.empty() && !arguments.rho.empty();
  if (arguments.file.empty() ? !is_pair : !(arguments.phi.empty() && arguments.rho.empty())) {
    throw std::invalid_argument("load_network: name one file, or a phi and a rho");
  }
  if (is_pair) return load_pair(arguments);
  LayerChoice choice = arguments.order;
  choice.select = arguments.select;
  const bool names_a_key =
      arguments.file.find('#') != std::string::npos && !std::filesystem::exists(arguments.file);
  if (names_a_key) {
    Network network;
    network.plain = load_weights(arguments.file, arguments.key, choice);
    return network;
  }
  const std::string bytes = read_file(arguments.file);
  if (is_network_toml(arguments.file, bytes)) {
    if (choice.is_stated())
      throw InputError({arguments.file, "", choice.order.empty() ? "--select" : "--order", "",
                        "applies to one weight file, and this file names several",
                        "write order = [...] or select = ... after weights = ..."});
    const WeightsLoader load = [&](const std::string& path, const LayerChoice& stated) {
      return load_weights(path, arguments.key, stated);
    };
    return parse_network(bytes, arguments.file, load);
  }
  Network network;
  network.plain = parse_weights(bytes, arguments.file, arguments.key, choice);
  return network;
}

Network with_normalization(Network network, const std::string& stated) {
  if (stated == "none") return network;
  if (!network.plain) {
    if (stated.empty()) return network;
    throw InputError({network.path, "", "--normalization", in_quotes(stated),
                      "is for one plain weight file, and this is a deep set", "leave it out"});
  }
  const std::string file = stated.empty() ? vec_normalize_beside(network.plain->path) : stated;
  if (file.empty()) return network;
  network.options.normalization = stated.empty() ? "" : from_folder_of(network.plain->path, file);
  return with_vec_normalize(std::move(network), file);
}

}  // namespace

void require_relu(const Network& network, const std::string& what) {
  for (const auto& [part, weights] : parts(network)) {
    if (weights->is_relu()) continue;
    throw InputError({weights->path, "", "activation", in_quotes(weights->activation_names()),
                      "is between the layers of " + part.name() + ", but " + what,
                      "only bounds for all inputs are available for this network: use certify"});
  }
}

bool is_relu(const Network& network, const FunctionId& function) {
  const Parts stored = parts(network);
  const std::vector<FunctionId> through = function.parts();
  return std::all_of(through.begin(), through.end(),
                     [&stored](const FunctionId& part) { return stored.at(part)->is_relu(); });
}

Network load_network(const NetworkArguments& arguments) {
  Network network = load_any_network(arguments);
  require_relu(network, "this command is for ReLU networks");
  return network;
}

Network with_activation(Network network, const std::string& activation) {
  const auto set = [&activation](Weights& weights) {
    weights = with_activation(std::move(weights), activation);
  };
  if (network.plain) set(*network.plain);
  for (auto& [kind, weights] : network.phi) set(weights);
  for (auto& [kind, weights] : network.rho) set(weights);
  return network;
}

Network load_any_network(const NetworkArguments& arguments) {
  Network network = load_as_stated(arguments);
  if (!arguments.activation.empty()) network = with_activation(std::move(network), arguments.activation);
  network.options = arguments;
  return with_normalization(std::move(network), arguments.normalization);
}

Json options_json(const ReadingOptions& options) {
  Json json = {{"key", options.key},
               {"order", options.order},
               {"phi_order", options.phi_order},
               {"rho_order", options.rho_order},
               {"select", options.select},
               {"activation", options.activation}};
  if (!options.normalization.empty()) json["normalization"] = options.normalization;
  return json;
}

ReadingOptions options_of(const Json& json) {
  std::set<std::string> keys = {"key", "order", "phi_order", "rho_order", "select", "activation"};
  const bool is_normalized = json.is_object() && json.contains("normalization");
  if (is_normalized) keys.insert("normalization");
  require_keys(json, keys, "network.options");
  const auto texts = [&json](const char* name) { return json[name].get<std::vector<std::string>>(); };
  ReadingOptions options;
  options.key = json["key"].get<std::string>();
  options.order = texts("order");
  options.phi_order = texts("phi_order");
  options.rho_order = texts("rho_order");
  options.select = texts("select");
  options.activation = json["activation"].get<std::string>();
  if (is_normalized) options.normalization = json["normalization"].get<std::string>();
  return options;
}

}  // namespace swarmcert::files
