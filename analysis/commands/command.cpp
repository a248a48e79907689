#include "analysis/commands/command.h"

#include <fmt/core.h>

#include <filesystem>
#include <set>

#include "analysis/commands/gate_command.h"
#include "nn/files/file_io.h"
#include "nn/files/functions.h"
#include "nn/files/input_error.h"

namespace swarmcert::analysis {
namespace {

std::vector<std::string>& command_line() {
  static std::vector<std::string> words;
  return words;
}

}  // namespace

const std::vector<Command>& commands() {
  static const std::vector<Command> all = {
      inspect_command(),          //
      certify_command(),          //
      check_command(),            //
      compare_command(),          //
      diagnose_command(),         //
      add_command(),              //
      train_command(),            //
      simulate_command(),         //
      reproduce_command(),        //
      bound_command(),            //
      spacing_command(),          //
      sweep_command(),            //
      merge_command(),            //
      tune_command(),             //
      iss_check_command(),        //
      identify_thrust_command(),  //
      export_command(),           //
      match_command(),            //
      gate_command(),             //
      verify_bundle_command(),    //
      demo_command(),
  };
  return all;
}

void declare_network(CLI::App& app, files::NetworkArguments& arguments) {
  auto* file =
      app.add_option("NET", arguments.file, "network.toml, or a weight file that holds one plain network");
  auto* phi =
      app.add_option("--phi", arguments.phi, "Weight file of phi, evaluated per neighbour (kind: default)");
  auto* rho =
      app.add_option("--rho", arguments.rho, "Weight file of rho, evaluated on the sum (kind: default)");
  phi->needs(rho)->excludes(file);
  rho->needs(phi)->excludes(file);
  app.add_option("--key", arguments.key, "Where the state dict lies inside a nested checkpoint, e.g. model");
}

files::Network load_net(const files::NetworkArguments& arguments) {
  if (arguments.file.empty() && arguments.phi.empty()) {
    throw UsageError("no network: name a network.toml, one weight file, or --phi F --rho F");
  }
  return files::load_network(arguments);
}

void remember_command_line(int argc, const char* const* argv) {
  static const std::set<std::string> with_value = {
      "--jobs",   "-j",       "--json",  "-o",      "--output",   "--report", "--csv",
      "--fitted", "--inject", "--junit", "--sarif", "--markdown", "--bundle"};
  static const std::set<std::string> flags = {"-q", "--quiet", "--force", "--github"};
  // "-j2", "-qj2", "-qj 2", "-ofile": one dash, then flags, then perhaps an option with its value.
  const auto short_options = [](const std::string& word) {
    if (word.size() < 3 || word[0] != '-' || word[1] == '-') return std::string::npos;
    std::size_t at = 1;
    while (at < word.size() && word[at] == 'q') ++at;
    return at == word.size() || word[at] == 'j' || word[at] == 'o' ? at : std::string::npos;
  };
  std::vector<std::string>& words = command_line();
  words = {"swarmcert"};
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (flags.count(word) == 1) continue;
    if (with_value.count(word) == 1) {
      ++i;
      continue;
    }
    if (const std::size_t at = short_options(word); at != std::string::npos) {
      if (at + 1 == word.size()) ++i;  // its value is the next word
      continue;
    }
    const std::string before_equals = word.substr(0, word.find('='));
    if (before_equals != word && with_value.count(before_equals) == 1) continue;
    words.push_back(word);
  }
}

files::Json result_head(const std::string& command, const std::vector<std::string>& input_files) {
  files::Json inputs = files::Json::array();
  for (const std::string& path : input_files) {
    inputs.push_back({{"file", path}, {"sha256", files::sha256(files::read_file(path))}});
  }
  return {{"schema", "swarmcert/" + command + "/1"},
          {"tool", "swarmcert " SWARMCERT_VERSION},
          {"command_line", command_line()},
          {"inputs", std::move(inputs)},
          {"seed", nullptr}};
}

void refuse_to_replace(const CommonOptions& common, const std::string& path) {
  if (path.empty() || path == "-" || common.force) return;
  const auto status = std::filesystem::status(path);  // devices and pipes are written to, not replaced
  if (!std::filesystem::is_regular_file(status) && !std::filesystem::is_directory(status)) return;
  throw files::InputError({path, "", "", "", "the file exists", "--force replaces it"});
}

void write_result(const CommonOptions& common, const files::Json& result) {
  if (!common.json.empty()) files::write_file(common.json, files::to_text(result), common.force);
}

std::vector<std::string> input_files(const files::Network& network) {
  std::vector<std::string> paths;
  if (!network.path.empty()) paths.push_back(network.path);
  for (const auto& [name, weights] : files::parts(network)) paths.push_back(weights->path);
  return paths;
}

}  // namespace swarmcert::analysis
