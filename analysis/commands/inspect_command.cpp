#include <fmt/core.h>

#include <limits>
#include <memory>
#include <sstream>

#include "analysis/commands/command.h"
#include "analysis/logs/read_log.h"
#include "nn/files/file_io.h"
#include "nn/files/functions.h"
#include "nn/files/toml.h"
#include "stability/model.h"

namespace swarmcert::analysis {
namespace {

struct Options {
  std::vector<std::string> files;
  std::string key;
  std::string csv;
  std::string columns;
  double t0_s = -std::numeric_limits<double>::infinity();
  double t1_s = std::numeric_limits<double>::infinity();
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

bool is_model(const std::string& path) {
  if (path.size() < 5 || path.compare(path.size() - 5, 5, ".toml") != 0) return false;
  const toml::table document = files::parse_toml(files::read_file(path), path);
  return document["schema"].value_or(std::string()).rfind("swarmcert/model/", 0) == 0;
}

files::Json inspect_model(const std::string& path, bool print) {
  const stability::Model model = stability::read_model(path);
  files::Json effects = files::Json::array();
  for (const stability::EffectSpec& effect : model.effects) {
    effects.push_back({{"effect", effect.name}, {"parameters", effect.parameters}});
    if (!effect.vehicle.empty()) effects.back()["vehicle"] = effect.vehicle;
  }
  const stability::ThrustMap& map = model.thrust;
  if (print) {
    fmt::print("{}: model of kind {}: {} kg, arm {} m, at most {:.3f} N per rotor\n", path, model.kind,
               model.mass_kg, model.arm_m, map.largest_N(stability::kFullBattery_V));
    for (const files::Json& effect : effects) fmt::print("  {}\n", effect.dump());
    if (effects.empty()) fmt::print("  no effects\n");
  }
  return {{"file", path},
          {"kind", "model"},
          {"vehicle",
           {{"kind", model.kind},
            {"mass_kg", model.mass_kg},
            {"inertia_kg_m2", model.inertia_kg_m2},
            {"arm_m", model.arm_m},
            {"torque_per_thrust_m", model.torque_per_thrust_m},
            {"thrust",
             {{"c00", map.c00}, {"c10", map.c10}, {"c01", map.c01}, {"c20", map.c20}, {"c11", map.c11}}}}},
          {"effects", std::move(effects)}};
}

files::Json inspect_log(const std::string& path, const Options& options, const CommonOptions& common) {
  const logs::Log log = options.columns.empty() ? logs::read_log(path)
                                                : logs::read_log(path, logs::read_columns(options.columns));
  const logs::LogHealth& health = log.health;
  const std::vector<logs::Sample>& samples = log.samples;
  const double t0_s = samples.empty() ? 0 : samples.front().time_us * 1e-6;
  const double t1_s = samples.empty() ? 0 : samples.back().time_us * 1e-6;
  if (!options.csv.empty()) {
    std::ostringstream text;
    logs::write_csv(log, options.t0_s, options.t1_s, text);
    files::write_file(options.csv, text.str(), common.force);
  }
  if (common.prints_text()) {
    fmt::print("{}: flight log ({}), {} records from {:.3f} to {:.3f} s, {} columns\n", path, log.format,
               health.records, t0_s, t1_s, log.channels.size());
    for (const std::string& finding : logs::findings(health)) fmt::print("  {}\n", finding);
    if (!log.signals.force) fmt::print("  no force can be computed: position only\n");
  }
  return {{"file", path},
          {"kind", "log"},
          {"format", log.format},
          {"channels", log.channels},
          {"records", health.records},
          {"t0_s", t0_s},
          {"t1_s", t1_s},
          {"signals",
           {{"force", log.signals.force},
            {"rates", log.signals.rates},
            {"targets", log.signals.targets},
            {"commands", log.signals.commands}}},
          {"health",
           {{"sound", logs::is_sound(health)},
            {"blocks", health.blocks},
            {"damaged_blocks", health.damaged_blocks},
            {"skipped_bytes", health.skipped_bytes},
            {"damaged_lines", health.damaged_lines},
            {"not_finite", health.not_finite},
            {"clock_jumps", health.clock_jumps},
            {"gaps", health.gaps},
            {"longest_gap_s", health.longest_gap_s},
            {"truncated", health.truncated},
            {"checksum_failed", health.checksum_failed}}}};
}

int run(const Options& options, const CommonOptions& common) {
  if (!options.csv.empty()) {
    if (options.files.size() != 1 || !logs::looks_like_log(options.files[0]))
      throw UsageError("--csv takes one flight log");
    if (!(options.t0_s < options.t1_s)) throw UsageError("--t0 must be before --t1");
    refuse_to_replace(common, options.csv);
  }
  files::Json result = result_head("inspect", options.files);
  result["files"] = files::Json::array();
  for (const std::string& path : options.files) {
    if (logs::looks_like_log(path)) {
      result["files"].push_back(inspect_log(path, options, common));
      continue;
    }
    if (is_model(path)) {
      result["files"].push_back(inspect_model(path, common.prints_text()));
      continue;
    }
    result["files"].push_back(is_json(path) ? inspect_certificate(path, common.prints_text())
                                            : inspect_network(path, options.key, common.prints_text()));
  }
  write_result(common, result);
  return kDone;
}

}  // namespace

Command inspect_command() {
  return {"inspect",
          "What is in a weight file, network.toml, model, certificate or flight log, and is it sound",
          "Exit 0 if every file can be read, else 3 with what is wrong and where. Damage inside a flight log "
          "is skipped,\n"
          "counted and shown.\n\n"
          "Example: swarmcert inspect nn/networks/demo/network.toml\n"
          "         swarmcert inspect cf50_00 --csv cf50_00.csv --t0 2 --t1 12",
          [](CLI::App& app) {
            const auto options = std::make_shared<Options>();
            app.add_option("FILE", options->files,
                           "Weight files, network.toml and model.toml files, certificates, flight logs")
                ->required();
            app.add_option("--csv", options->csv, "Write the one flight log as CSV in the authors' layout");
            app.add_option("--t0", options->t0_s, "CSV from this time of the log's clock, in seconds");
            app.add_option("--t1", options->t1_s, "CSV to before this time, in seconds");
            app.add_option("--columns", options->columns, "columns.toml: what the columns of CSV logs mean");
            app.add_option("--key", options->key,
                           "Where the state dict lies inside a nested checkpoint, e.g. model");
            return [options](const CommonOptions& common) { return run(*options, common); };
          }};
}

}  // namespace swarmcert::analysis
