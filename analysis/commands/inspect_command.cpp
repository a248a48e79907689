#include <fmt/core.h>

#include <memory>

#include "analysis/commands/command.h"
#include "nn/files/file_io.h"
#include "nn/files/functions.h"

namespace swarmcert::analysis {
namespace {

struct Options {
  std::vector<std::string> files;
  std::string key;
};

files::Json describe(const files::Weights& weights) {
  files::Json layers = files::Json::array();
  for (const files::Layer& layer : weights.layers) {
    layers.push_back({{"name", layer.name}, {"inputs", layer.inputs}, {"outputs", layer.outputs}});
  }
  return {{"file", weights.path},
          {"sha256", weights.sha256},
          {"precision", files::name(weights.precision)},
          {"layers", std::move(layers)}};
}

bool is_json(const std::string& path) {
  const std::string text = files::read_file(path);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string::npos && text[first] == '{';
}

files::Json inspect_certificate(const std::string& path, bool print) {
  const files::Json certificate = files::read_json(path, "swarmcert/certificate/1");
  files::Json bounds = files::Json::array();
  if (print) fmt::print("{}: certificate, not checked here ('swarmcert check' does)\n", path);
  for (const files::Json& bound : certificate.value("bounds", files::Json::array())) {
    files::Json line = files::Json::object();
    for (const char* key :
         {"function", "domain", "block", "law", "norm", "scale", "unit", "upper", "upper_method", "lower"}) {
      if (bound.contains(key)) line[key] = bound[key];
    }
    if (print) fmt::print("  {}\n", line.dump());
    bounds.push_back(std::move(line));
  }
  for (const files::Json& law : certificate.value("laws", files::Json::array())) {
    files::Json line = law;
    if (line.is_object()) line.erase("upper_hex");
    if (print) fmt::print("  {}\n", line.dump());
    bounds.push_back(std::move(line));
  }
  return {{"file", path}, {"kind", "certificate"}, {"bounds", std::move(bounds)}};
}

files::Json inspect_network(const std::string& path, const std::string& key, bool print) {
  files::NetworkArguments arguments;
  arguments.file = path;
  arguments.key = key;
  const files::Network network = files::load_network(arguments);
  files::Json parts = files::Json::object();
  for (const auto& [name, weights] : files::parts(network)) {
    parts[name] = describe(*weights);
    if (!print) continue;
    fmt::print("{}: {} {}, sha256 {}\n", weights->path, name, files::name(weights->precision),
               weights->sha256);
    for (const files::Layer& layer : weights->layers) {
      fmt::print("  {:<10} {} -> {}\n", layer.name, layer.inputs, layer.outputs);
    }
  }
  return {{"file", path}, {"kind", "network"}, {"networks", std::move(parts)}};
}

int run(const Options& options, const CommonOptions& common) {
  files::Json result = result_head("inspect", options.files);
  result["files"] = files::Json::array();
  for (const std::string& path : options.files) {
    result["files"].push_back(is_json(path) ? inspect_certificate(path, common.prints_text())
                                            : inspect_network(path, options.key, common.prints_text()));
  }
  write_result(common, result);
  return kDone;
}

}  // namespace

Command inspect_command() {
  return {
      "inspect", "What is in a weight file, network.toml or certificate, and is it sound",
      "Exit 0 if every file can be read, else 3 with what is wrong and where.\n\n"
      "Example: swarmcert inspect nn/networks/demo/network.toml",
      [](CLI::App& app) {
        const auto options = std::make_shared<Options>();
        app.add_option("FILE", options->files, "Weight files, network.toml files, certificates")->required();
        app.add_option("--key", options->key,
                       "Where the state dict lies inside a nested checkpoint, e.g. model");
        return [options](const CommonOptions& common) { return run(*options, common); };
      }};
}

}  // namespace swarmcert::analysis
