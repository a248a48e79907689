#include <fmt/core.h>

#include <memory>
#include <vector>

#include "analysis/commands/commands.h"
#include "analysis/commands/shared/flown_network.h"
#include "analysis/firmware/match_artefact.h"
#include "analysis/gate/expected_app.h"
#include "nn/base/content_hash.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::analysis {
namespace {

struct MatchOptions {
  files::NetworkArguments network;
  std::vector<std::string> words;  ///< NET FILE, or FILE with --phi and --rho
  std::string file, as, certificate, gains, model;
  int most_neighbours = firmware::ExportOptions().most_neighbours;
};

/// Members for a changed number and a changed file; null if the difference is neither.
files::Json first_difference_of(const firmware::ArtefactMatch& match) {
  if (!match.first_difference) return {};
  files::Json json = {{"what", *match.first_difference}};
  if (const auto& file = match.file_difference) {
    json["file"] = file->file;
    json["line"] = file->line > 0 ? files::Json(file->line) : files::Json();
    json["expected"] = file->expected;
    json["found"] = file->found;
  }
  if (const auto& number = match.number_difference) {
    json["network"] = number->part;
    json["layer"] = number->layer;
    json["entry"] = number->entry;
    json["expected"] = number->expected;
    json["expected_hex"] = files::hex_float(static_cast<double>(number->expected));
    json["found"] = number->found ? files::Json(*number->found) : files::Json();
    if (number->found) json["found_hex"] = files::hex_float(static_cast<double>(*number->found));
    json["name"] = number->name;
    json["place"] = number->place;
  }
  return json;
}

void add_json(const firmware::ArtefactMatch& match, files::Json& json) {
  const bool is_open = match.verdict == firmware::ArtefactVerdict::kInconclusive;
  json["verdict"] = firmware::name(match.verdict);
  json["equal"] = is_open ? files::Json() : files::Json(match.verdict == firmware::ArtefactVerdict::kEqual);
  json["arrays"] = match.arrays;
  json["numbers"] = match.numbers;
  json["files"] = match.files;
  json["compared"] = match.compared;
  json["not_checked"] = match.not_checked;
  json["not_covered"] = match.not_covered;
  json["parameters"] = nullptr;
  if (match.parameters)
    json["parameters"] = {{"most_neighbours", match.parameters->most_neighbours},
                          {"seed", match.parameters->seed},
                          {"certificate", match.parameters->certificate_sha256}};
  json["first_difference"] = first_difference_of(match);
}

void print(const firmware::ArtefactMatch& match, const std::string& file) {
  if (match.first_difference) {
    fmt::print("different: {}\n", *match.first_difference);
  } else if (match.arrays == 0) {
    fmt::print("equal: {} is byte for byte as exported\n", file);
  } else if (match.not_checked.empty()) {
    fmt::print("equal: {} holds all {} weights and biases, in {} arrays, bit for bit\n", file, match.numbers,
               match.arrays);
  } else {
    fmt::print(
        "inconclusive: {} holds all {} weights and biases, bit for bit, but not everything was checked\n",
        file, match.numbers);
  }
  for (const std::string& what : match.compared) fmt::print("  compared: {}\n", what);
  for (const std::string& what : match.not_checked) fmt::print("  not checked: {}\n", what);
  for (const std::string& what : match.not_covered) fmt::print("  not covered: {}\n", what);
}

int exit_code(firmware::ArtefactVerdict verdict) {
  switch (verdict) {
    case firmware::ArtefactVerdict::kEqual:
      return kDone;
    case firmware::ArtefactVerdict::kDifferent:
      return kViolated;
    case firmware::ArtefactVerdict::kInconclusive:
      break;
  }
  return kInconclusive;
}

int run_match(MatchOptions options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  if (options.words.size() != (options.network.phi.empty() ? 2u : 1u))
    throw UsageError("match takes NET FILE, or --phi F --rho F FILE");
  options.file = options.words.back();
  if (options.words.size() == 2) options.network.file = options.words.front();
  bool is_rounded = false;
  const files::Network network = load_flown_net(options.network, options.as, is_rounded);
  std::vector<std::string> inputs = input_files(network);
  firmware::ArtefactOptions artefact;
  artefact.most_neighbours = options.most_neighbours;
  if (!options.certificate.empty()) {
    inputs.push_back(options.certificate);
    artefact.source.certificate_sha256 =
        files::content_sha256(files::parse_json(files::read_file(options.certificate), options.certificate));
  }
  if (options.gains.empty() != options.model.empty())
    throw UsageError("--gains and --model belong together: gains are converted with the vehicle's mass");
  if (!options.gains.empty()) {
    inputs.insert(inputs.end(), {options.gains, options.model});
    artefact.app = [&options] { return gate::expected_app(options.gains, options.model); };
  }
  const firmware::ArtefactMatch match = match_artefact(network, options.file, artefact);
  inputs.insert(inputs.end(), match.files.begin(), match.files.end());
  files::Json json = result_head("match", inputs);
  json["as"] = is_rounded ? files::Json("float32") : files::Json();
  add_json(match, json);
  write_result(common, json);
  if (common.prints_text()) print(match, options.file);
  return exit_code(match.verdict);
}

}  // namespace

Command match_command() {
  return {"match", "Check that firmware source or an ELF is exactly this network",
          "FILE is the folder of an export, or one of its files: the export is regenerated and every file "
          "compared byte for byte,\n"
          "with CR LF at line ends read as LF. In other C or C++ source and in a little-endian ELF, with or "
          "without symbols,\n"
          "every weight and bias must match bit for bit; a linked ELF for Cortex-M must hold them once, and "
          "what it computes is run\n"
          "and compared where qemu-system-arm is installed: the exported function, and the Crazyflie app "
          "if the image holds it. Exit code 0 if all is equal; 1 and the first difference; 4 if "
          "something\n"
          "could not be checked. With --phi and --rho, NET is those two files.\n\n"
          "Example: swarmcert match nn/networks/demo/network.toml firmware",
          [](CLI::App& app) {
            const auto options = std::make_shared<MatchOptions>();
            app.add_option("NET FILE", options->words, "The network, then a folder, source file or ELF")
                ->required()
                ->expected(1, 2);
            auto* phi = app.add_option("--phi", options->network.phi, "Weight file of phi, instead of NET");
            auto* rho = app.add_option("--rho", options->network.rho, "Weight file of rho, instead of NET");
            phi->needs(rho);
            rho->needs(phi);
            app.add_option("--key", options->network.key, "Key of the state dict inside a nested checkpoint");
            declare_order(app, options->network);
            declare_as(app, options->as);
            app.add_option("--certificate", options->certificate,
                           "Certificate that an export was made with, if it names one");
            app.add_option(
                "--gains", options->gains,
                "gains.toml with which the app in an ELF must start; otherwise those of its source");
            app.add_option("--model", options->model,
                           "model.toml: mass, thrust map and inertia of the app in an ELF");
            app.add_option("--most-neighbours", options->most_neighbours,
                           "Largest number of neighbours in an evaluation of an ELF")
                ->check(CLI::Range(1, 64))
                ->capture_default_str();
            return [options](const CommonOptions& common) { return run_match(*options, common); };
          }};
}

}  // namespace swarmcert::analysis
