#include <fmt/core.h>

#include <map>
#include <memory>

#include "analysis/commands/commands.h"
#include "analysis/commands/schema/file_kinds.h"
#include "nn/base/suggest.h"

namespace swarmcert::analysis {
namespace {

using files::Json;

/// The schema of a file: its $id ends in the version that the file states.
Json schema_of_file(const FileKind& kind) {
  files::Node shape;
  files::Record record(shape, true);
  kind.describes(record);
  Json schema = files::schema_of(shape, kind.name, kind.title, kind.description, false);
  const std::string stated = schema["properties"]["schema"]["const"];
  schema["$id"] = "urn:swarmcert:schema:" + kind.name + ":" + stated.substr(stated.rfind('/') + 1);
  return schema;
}

/// Schemas by name, of files and of results.
std::map<std::string, Json> schemas() {
  std::map<std::string, Json> all;
  for (const FileKind& kind : file_kinds()) all[kind.name] = schema_of_file(kind);
  for (const Command& command : commands()) {
    if (!command.describe_result) continue;
    // The file model.toml has the kind `model` too.
    const std::string name = command.name == "model" ? "model-draft" : command.name;
    all[name] = files::schema_of(result_shape(command.name, command.describe_result), name, command.summary,
                                 "What `swarmcert " + command.name + " --json FILE` writes.", true);
  }
  return all;
}

struct SchemaResult {
  std::vector<std::string> names;
  Json schema;
};

void describe(files::Record& record, const SchemaResult& result) {
  record.field("names", result.names, "Of all schemas.");
  record.field("json_schema", result.schema, "The schema that was asked for; null: none was.");
}

int run_schema(const std::string& name, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  const std::map<std::string, Json> all = schemas();
  SchemaResult result;
  for (const auto& [known, schema] : all) result.names.push_back(known);
  if (!name.empty() && all.count(name) == 0)
    throw UsageError("schema " + name + ": " + files::did_you_mean(name, result.names));
  if (!name.empty()) result.schema = all.at(name);
  write_result(common, result_of("schema", {}, std::nullopt, result));
  if (!common.prints_text()) return kDone;
  if (!name.empty()) {
    fmt::print("{}", files::to_text(result.schema));
    return kDone;
  }
  for (const std::string& each : result.names) fmt::print("{}\n", each);
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
      },
      fields_of<SchemaResult>()};
}

}  // namespace swarmcert::analysis
