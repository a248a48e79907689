#include <fmt/core.h>

#include <memory>
#include <optional>
#include <variant>
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

void describe_difference(files::Record& record, const firmware::ArtefactMatch& match) {
  using NumberOrText = std::variant<double, std::string>;
  const auto number = match.number_difference.value_or(firmware::Difference());
  const auto file = match.file_difference.value_or(firmware::FileDifference());
  const bool has_number = match.number_difference.has_value(), has_file = match.file_difference.has_value();
  const std::optional<double> found = number.found;
  record.field("what", match.first_difference.value_or(""), "The difference in words.");
  record.may_fields(has_file && !has_number, [&](files::Record& r) {
    r.field("file", file.file, "Exported file that differs.");
    r.field("line", file.line > 0 ? std::optional(file.line) : std::nullopt, "Null: the whole file.");
  });
  record.may_fields(has_file || has_number, [&](files::Record& r) {
    r.field("expected", has_number ? NumberOrText(double{number.expected}) : NumberOrText(file.expected),
            "The network's number, or the line of the export.");
    r.field("found",
            has_number && !found
                ? std::nullopt
                : std::optional(has_number ? NumberOrText(*found) : NumberOrText(file.found)),
            "Null: no numbers resemble the array.");
  });
  record.may_fields(has_number, [&](files::Record& r) {
    r.field("network", number.part, "As \"phi:small\".");
    r.field("layer", number.layer, "");
    r.field("entry", number.entry, "As \"weight[3][2]\" or \"bias[7]\".");
    r.field("expected_hex", files::hex_float(double{number.expected}), "", "", "exact");
    r.may("found_hex", found ? std::optional(files::hex_float(*found)) : std::nullopt, "", "", "exact");
    r.field("name", number.name, "Variable or symbol.");
    r.field("place", number.place, "Line or address.");
  });
}

struct Result {
  firmware::ArtefactMatch match;
  bool is_rounded = false;
};

void describe(files::Record& record, const Result& result) {
  using firmware::ArtefactVerdict;
  const firmware::ArtefactMatch& match = result.match;
  const bool is_open = match.verdict == ArtefactVerdict::kInconclusive;
  record.field("as", result.is_rounded ? std::optional<std::string>("float32") : std::nullopt,
               "Arithmetic in which the network flies; null: as stored.");
  record.field("verdict", std::string(name(match.verdict)), "equal, different or inconclusive.");
  record.field("equal", is_open ? std::nullopt : std::optional(match.verdict == ArtefactVerdict::kEqual),
               "Null: neither was shown.");
  record.field("arrays", match.arrays, "Arrays of weights that were compared.");
  record.field("numbers", match.numbers, "Weights and biases in them.");
  record.field("files", match.files, "Files that were read.");
  record.field("compared", match.compared, "What was compared, in words.");
  record.field("not_checked", match.not_checked, "What could not be compared, and why.");
  record.field("not_covered", match.not_covered, "What no comparison covers.");
  const auto parameters = match.parameters.value_or(firmware::ExportOptions());
  record.object_or_null(match.parameters.has_value(), "parameters",
                        "Those of the export, as its files state them; null: there is no export.",
                        [&](files::Record& r) {
                          r.field("most_neighbours", parameters.most_neighbours, "");
                          r.field("seed", parameters.seed, "Of the golden vectors.");
                          r.field("certificate", parameters.certificate_sha256, "Its SHA-256; empty: none.");
                        });
  record.object_or_null(match.first_difference.has_value(), "first_difference", "Null: nothing differs.",
                        [&](files::Record& r) { describe_difference(r, match); });
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
    artefact.needs_app = true;
    artefact.app = [&options] { return gate::expected_app(options.gains, options.model); };
  }
  const firmware::ArtefactMatch match = match_artefact(network, options.file, artefact);
  inputs.insert(inputs.end(), match.files.begin(), match.files.end());
  write_result(common, result_of("match", inputs, std::nullopt, Result{match, is_rounded}));
  if (common.prints_text()) print(match, options.file);
  if (match.verdict == firmware::ArtefactVerdict::kEqual) print_next(common, {"gate", "policy.toml"});
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
          },
          fields_of<Result>()};
}

}  // namespace swarmcert::analysis
