#include <fmt/core.h>

#include <memory>
#include <vector>

#include "analysis/commands/commands.h"
#include "analysis/commands/shared/flown_network.h"
#include "analysis/firmware/match.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {
namespace {

struct MatchOptions {
  files::NetworkArguments network;
  std::vector<std::string> words;  ///< NET FILE, or FILE with --phi and --rho
  std::string file, as;
};

files::Json json_of(const firmware::Difference& difference) {
  files::Json json = {{"network", difference.part},
                      {"layer", difference.layer},
                      {"entry", difference.entry},
                      {"expected", difference.expected},
                      {"expected_hex", files::hex_float(static_cast<double>(difference.expected))},
                      {"found", nullptr},
                      {"name", difference.name},
                      {"place", difference.place}};
  if (difference.found) {
    json["found"] = *difference.found;
    json["found_hex"] = files::hex_float(static_cast<double>(*difference.found));
  }
  return json;
}

void print(const firmware::MatchResult& result, const std::string& file) {
  if (result.equal) {
    fmt::print("equal: {} holds all {} weights and biases, in {} arrays, bit for bit\n", file, result.numbers,
               result.arrays);
    return;
  }
  const firmware::Difference& difference = *result.first_difference;
  if (difference.found) {
    fmt::print("different: {} {} {} is {} in the network, {} in {} ({}, {})\n", difference.part,
               difference.layer, difference.entry, files::hex_float(static_cast<double>(difference.expected)),
               files::hex_float(static_cast<double>(*difference.found)), file, difference.name,
               difference.place);
  } else {
    fmt::print("different: nothing in {} resembles {} {} {}\n", file, difference.part, difference.layer,
               difference.entry);
  }
}

int run_match(MatchOptions options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  if (options.words.size() != (options.network.phi.empty() ? 2u : 1u))
    throw UsageError("match takes NET FILE, or --phi F --rho F FILE");
  options.file = options.words.back();
  if (options.words.size() == 2) options.network.file = options.words.front();
  bool is_rounded = false;
  const files::Network network = load_flown_net(options.network, options.as, is_rounded);
  const std::string bytes = files::read_file(options.file);
  const firmware::MatchResult result =
      match(network, firmware::is_elf(bytes) ? firmware::blocks_in_elf(bytes, options.file)
                                             : firmware::blocks_in_source(bytes, options.file));
  std::vector<std::string> inputs = input_files(network);
  inputs.push_back(options.file);
  files::Json json = result_head("match", inputs);
  json["as"] = is_rounded ? files::Json("float32") : files::Json();
  json["equal"] = result.equal;
  json["arrays"] = result.arrays;
  json["numbers"] = result.numbers;
  json["first_difference"] = result.first_difference ? json_of(*result.first_difference) : files::Json();
  write_result(common, json);
  if (common.prints_text()) print(result, options.file);
  return result.equal ? kDone : kViolated;
}

}  // namespace

Command match_command() {
  return {"match", "Whether a source file or an ELF holds exactly these weights",
          "Every weight matrix, in the layout of an export, row by row or transposed, and every bias must "
          "stand in FILE bit for bit: C "
          "or C++ source "
          "of\nours or of the networks' authors, or a little-endian ELF with or without symbols. Exit code 1 "
          "and the first\n"
          "difference otherwise. With --phi and --rho, NET is those two files.\n\n"
          "Example: swarmcert match nn/networks/demo/network.toml firmware/swarmcert_network.cpp",
          [](CLI::App& app) {
            const auto options = std::make_shared<MatchOptions>();
            app.add_option("NET FILE", options->words, "The network, then the source file or ELF")
                ->required()
                ->expected(1, 2);
            auto* phi = app.add_option("--phi", options->network.phi, "Weight file of phi, instead of NET");
            auto* rho = app.add_option("--rho", options->network.rho, "Weight file of rho, instead of NET");
            phi->needs(rho);
            rho->needs(phi);
            app.add_option("--key", options->network.key,
                           "Where the state dict lies inside a nested checkpoint");
            declare_as(app, options->as);
            return [options](const CommonOptions& common) { return run_match(*options, common); };
          }};
}

}  // namespace swarmcert::analysis
