#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "analysis/cli/bundled.h"
#include "analysis/commands/commands.h"
#include "nn/base/file_io.h"
#include "nn/base/suggest.h"

namespace swarmcert::analysis {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEnding = ".schema.json";

/// Names of the schemas in `folder`, sorted.
std::vector<std::string> schema_names(const std::string& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const std::size_t at = name.rfind(kEnding);
    if (at != std::string::npos && at > 0) names.push_back(name.substr(0, at));
  }
  std::sort(names.begin(), names.end());
  return names;
}

int run_schema(const std::string& name, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  const std::string folder = bundled_folder("schemas", "analysis/schemas");
  const std::vector<std::string> names = schema_names(folder);
  if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end())
    throw UsageError("schema " + name + ": " + files::did_you_mean(name, names));
  const std::string path = (fs::path(folder) / (name + kEnding)).string();
  files::Json result = result_head("schema", {});
  result["names"] = names;
  result["json_schema"] = name.empty() ? files::Json() : files::parse_json(files::read_file(path), path);
  write_result(common, result);
  if (!common.prints_text()) return kDone;
  if (name.empty()) {
    for (const std::string& each : names) fmt::print("{}\n", each);
  } else {
    fmt::print("{}", files::read_file(path));
  }
  return kDone;
}

}  // namespace

Command schema_command() {
  return {
      "schema", "JSON Schemas of the results of --json and of the tool's files",
      "Prints the schema (draft 2020-12) of one result or file, or the names of all schemas. A result has "
      "the name\n"
      "of its command; TOML files are validated as the JSON that they correspond to.\n\n"
      "Example: swarmcert schema\n"
      "         swarmcert schema certify",
      [](CLI::App& app) {
        const auto name = std::make_shared<std::string>();
        app.add_option("NAME", *name, "certify, compare, network, model, ...; without it, the names");
        return [name](const CommonOptions& common) { return run_schema(*name, common); };
      }};
}

}  // namespace swarmcert::analysis
