#include "analysis/cli/command.h"

#include <fmt/core.h>

#include <filesystem>

#include "analysis/cli/command_line.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {

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
}

files::Network load_net(const files::NetworkArguments& arguments) {
  if (arguments.file.empty() && arguments.phi.empty()) {
    throw UsageError("no network: name a network.toml, one weight file, or --phi F --rho F");
  }
  return files::load_network(arguments);
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

void refuse_folder(const CommonOptions& common, const std::string& folder) {
  std::error_code ignored;
  if (folder.empty() || common.force || !std::filesystem::exists(folder, ignored)) return;
  if (std::filesystem::is_directory(folder, ignored) && std::filesystem::is_empty(folder, ignored)) return;
  throw files::InputError(
      {folder, "", "", "", "exists and is not an empty folder", "--force writes into it"});
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
