#include "analysis/gate/documents.h"

#include <fmt/core.h>

#include "nn/base/file_io.h"
#include "nn/weights/functions.h"

namespace swarmcert::gate {
namespace {

using files::Json;

Json sha256_digest(const BundledFile& file) {
  return {{"name", file.path}, {"digest", {{"sha256", file.sha256}}}};
}

bool is_configuration(const BundledFile& file) { return file.role == "policy" || file.role == "baseline"; }

/// "phi:small 6-25-40-40-40": the widths of a part's layers.
std::string widths(const files::FunctionId& part, const files::Weights& weights) {
  std::string text = fmt::format("{} {}", part.name(), weights.inputs());
  for (const files::Layer& layer : weights.layers) text += fmt::format("-{}", layer.outputs);
  return text;
}

Json model_card(const files::Network& network, const Json& rows) {
  std::string architecture, inputs;
  for (const auto& [part, weights] : files::parts(network))
    architecture += (architecture.empty() ? "" : ", ") + widths(part, *weights);
  for (const std::string& input : network.input_order) inputs += (inputs.empty() ? "" : ", ") + input;
  const std::string output =
      network.output_quantity + (network.output_unit.empty() ? "" : " in ") + network.output_unit;
  Json metrics = Json::array();
  for (const Json& row : rows) {
    if (!row["value"].is_number()) continue;
    const std::string unit = row["unit"].get<std::string>();
    metrics.push_back({{"type", row["name"].get<std::string>() + (unit.empty() ? "" : " [" + unit + "]")},
                       {"value", fmt::format("{:.6g}", row["value"].get<double>())}});
  }
  return {{"modelParameters",
           {{"task", "regression"},
            {"architectureFamily", network.plain ? "multilayer perceptron" : "deep set"},
            {"modelArchitecture", architecture},
            {"inputs", Json::array({Json{{"format", inputs.empty() ? "not stated" : inputs}}})},
            {"outputs", Json::array({Json{{"format", output.empty() ? "not stated" : output}}})}}},
          {"quantitativeAnalysis", {{"performanceMetrics", std::move(metrics)}}}};
}

/// A UUID (RFC 9562, version 8) made of a SHA-256.
std::string uuid_of(std::string sha256) {
  sha256[12] = '8';
  sha256[16] = '8';
  return fmt::format("{}-{}-{}-{}-{}", sha256.substr(0, 8), sha256.substr(8, 4), sha256.substr(12, 4),
                     sha256.substr(16, 4), sha256.substr(20, 12));
}

}  // namespace

Json statement_of(const std::vector<BundledFile>& files, const Json& rows) {
  Json subjects = Json::array(), configuration = Json::array(), passed = Json::array();
  for (const BundledFile& file : files) {
    Json described = sha256_digest(file);
    if (is_configuration(file)) described["annotations"] = {{"role", file.role}};
    (is_configuration(file) ? configuration : subjects).push_back(std::move(described));
  }
  for (const Json& row : rows) passed.push_back(row["name"]);
  return {{"_type", "https://in-toto.io/Statement/v1"},
          {"subject", std::move(subjects)},
          {"predicateType", "https://in-toto.io/attestation/test-result/v0.1"},
          {"predicate",
           {{"result", "PASSED"},
            {"configuration", std::move(configuration)},
            {"passedTests", std::move(passed)},
            {"warnedTests", Json::array()},
            {"failedTests", Json::array()}}}};
}

Json bill_of_materials(const files::Network* network, const std::vector<BundledFile>& files,
                       const Json& rows) {
  Json components = Json::array(), references = Json::array();
  std::string hashes;
  const auto add = [&](Json component) {
    references.push_back(component["bom-ref"]);
    components.push_back(std::move(component));
  };
  if (network != nullptr)
    add({{"type", "machine-learning-model"},
         {"bom-ref", "network"},
         {"name", "network"},
         {"modelCard", model_card(*network, rows)}});
  for (const BundledFile& file : files) {
    hashes += file.sha256;
    const char* const type = file.role == "elf" ? "firmware" : file.role == "log" ? "data" : "file";
    add({{"type", type},
         {"bom-ref", file.path},
         {"name", file.path},
         {"hashes", Json::array({Json{{"alg", "SHA-256"}, {"content", file.sha256}}})},
         {"properties", Json::array({Json{{"name", "swarmcert:role"}, {"value", file.role}}})}});
  }
  const Json tool = {{"type", "application"}, {"name", "swarmcert"}, {"version", SWARMCERT_VERSION}};
  return {{"$schema", "http://cyclonedx.org/schema/bom-1.6.schema.json"},
          {"bomFormat", "CycloneDX"},
          {"specVersion", "1.6"},
          {"serialNumber", "urn:uuid:" + uuid_of(files::sha256(hashes))},
          {"version", 1},
          {"metadata",
           {{"tools", {{"components", Json::array({tool})}}},
            {"component", {{"type", "firmware"}, {"bom-ref", "release"}, {"name", "release"}}}}},
          {"components", std::move(components)},
          {"dependencies", Json::array({Json{{"ref", "release"}, {"dependsOn", std::move(references)}}})}};
}

}  // namespace swarmcert::gate
