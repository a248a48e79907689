#include "analysis/firmware/export_source.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <map>

#include "analysis/firmware/flight_headers.h"
#include "nn/deep_set.h"
#include "nn/files/functions.h"
#include "nn/files/input_error.h"
#include "nn/files/json.h"
#include "nn/files/random.h"

namespace swarmcert::firmware {
namespace {

/// Own state of the ground's phi; neighbours' states lie in the clamp, or in +-1 m and +-2 m/s where there is none.
constexpr float kMostPosition_m = 1, kMostVelocity_m_s = 2;

std::string literal(float value) {
  if (value == 0) return std::signbit(value) ? "-0.0f" : "0.0f";
  return files::hex_float(static_cast<double>(value)) + "f";
}

/// "phi:small" -> "phi_small"; anything a C name cannot hold becomes '_', made unique by a number.
std::map<std::string, std::string> identifiers(const files::Network& network) {
  std::map<std::string, std::string> result;
  std::vector<std::string> used;
  for (const auto& [part, weights] : files::parts(network)) {
    std::string name = part;
    for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
    std::string unique = name;
    for (int n = 2; std::find(used.begin(), used.end(), unique) != used.end(); ++n)
      unique = fmt::format("{}_{}", name, n);
    used.push_back(unique);
    result[part] = unique;
  }
  return result;
}

std::string array(const std::string& declaration, const std::vector<float>& values) {
  std::string text = fmt::format("{}[{}] = {{", declaration, values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    text += (i % 6 == 0 ? "\n    " : " ") + literal(values[i]) + ",";
  return text + "\n};\n";
}

std::vector<float> narrow(const std::vector<double>& values) { return {values.begin(), values.end()}; }

std::string weights_source(const files::Weights& weights, const std::string& id) {
  std::string text = fmt::format("// sha256 of the weight file: {}\n", weights.sha256);
  std::string layers;
  for (std::size_t k = 0; k < weights.layers.size(); ++k) {
    const files::Layer& layer = weights.layers[k];
    const std::string name = fmt::format("swarmcert_{}_{}", id, k + 1);
    text += array(fmt::format("extern \"C\" const float {}_weight", name), narrow(layer.weights));
    text += array(fmt::format("extern \"C\" const float {}_bias", name), narrow(layer.biases));
    layers += fmt::format("    {{{0}_weight, {0}_bias, {1}, {2}}},\n", name, layer.outputs, layer.inputs);
  }
  return text + fmt::format("static const DenseLayer<float> {}_layers[] = {{\n{}}};\n\n", id, layers);
}

std::string mlp(const std::string& id, const files::Weights& weights) {
  return fmt::format("{{{}_layers, {}}}", id, weights.layers.size());
}

/// The kinds of neighbours, in the order of their indices: without the ground.
std::vector<std::string> neighbour_kinds(const files::Network& network) {
  std::vector<std::string> kinds;
  for (const auto& [kind, weights] : network.phi) {
    if (kind != files::kGroundKind) kinds.push_back(kind);
  }
  return kinds;
}

/// The network as the exported source evaluates it, for golden vectors.
class FlightEvaluator {
 public:
  FlightEvaluator(const files::Network& network, int most_neighbours)
      : kinds_(neighbour_kinds(network)), most_(most_neighbours) {
    for (const auto& [part, weights] : files::parts(network)) evaluators_.emplace(part, *weights);
    for (const std::string& kind : kinds_) phi_.push_back(evaluators_.at("phi:" + kind).mlp());
    if (network.phi.count(files::kGroundKind) != 0) {
      ground_ = evaluators_.at(std::string("phi:") + files::kGroundKind).mlp();
      has_ground_ = true;
    }
    if (network.clamp) {
      lower_ = narrow(network.clamp->lower);
      upper_ = narrow(network.clamp->upper);
    }
  }

  std::vector<float> operator()(const std::string& rho_kind, const std::vector<float>& own,
                                const std::vector<std::vector<float>>& inputs,
                                const std::vector<int>& kinds) const {
    nn::DeepSet<float> set{has_ground_ ? &ground_ : nullptr,
                           phi_.data(),
                           static_cast<int>(phi_.size()),
                           evaluators_.at("rho:" + rho_kind).mlp(),
                           lower_.empty() ? nullptr : lower_.data(),
                           upper_.empty() ? nullptr : upper_.data()};
    std::vector<nn::Neighbour<float>> neighbours;
    for (std::size_t j = 0; j < inputs.size(); ++j) neighbours.push_back({inputs[j].data(), kinds[j]});
    std::vector<float> copies(static_cast<std::size_t>(most_ * set.inputs()));
    std::vector<int> order(static_cast<std::size_t>(most_));
    std::vector<float> sum(static_cast<std::size_t>(set.hidden())), hidden(sum.size());
    std::vector<float> scratch(static_cast<std::size_t>(scratch_size(set)));
    std::vector<float> output(static_cast<std::size_t>(set.outputs()));
    nn::evaluate(set, own.data(), neighbours.data(), static_cast<int>(neighbours.size()), output.data(),
                 nn::DeepSetWorkspace<float>{copies.data(), order.data(), most_, sum.data(), hidden.data(),
                                             scratch.data()});
    return output;
  }

 private:
  std::vector<std::string> kinds_;
  int most_;
  std::map<std::string, files::Evaluator<float>> evaluators_;
  std::vector<nn::Mlp<float>> phi_;
  nn::Mlp<float> ground_{};
  bool has_ground_ = false;
  std::vector<float> lower_, upper_;
};

float newton_per_unit(const files::Network& network) {
  if (!network.output_quantity.empty() && network.output_quantity != "force_z")
    throw files::InputError({network.path, "", "output.quantity", network.output_quantity,
                             "flight code takes a vertical force", "export a network of force_z"});
  return network.output_unit == "N" ? 1.0f : 9.81e-3f;  // gram-force unless stated otherwise, as published
}

std::uint32_t bits_of(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

/// Golden vectors of the deep sets: neighbours from none to the most, kinds at random.
std::string golden_source(const files::Network& network, const ExportOptions& options) {
  const std::vector<std::string> kinds = neighbour_kinds(network);
  const int inputs = network.phi.at(kinds.front()).inputs();
  const FlightEvaluator evaluate(network, options.most_neighbours);
  const float scale = newton_per_unit(network);
  files::Random random(options.seed);
  std::string text = "static const Golden golden[] = {\n";
  int own_kind = 0;
  for (const auto& [rho_kind, weights] : network.rho) {
    for (int g = 0; g < options.golden_vectors; ++g) {
      const int count = g % (options.most_neighbours + 1);
      std::vector<float> own;
      for (int i = 0; i < files::kGroundInputs; ++i)
        own.push_back((i == 0 ? kMostPosition_m : kMostVelocity_m_s) *
                      static_cast<float>(random.symmetric()));
      std::vector<std::vector<float>> states(static_cast<std::size_t>(count));
      std::vector<int> state_kinds;
      std::string states_text, kinds_text;
      for (std::vector<float>& state : states) {
        for (int i = 0; i < inputs; ++i) {
          const float range = network.clamp ? 1.5f * static_cast<float>(network.clamp->upper[i])
                                            : (i < 3 ? kMostPosition_m : kMostVelocity_m_s);
          state.push_back(range * static_cast<float>(random.symmetric()));
          states_text += (i == 0 ? "{" : ", ") + literal(state.back());
        }
        states_text += "}, ";
        state_kinds.push_back(static_cast<int>(random.below(kinds.size())));
        kinds_text += std::to_string(state_kinds.back()) + ", ";
      }
      const float force = nn::rounded(evaluate(rho_kind, own, states, state_kinds).front() * scale);
      std::string own_text;
      for (const float x : own) own_text += (own_text.empty() ? "" : ", ") + literal(x);
      text += fmt::format("    {{{}, {}, {{{}}}, {{{}}}, {{{}}}, {:#010x}u}},\n", own_kind, count, own_text,
                          states_text.empty() ? "{}" : states_text, kinds_text.empty() ? "0" : kinds_text,
                          bits_of(force));
    }
    ++own_kind;
  }
  return text + "};\n";
}

std::string header_text(const files::Network& network, const ExportOptions& options) {
  const std::vector<std::string> kinds = neighbour_kinds(network);
  std::string neighbour_list, own_list;
  for (std::size_t i = 0; i < kinds.size(); ++i) neighbour_list += fmt::format("///   {}: {}\n", i, kinds[i]);
  int index = 0;
  for (const auto& [kind, weights] : network.rho) own_list += fmt::format("///   {}: {}\n", index++, kind);
  return fmt::format(
      R"(/// @file Generated by swarmcert export from certified weights. Do not edit: 'swarmcert match' finds every change.
#pragma once

#include <cstdint>

#include "nn/deep_set.h"

namespace swarmcert_network {{

/// Content hash of the certificate of these weights; empty if none was named at export.
inline constexpr char kCertificate[] = "{certificate}";
inline constexpr int kMostNeighbours = {most};
inline constexpr int kInputs = {inputs};  ///< per neighbour: relative position in m, then relative velocity in m/s, in W

/// Predicted vertical force f_a_hat on a vehicle, in newton, upwards. Bit for bit the function that was certified,
/// with its clamp, times the unit's size; the order of the neighbours does not matter.
/// @param own_kind   of the vehicle:
{own_list}/// @param own        [4] -z in m and -v in m/s of the vehicle, in W; read only by networks with a ground term.
/// @param neighbours inputs and kinds:
{neighbour_list}/// @param force_N    0 unless the status is kOk.
swarmcert::nn::DeepSetStatus predict_force_z(int own_kind, const float* own,
                                             const swarmcert::nn::Neighbour<float>* neighbours, int num_neighbours,
                                             float* force_N);

enum class SelfTest : std::uint8_t {{
  kPassed,
  kFusedArithmetic,  ///< built with contraction: add -ffp-contract=off
  kOtherBits         ///< a golden vector gives other bits: other weights, other code, or a broken build
}};

/// Run it at start; keep the feed-forward off unless it passes. `failed`, if not null, is the golden vector at fault.
SelfTest self_test(int* failed);

}}  // namespace swarmcert_network
)",
      fmt::arg("certificate", options.certificate_sha256), fmt::arg("most", options.most_neighbours),
      fmt::arg("inputs", network.phi.at(kinds.front()).inputs()), fmt::arg("own_list", own_list),
      fmt::arg("neighbour_list", neighbour_list));
}

std::string source_text(const files::Network& network, const ExportOptions& options) {
  const std::map<std::string, std::string> ids = identifiers(network);
  const std::vector<std::string> kinds = neighbour_kinds(network);
  std::string text =
      "// Generated by swarmcert export from certified weights. Do not edit.\n#include "
      "\"swarmcert_network.h\"\n\n"
      "#include <cstring>\n\nusing namespace swarmcert::nn;\n\n";
  if (!network.sha256.empty()) text += fmt::format("// sha256 of network.toml: {}\n\n", network.sha256);
  for (const auto& [part, weights] : files::parts(network)) text += weights_source(*weights, ids.at(part));
  std::string phi, rho;
  for (const std::string& kind : kinds) phi += mlp(ids.at("phi:" + kind), network.phi.at(kind)) + ", ";
  for (const auto& [kind, weights] : network.rho) rho += mlp(ids.at("rho:" + kind), weights) + ", ";
  text += fmt::format("static const Mlp<float> phi[] = {{{}}};\nstatic const Mlp<float> rho[] = {{{}}};\n",
                      phi, rho);
  const bool has_ground = network.phi.count(files::kGroundKind) != 0;
  if (has_ground) {
    const std::string part = std::string("phi:") + files::kGroundKind;
    text += fmt::format("static const Mlp<float> ground = {};\n",
                        mlp(ids.at(part), network.phi.at(files::kGroundKind)));
  }
  if (network.clamp) {
    text += array("static const float lower", narrow(network.clamp->lower)) +
            array("static const float upper", narrow(network.clamp->upper));
  }
  text += fmt::format(
      R"(static constexpr float kNewtonPerUnit = {scale};
static constexpr int kHidden = {hidden}, kScratch = {scratch}, kNumOwnKinds = {own_kinds}, kNumKinds = {kinds};

namespace {{

struct Golden {{
  int own_kind, num_neighbours;
  float own[4];
  float inputs[swarmcert_network::kMostNeighbours][swarmcert_network::kInputs];
  int kinds[swarmcert_network::kMostNeighbours];
  std::uint32_t force_bits;
}};

)",
      fmt::arg("scale", literal(newton_per_unit(network))),
      fmt::arg("hidden", network.rho.begin()->second.inputs()),
      fmt::arg("scratch",
               [&] {
                 int widest = 1;
                 for (const auto& [part, weights] : files::parts(network)) {
                   for (const files::Layer& layer : weights->layers) widest = std::max(widest, layer.outputs);
                 }
                 return 2 * widest;
               }()),
      fmt::arg("own_kinds", network.rho.size()), fmt::arg("kinds", kinds.size()));
  text += golden_source(network, options);
  text += fmt::format(
      R"(
}}  // namespace

namespace swarmcert_network {{

DeepSetStatus predict_force_z(int own_kind, const float* own, const Neighbour<float>* neighbours, int num_neighbours,
                              float* force_N) {{
  *force_N = 0.0f;
  if (own_kind < 0 || own_kind >= kNumOwnKinds) return DeepSetStatus::kUnknownKind;
  float copies[kMostNeighbours * kInputs], sum[kHidden], hidden[kHidden], scratch[kScratch];
  int order[kMostNeighbours];
  const DeepSet<float> set = {{{ground}, phi, kNumKinds, rho[own_kind], {clamp}}};
  float output[4] = {{}};  // one is used; GCC warns of the evaluator's groups of four where it sees no more
  const DeepSetStatus status =
      evaluate(set, own, neighbours, num_neighbours, output, DeepSetWorkspace<float>{{copies, order, kMostNeighbours, sum, hidden, scratch}});
  if (status == DeepSetStatus::kOk) *force_N = rounded(output[0] * kNewtonPerUnit);
  return status;
}}

SelfTest self_test(int* failed) {{
  if (arithmetic_is_fused()) return SelfTest::kFusedArithmetic;
  int index = 0;
  for (const Golden& vector : golden) {{
    Neighbour<float> neighbours[kMostNeighbours];
    for (int j = 0; j < vector.num_neighbours; ++j) neighbours[j] = {{vector.inputs[j], vector.kinds[j]}};
    float force_N = 0.0f;
    const DeepSetStatus status =
        predict_force_z(vector.own_kind, vector.own, neighbours, vector.num_neighbours, &force_N);
    std::uint32_t bits = 0;
    std::memcpy(&bits, &force_N, sizeof bits);
    if (status != DeepSetStatus::kOk || bits != vector.force_bits) {{
      if (failed != nullptr) *failed = index;
      return SelfTest::kOtherBits;
    }}
    ++index;
  }}
  return SelfTest::kPassed;
}}

}}  // namespace swarmcert_network
)",
      fmt::arg("ground", has_ground ? "&ground" : "nullptr"),
      fmt::arg("clamp", network.clamp ? "lower, upper" : "nullptr, nullptr"));
  return text;
}

}  // namespace

std::vector<SourceFile> export_source(const files::Network& network, const ExportOptions& options) {
  if (network.plain) {
    throw files::InputError({network.plain->path, "", "", "",
                             "flight code takes a deep set, this is one plain network",
                             "name a network.toml, or --phi and --rho"});
  }
  std::vector<SourceFile> files = {{"swarmcert_network.h", header_text(network, options)},
                                   {"swarmcert_network.cpp", source_text(network, options)}};
  for (const FlightHeader& header : kFlightHeaders) files.push_back({header.name, header.text});
  return files;
}

}  // namespace swarmcert::firmware
