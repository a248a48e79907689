#include "analysis/firmware/export_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>

#include "analysis/firmware/flight_headers.h"
#include "analysis/firmware/float_blocks.h"
#include "analysis/firmware/golden_vectors.h"
#include "nn/base/input_error.h"
#include "nn/base/json.h"
#include "nn/deep_set.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"
#include "nn/weights/record_samples.h"

namespace swarmcert::firmware {
namespace {

std::string literal(float value) {
  if (value == 0) return std::signbit(value) ? "-0.0f" : "0.0f";
  return files::hex_float(static_cast<double>(value)) + "f";
}

/// Makes `name` safe for a comment: a line break in the name of a kind would end the comment.
std::string comment(std::string name) {
  for (char& c : name) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\\') c = '?';
  }
  return name;
}

/// Converts "phi:small" to "phi_small". Characters that C names cannot contain become '_'; a number makes names unique.
std::map<files::FunctionId, std::string> identifiers(const files::Network& network) {
  std::map<files::FunctionId, std::string> result;
  std::vector<std::string> used;
  for (const auto& [part, weights] : files::parts(network)) {
    std::string name = part.name();
    for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
    std::string unique = name;
    for (int n = 2; std::find(used.begin(), used.end(), unique) != used.end(); ++n)
      unique = fmt::format("{}_{}", name, n);
    used.push_back(unique);
    result[part] = unique;
  }
  return result;
}

/// Formats "{", the numbers in lines of six, "}".
std::string braces(const std::vector<float>& values) {
  std::string text = "{";
  for (std::size_t i = 0; i < values.size(); ++i)
    text += (i % 6 == 0 ? "\n    " : " ") + literal(values[i]) + ",";
  return text + "\n}";
}

std::string array(const std::string& declaration, const std::vector<float>& values) {
  return fmt::format("{}[{}] = {};\n", declaration, values.size(), braces(values));
}

std::vector<float> narrow(const std::vector<double>& values) { return {values.begin(), values.end()}; }

/// The weights in the layout of the flight code.
std::vector<float> in_blocks(const files::Layer& layer) {
  const std::vector<float> rows = narrow(layer.weights);
  std::vector<float> blocks(rows.size());
  nn::to_blocks(rows.data(), layer.outputs, layer.inputs, blocks.data());
  return blocks;
}

std::string object_name(const std::string& id, std::size_t k) {
  return fmt::format("swarmcert_{}_{}", id, k + 1);
}

std::string weights_source(const files::Weights& weights, const std::string& id) {
  std::string text = fmt::format("// sha256 of the weight file: {}\n", weights.sha256);
  std::string layers;
  for (std::size_t k = 0; k < weights.layers.size(); ++k) {
    const files::Layer& layer = weights.layers[k];
    const std::string name = object_name(id, k);
    text += fmt::format(
        "struct {0}_layer {{ float weight[{1}]; float bias[{2}]; }};\n"
        "extern \"C\" alignas(16) const {0}_layer {0} = {{{3}, {4}}};\n",
        name, layer.weights.size(), layer.biases.size(), braces(in_blocks(layer)),
        braces(narrow(layer.biases)));
    layers += fmt::format("    layer_in_blocks<{1}, {2}>({0}.weight, {0}.bias),\n", name, layer.outputs,
                          layer.inputs);
  }
  return text + fmt::format("static constexpr DenseLayer<float> {}_layers[] = {{\n{}}};\n\n", id, layers);
}

std::string mlp(const std::string& id, const files::Weights& weights) {
  return fmt::format("{{{}_layers, {}}}", id, weights.layers.size());
}

std::string list(const std::vector<float>& values) {
  std::string text;
  for (const float value : values) text += (text.empty() ? "" : ", ") + literal(value);
  return "{" + text + "}";
}

std::string golden_source(const std::vector<GoldenVector>& vectors) {
  std::string text = "const Golden golden[] = {\n";
  for (const GoldenVector& vector : vectors) {
    std::string inputs, kinds;
    for (const std::vector<float>& input : vector.inputs) inputs += list(input) + ", ";
    for (const int kind : vector.kinds) kinds += std::to_string(kind) + ", ";
    text += fmt::format("    {{{}, {}, {}, {{{}}}, {{{}}}, DeepSetStatus({}), {:#010x}u}},\n",
                        vector.own_kind, vector.inputs.size(), list(vector.own), inputs, kinds,
                        static_cast<int>(vector.status), float_bits(vector.force_N));
  }
  return text + "};\n";
}

/// Hash as computed by the exported source: FNV-1a over the words of phi by kind, ground, rho by kind, each in its
/// layout.
std::uint32_t weights_hash(const files::Network& network) {
  std::uint32_t hash = 2166136261u;
  const auto add = [&](const files::Weights& weights) {
    for (const files::Layer& layer : weights.layers) {
      for (const float number : in_blocks(layer)) hash = (hash ^ float_bits(number)) * 16777619u;
      for (const float number : narrow(layer.biases)) hash = (hash ^ float_bits(number)) * 16777619u;
    }
  };
  for (const std::string& kind : files::neighbour_kinds(network)) add(network.phi.at(kind));
  const auto ground = network.phi.find(files::kGroundKind);
  if (ground != network.phi.end()) add(ground->second);
  for (const auto& [kind, weights] : network.rho) add(weights);
  return hash;
}

/// True if the inputs are relative position, then relative velocity, as in the flight code.
bool takes_relative_state(const files::Network& network, int inputs) {
  return network.input_order.empty() ? inputs == 6 : network.input_order == files::relative_state();
}

std::string parameter_line(const ExportOptions& options) {
  const std::string& certificate = options.certificate_sha256;
  return fmt::format("{} most_neighbours {}, golden_vectors {}, seed {}, certificate {}", kParameterLine,
                     options.most_neighbours, options.golden_vectors, options.seed,
                     certificate.empty() ? "none" : certificate);
}

constexpr char kHeader[] =
    R"(/// @file {mark} from certified weights. Do not edit: 'swarmcert match NET FOLDER' regenerates the
/// exported files and finds every change to one of them.
{parameters}
#pragma once

#include <nn/deep_set.h>  // found only on the include path, where another copy of these headers may come first

#include <cstdint>

namespace swarmcert_network {{

/// Content hash of the certificate of these weights; empty if none was named at export.
inline constexpr char kCertificate[] = "{certificate}";
inline constexpr int kMostNeighbours = {most};
/// Per neighbour: {input_list}.
inline constexpr int kInputs = {inputs};
/// Whether the inputs are p_j - p_i in m, then v_j - v_i in m/s, in W.
inline constexpr bool kTakesRelativeState = {relative};
inline constexpr bool kHasGround = {ground};
inline constexpr float kNewtonPerUnit = {scale};
inline constexpr int kOwnKinds = {own_kinds}, kNeighbourKinds = {kinds};

/// The certified function: with its clamp, in its own unit. Its weights lie in blocks of eight outputs (dense_layer.h).
/// @param own_kind of the vehicle, less than kOwnKinds:
{own_list}/// Kinds of neighbours:
{neighbour_list}swarmcert::nn::DeepSet<float> deep_set(int own_kind);

/// Workspace for an evaluation with kMostNeighbours. The functions below share it, so call all of them from one task at
/// a time.
const swarmcert::nn::DeepSetWorkspace<float>& workspace();

/// Predicted vertical force f_a_hat on a vehicle, in newton, positive upward. Bit for bit the certified function with
/// its clamp, times the size of its unit; the order of the neighbours does not matter.
/// @param own        [4] -z in m and -v in m/s of the vehicle, in W; read only by networks with a ground term.
/// @param neighbours inputs and kinds.
/// @param force_N    0 unless the status is kOk.
swarmcert::nn::DeepSetStatus predict_force_z(int own_kind, const float* own,
                                             const swarmcert::nn::Neighbour<float>* neighbours, int num_neighbours,
                                             float* force_N);

enum class SelfTest : std::uint8_t {{
  kPassed,
  kFusedArithmetic,  ///< built with contraction: add -ffp-contract=off
  kOtherBits,        ///< a golden vector gives other bits: other weights, other code, or a broken build
  kOtherWeights      ///< the weights in flash differ from the exported ones
}};

/// Run at startup and keep the feedforward off unless it passes. `failed`, if not null, is the failing golden vector.
SelfTest self_test(int* failed);

}}  // namespace swarmcert_network
)";

std::string header_text(const files::Network& network, const ExportOptions& options) {
  const std::vector<std::string> kinds = files::neighbour_kinds(network);
  const int inputs =
      files::inputs(network, files::FunctionId::set(kinds.front(), network.rho.begin()->first));
  std::string neighbour_list, own_list, input_list;
  for (std::size_t i = 0; i < kinds.size(); ++i)
    neighbour_list += fmt::format("///   {}: {}\n", i, comment(kinds[i]));
  int index = 0;
  for (const auto& [kind, weights] : network.rho)
    own_list += fmt::format("///   {}: {}\n", index++, comment(kind));
  for (const std::string& name : network.input_order)
    input_list += (input_list.empty() ? "" : ", ") + comment(name);
  if (input_list.empty())
    input_list = "not named in the network; published ones: p_j - p_i in m, then v_j - v_i in m/s, in W";
  return fmt::format(
      kHeader, fmt::arg("mark", kGeneratedMark), fmt::arg("parameters", parameter_line(options)),
      fmt::arg("certificate", options.certificate_sha256), fmt::arg("most", options.most_neighbours),
      fmt::arg("inputs", inputs), fmt::arg("input_list", input_list),
      fmt::arg("relative", takes_relative_state(network, inputs)),
      fmt::arg("ground", network.phi.count(files::kGroundKind) != 0),
      fmt::arg("scale", literal(newton_per_unit(network))), fmt::arg("own_kinds", network.rho.size()),
      fmt::arg("kinds", kinds.size()), fmt::arg("own_list", own_list),
      fmt::arg("neighbour_list", neighbour_list));
}

constexpr char kEvaluation[] = R"(
}  // namespace

namespace swarmcert_network {

const DeepSetWorkspace<float>& workspace() {
  static float inputs[kMostNeighbours * kInputs], sum[kHidden], scratch[kScratch];
  static int order[kMostNeighbours];
  static const DeepSetWorkspace<float> memory = {inputs, order, kMostNeighbours, sum, scratch};
  return memory;
}

// Must be neither inlined nor cloned: match runs this function by its name in the linked program.
#if defined(__GNUC__) && !defined(__clang__)
[[gnu::noipa, gnu::used]]
#elif defined(__clang__)
[[gnu::noinline, gnu::used]]
#endif
DeepSetStatus predict_force_z(int own_kind, const float* own, const Neighbour<float>* neighbours, int num_neighbours,
                              float* force_N) {
  *force_N = 0.0f;
  if (own_kind < 0 || own_kind >= kOwnKinds) return DeepSetStatus::kUnknownKind;
  float output[8] = {};  // one is used; with fewer, GCC warns about the evaluator's groups of eight
  const DeepSetStatus status = evaluate(deep_set(own_kind), own, neighbours, num_neighbours, output, workspace());
  if (status == DeepSetStatus::kOk) *force_N = rounded(output[0] * kNewtonPerUnit);
  return status;
}

/// FNV-1a over words: a change of any one weight or bias changes it.
static std::uint32_t hash_of(const Mlp<float>& network, std::uint32_t hash) {
  const auto add = [&hash](const float* numbers, int count) {
    for (int i = 0; i < count; ++i) hash = (hash ^ bits(numbers[i])) * 16777619u;
  };
  for (int k = 0; k < network.num_layers; ++k) {
    const DenseLayer<float>& layer = network.layers[k];
    add(layer.weights, layer.outputs * layer.inputs);
    add(layer.biases, layer.outputs);
  }
  return hash;
}

static std::uint32_t weights_hash() {
  std::uint32_t hash = 2166136261u;
  for (int kind = 0; kind < kNeighbourKinds; ++kind) hash = hash_of(deep_set(0).phi[kind], hash);
  if (kHasGround) hash = hash_of(*deep_set(0).ground, hash);
  for (int kind = 0; kind < kOwnKinds; ++kind) hash = hash_of(deep_set(kind).rho, hash);
  return hash;
}

SelfTest self_test(int* failed) {
  if (arithmetic_is_fused()) return SelfTest::kFusedArithmetic;
  int index = 0;
  for (const Golden& vector : golden) {
    Neighbour<float> neighbours[kMostNeighbours];
    for (int j = 0; j < vector.num_neighbours; ++j) neighbours[j] = {vector.inputs[j], vector.kinds[j]};
    float force_N = 0.0f;
    const DeepSetStatus status =
        predict_force_z(vector.own_kind, vector.own, neighbours, vector.num_neighbours, &force_N);
    if (status != vector.status || bits(force_N) != vector.force_bits) {
      if (failed != nullptr) *failed = index;
      return SelfTest::kOtherBits;
    }
    ++index;
  }
  if (weights_hash() != kWeightsHash) return SelfTest::kOtherWeights;
  return SelfTest::kPassed;
}

}  // namespace swarmcert_network
)";

std::string source_text(const files::Network& network, const ExportOptions& options) {
  const std::map<files::FunctionId, std::string> ids = identifiers(network);
  const std::vector<std::string> kinds = files::neighbour_kinds(network);
  std::string text = fmt::format(
      "// {} from certified weights. Do not edit.\n{}\n#include \"{}\"\n\nusing namespace swarmcert::nn;\n\n",
      kGeneratedMark, parameter_line(options), kExportedHeader);
  if (!network.sha256.empty()) text += fmt::format("// sha256 of network.toml: {}\n\n", network.sha256);
  for (const auto& [part, weights] : files::parts(network)) text += weights_source(*weights, ids.at(part));
  std::string phi, sets;
  for (const std::string& kind : kinds)
    phi += mlp(ids.at(files::FunctionId::phi(kind)), network.phi.at(kind)) + ", ";
  text += fmt::format("static constexpr Mlp<float> phi[] = {{{}}};\n", phi);
  const bool has_ground = network.phi.count(files::kGroundKind) != 0;
  if (has_ground) {
    text += fmt::format("static constexpr Mlp<float> ground = {};\n",
                        mlp(ids.at(files::FunctionId::ground_phi()), network.phi.at(files::kGroundKind)));
  }
  if (network.clamp) {
    text += array("static constexpr float lower", narrow(network.clamp->lower)) +
            array("static constexpr float upper", narrow(network.clamp->upper));
  }
  for (const auto& [kind, weights] : network.rho) {
    const std::string rho = ids.at(files::FunctionId::rho(kind));
    const std::vector<int> silent = files::silent_counts(network, kind);
    if (!silent.empty())
      text += fmt::format(
          "// Neighbours of each kind among which {} is silent.\n"
          "static constexpr int silent_{}[] = {{{}}};\n",
          comment(kind), rho, fmt::join(silent, ", "));
    sets +=
        fmt::format("    {{{}, phi, swarmcert_network::kNeighbourKinds, {}, {}{}}},\n",
                    has_ground ? "&ground" : "nullptr", mlp(rho, weights),
                    network.clamp ? "lower, upper" : "nullptr, nullptr",
                    silent.empty() ? "" : fmt::format(", silent_{}, {}", rho, silent.size() / kinds.size()));
  }
  text += fmt::format(
      R"(static constexpr DeepSet<float> sets[swarmcert_network::kOwnKinds] = {{
{sets}}};

// The evaluator trusts these sizes, so sizes that do not fit together must not compile.
static constexpr bool all_fit_together() {{
  for (const DeepSet<float>& set : sets) {{
    if (!fits_together(set) || set.inputs() != swarmcert_network::kInputs || set.outputs() != 1) return false;
  }}
  return true;
}}
static_assert(all_fit_together(), "the layers of the exported networks do not fit together");

static constexpr int largest_scratch() {{
  int largest = 0;
  for (const DeepSet<float>& set : sets) largest = scratch_size(set) > largest ? scratch_size(set) : largest;
  return largest;
}}
static constexpr int kHidden = sets[0].hidden(), kScratch = largest_scratch();
static constexpr std::uint32_t kWeightsHash = {hash:#010x}u;

swarmcert::nn::DeepSet<float> swarmcert_network::deep_set(int own_kind) {{ return sets[own_kind]; }}

namespace {{

struct Golden {{
  int own_kind, num_neighbours;
  float own[4];
  float inputs[swarmcert_network::kMostNeighbours][swarmcert_network::kInputs];
  int kinds[swarmcert_network::kMostNeighbours];
  DeepSetStatus status;
  std::uint32_t force_bits;
}};

)",
      fmt::arg("sets", sets), fmt::arg("hash", weights_hash(network)));
  text +=
      golden_source(golden_vectors(network, options.golden_vectors, options.most_neighbours, options.seed));
  return text + kEvaluation;
}

/// Outputs of the flight code for every part, for `certify --samples`.
std::string samples_text(const files::Network& network, std::uint64_t seed) {
  constexpr int kCount = 64;
  return files::to_text(
      files::samples_json(files::record_samples(network, files::float32_output(network), kCount, seed)));
}

}  // namespace

std::string weights_object(const files::Network& network, const files::FunctionId& part, std::size_t k) {
  return object_name(identifiers(network).at(part), k);
}

long weights_bytes(const files::Network& network) {
  std::size_t numbers = 0;
  for (const auto& [name, weights] : files::parts(network))
    for (const files::Layer& layer : weights->layers) numbers += layer.weights.size() + layer.biases.size();
  return static_cast<long>(numbers * sizeof(float));
}

std::vector<SourceFile> export_source(const files::Network& network, const ExportOptions& options) {
  if (network.plain) {
    throw files::InputError({network.plain->path, "", "", "",
                             "flight code takes a deep set, this is one plain network",
                             "name a network.toml, or --phi and --rho"});
  }
  if (files::neighbour_kinds(network).empty()) {
    throw files::InputError(
        {network.path, "", "phi", "", "has only the ground", "add the phi of a neighbour's kind"});
  }
  const int outputs = network.rho.begin()->second.outputs();
  if (outputs != 1) {
    throw files::InputError({network.path, "", "outputs", std::to_string(outputs),
                             "flight code feeds forward one number, the vertical force",
                             "export a network whose rho has one output"});
  }
  std::vector<SourceFile> files = {{kExportedHeader, header_text(network, options)},
                                   {kExportedSource, source_text(network, options)}};
  for (const FlightHeader& header : kFlightHeaders) files.push_back({header.name, header.text});
  files.push_back({kExportedSamples, samples_text(network, options.seed)});
  return files;
}

}  // namespace swarmcert::firmware
