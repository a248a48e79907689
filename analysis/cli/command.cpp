#include "analysis/cli/command.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "analysis/cli/command_line.h"
#include "analysis/cli/host.h"
#include "analysis/report/report_text.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/text.h"
#include "nn/weights/activation.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {

namespace {

/// Parses "fc1,fc2" or, with --phi and --rho, "phi=fc1,fc2".
void add_order(files::NetworkArguments& arguments, const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string part = equals == std::string::npos ? "" : text.substr(0, equals);
  const bool names_part = part == "phi" || part == "rho";
  std::vector<std::string>& order = part == "phi"   ? arguments.phi_order
                                    : part == "rho" ? arguments.rho_order
                                                    : arguments.order;
  if (!order.empty()) throw UsageError("--order " + text + ": the order of these layers was already given");
  order = files::split_at_commas(names_part ? text.substr(equals + 1) : text);
  if (order.empty()) throw UsageError("--order names no layer: give them as in fc1,fc2,fc3");
}

constexpr const char* kHalvesOrPairs =
    "maxmin:halves compares entry i with entry i of the layer's second half, maxmin:pairs adjacent entries; "
    "the larger ones come first";

void set_activation(files::NetworkArguments& arguments, const std::string& text) {
  for (const std::string& name : files::listed_activations(text)) {
    if (files::is_activation(name)) continue;
    throw UsageError("--activation " + text + ": " + files::in_quotes(name) +
                     " is not an activation with known slopes; these are " + files::activations() +
                     (name == "maxmin" ? std::string("; ") + kHalvesOrPairs + " in both" : ""));
  }
  arguments.activation = text;
}

}  // namespace

bool CommonOptions::prints_text() const { return json != "-" && host() == nullptr; }

void declare_order(CLI::App& app, files::NetworkArguments& arguments) {
  app.add_option_function<std::vector<std::string>>(
         "--order",
         [&arguments](const std::vector<std::string>& orders) {
           for (const std::string& order : orders) add_order(arguments, order);
         },
         "Layers in the order of evaluation, if the weight file does not store it: fc1,fc2,fc3; with --phi "
         "and --rho phi=fc1,fc2 and rho=fc1,fc2")
      ->allow_extra_args(false);
  app.add_option(
         "--select", arguments.select,
         "Prefix of the layers of one network in a file that holds several, e.g. actor; several for a "
         "chain, in order of evaluation: encoder,head. Of policies of Stable-Baselines3: policy or value")
      ->delimiter(',')
      ->allow_extra_args(false);
}

void declare_activation(CLI::App& app, files::NetworkArguments& arguments) {
  app.add_option_function<std::string>(
      "--activation", [&arguments](const std::string& name) { set_activation(arguments, name); },
      "Activation between the layers, which a state dict does not store (default: relu): one name for all, "
      "or one for "
      "each "
      "layer but the last, and one more if it follows the last layer, as in relu,relu,tanh. Others than ReLU "
      "can be certified and checked: " +
          files::activations() + ". " + kHalvesOrPairs + "; groupsort sorts upwards");
}

namespace {

void declare_normalization(CLI::App& app, files::NetworkArguments& arguments) {
  app.add_option(
      "--normalization", arguments.normalization,
      "File that VecNormalize.save() of Stable-Baselines3 wrote: inputs are observations before their "
      "normalization; none: they are normalized. Default: vec_normalize.pkl beside a policy's .zip, if there "
      "is one");
}

}  // namespace

void declare_network(CLI::App& app, files::NetworkArguments& arguments) {
  auto* file =
      app.add_option("NET", arguments.file, "network.toml, or a weight file that holds one plain network");
  auto* phi =
      app.add_option("--phi", arguments.phi, "Weight file of phi, evaluated per neighbour (kind: default)");
  auto* rho =
      app.add_option("--rho", arguments.rho, "Weight file of rho, evaluated on the sum (kind: default)");
  phi->needs(rho)->excludes(file);
  rho->needs(phi)->excludes(file);
  app.add_option("--key", arguments.key, "Key of the state dict inside a nested checkpoint, e.g. model");
  declare_activation(app, arguments);
  declare_order(app, arguments);
  declare_normalization(app, arguments);
}

files::Network load_net(const files::NetworkArguments& arguments) {
  files::Network network = load_any_net(arguments);
  files::require_relu(network, "this command is for ReLU networks");
  return network;
}

files::Network load_any_net(const files::NetworkArguments& arguments) {
  if (host() != nullptr && host()->network) {
    return arguments.activation.empty() ? *host()->network
                                        : files::with_activation(*host()->network, arguments.activation);
  }
  if (arguments.file.empty() && arguments.phi.empty()) {
    throw UsageError("no network: name a network.toml, one weight file, or --phi F --rho F");
  }
  const bool has_pair = !arguments.phi.empty();
  if (!arguments.select.empty() && (has_pair || !arguments.order.empty()))
    throw UsageError("--select is for one weight file, without --order");
  if (has_pair ? !arguments.order.empty() : !arguments.phi_order.empty() || !arguments.rho_order.empty())
    throw UsageError(has_pair ? "--order: state the file: --order phi=fc1,fc2 or rho=fc1,fc2"
                              : "--order phi=... and rho=... go with --phi and --rho");
  return files::load_any_network(arguments);
}

std::vector<std::string> network_words(const files::NetworkArguments& arguments) {
  std::vector<std::string> words;
  const auto add = [&words](const std::string& option, const std::string& value) {
    if (value.empty()) return;
    if (!option.empty()) words.push_back(option);
    words.push_back(value);
  };
  add("", arguments.file);
  add("--phi", arguments.phi);
  add("--rho", arguments.rho);
  add("--key", arguments.key);
  add("--activation", arguments.activation);
  add("--order", fmt::format("{}", fmt::join(arguments.order, ",")));
  for (const std::string& prefix : arguments.select) add("--select", prefix);
  return words;
}

void print_next(const CommonOptions& common, std::vector<std::string> words) {
  words.insert(words.begin(), "swarmcert");
  if (common.prints_text()) fmt::print("Next: {}\n", shell_line(words));
}

std::vector<std::string> reading_notes(const files::Weights& weights) {
  std::vector<std::string> notes = weights.notes;
  for (const std::string& unused : weights.unused) notes.push_back("unused: " + unused);
  const double rounding = files::rounding_of_slope(weights);
  if (rounding > 0)
    notes.push_back(
        fmt::format("folded numbers that are not doubles, and the constants of Selu, are rounded; the bounds "
                    "for all inputs "
                    "plus {:.2g} hold for the exact ones",
                    rounding));
  return notes;
}

namespace {

/// Returns `paths` with each folder, such as a rosbag2 bag, replaced by the files in it.
std::vector<std::string> regular_files(const std::vector<std::string>& paths) {
  std::vector<std::string> all;
  for (const std::string& path : paths) {
    if (!std::filesystem::is_directory(path)) {
      all.push_back(path);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : std::filesystem::directory_iterator(path))
      if (entry.is_regular_file()) inside.push_back(entry.path().string());
    std::sort(inside.begin(), inside.end());
    all.insert(all.end(), inside.begin(), inside.end());
  }
  return all;
}

}  // namespace

namespace {

void describe_head(files::Record& record, const std::string& command, const std::vector<std::string>& inputs,
                   std::optional<std::uint64_t> seed) {
  record.constant("schema", "swarmcert/" + command + "/1", "Name and version of this format.");
  record.field("tool", "swarmcert " SWARMCERT_VERSION, "Name and version of the tool that wrote this.");
  record.field("command_line", command_line(),
               "Words of the command line, without outputs and what cannot change the result.");
  record.list("inputs", inputs, "Files that were read.", [](files::Record& file, const std::string& path) {
    file.field("file", path, "Path as it was given or found.");
    file.field("sha256", path.empty() ? "" : files::sha256_of_file(path), "Of the content, hexadecimal.");
  });
  record.field("seed", seed, "Of the random numbers; null: none are used.");
}

}  // namespace

files::Node described_result(const std::string& command, const std::vector<std::string>& input_files,
                             std::optional<std::uint64_t> seed,
                             const std::function<void(files::Record&)>& describe_fields) {
  files::Node result;
  files::Record record(result, false);
  describe_head(record, command, regular_files(input_files), seed);
  describe_fields(record);
  return result;
}

files::Node result_shape(const std::string& command,
                         const std::function<void(files::Record&)>& describe_fields) {
  files::Node shape;
  files::Record record(shape, true);
  describe_head(record, command, {}, std::nullopt);
  describe_fields(record);
  return shape;
}

void refuse_to_replace(const CommonOptions& common, const std::string& path) {
  if (path.empty() || path == "-" || common.force) return;
  const auto status = std::filesystem::status(path);  // devices and pipes are written to, not replaced
  if (!std::filesystem::is_regular_file(status) && !std::filesystem::is_directory(status)) return;
  throw files::InputError({path, "", "", "", "the file exists", "--force replaces it"});
}

void refuse_folder(const CommonOptions& common, const std::string& folder) {
  std::error_code ignored;
  if (folder.empty() || common.force || !std::filesystem::exists(folder, ignored)) return;
  if (std::filesystem::is_directory(folder, ignored) && std::filesystem::is_empty(folder, ignored)) return;
  throw files::InputError(
      {folder, "", "", "", "exists and is not an empty folder", "--force writes into it"});
}

void write_result(const CommonOptions& common, const files::Node& result) {
  if (host() == nullptr && common.json.empty()) return;
  const files::Json json = files::to_json(result);
  if (host() != nullptr) host()->result = json;
  if (!common.json.empty()) files::write_file(common.json, files::to_text(json), common.force);
}

std::vector<std::string> input_files(const files::Network& network) {
  std::vector<std::string> paths;
  if (host() != nullptr && host()->network) return paths;
  if (!network.path.empty()) paths.push_back(network.path);
  for (const auto& [name, weights] : files::parts(network)) paths.push_back(weights->path);
  return paths;
}

}  // namespace swarmcert::analysis
