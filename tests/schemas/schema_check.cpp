#include "schemas/schema_check.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

namespace swarmcert::tests {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMostFaults = 5;

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// A result of `model draft` has the same kind as model.toml.
std::string schema_name(const json& document) {
  std::string kind = document["schema"].get<std::string>();
  kind = kind.substr(kind.find('/') + 1);
  kind = kind.substr(0, kind.find('/'));
  return kind == "model" && document.contains("command_line") ? "model-draft" : kind;
}

/// What `swarmcert schema NAME` prints; empty if it knows no such schema.
std::string printed_schema(const std::string& name) {
  if (name.find_first_not_of("abcdefghijklmnopqrstuvwxyz-") != name.npos) return "";
  FILE* pipe = popen(("'" SWARMCERT_TOOL "' schema " + name + " 2>/dev/null").c_str(), "r");
  if (pipe == nullptr) return "";
  std::string text;
  std::array<char, 65536> buffer{};
  while (const std::size_t read = std::fread(buffer.data(), 1, buffer.size(), pipe))
    text.append(buffer.data(), read);
  pclose(pipe);
  return text;
}

/// Parses each schema once per process.
/// @return nullptr if there is none of this name
const valijson::Schema* schema_of(const std::string& name) {
  static std::map<std::string, std::unique_ptr<valijson::Schema>> cache;
  const auto found = cache.find(name);
  if (found != cache.end()) return found->second.get();
  std::unique_ptr<valijson::Schema> schema;
  const json document = json::parse(printed_schema(name), nullptr, false);
  if (document.is_object()) {
    schema = std::make_unique<valijson::Schema>();
    valijson::SchemaParser().populateSchema(valijson::adapters::NlohmannJsonAdapter(document), *schema);
  }
  return cache.emplace(name, std::move(schema)).first->second.get();
}

}  // namespace

std::vector<std::string> schema_faults(const std::string& text) {
  static const std::set<std::string> kPrivate = {"checkpoint", "flown", "learned", "table-unit", "test"};
  const json document = json::parse(text, nullptr, false);
  if (!document.is_object() || !document.contains("schema") || !document["schema"].is_string()) return {};
  if (document["schema"].get<std::string>().rfind("swarmcert/", 0) != 0) return {};
  const std::string name = schema_name(document);
  if (kPrivate.count(name) == 1) return {};
  const valijson::Schema* const schema = schema_of(name);
  if (schema == nullptr) return {"the tool has no schema " + name};
  valijson::ValidationResults results;
  const valijson::adapters::NlohmannJsonAdapter target(document);
  if (valijson::Validator().validate(*schema, target, &results)) return {};
  std::vector<std::string> faults;
  for (valijson::ValidationResults::Error error; faults.size() < kMostFaults && results.popError(error);) {
    std::string place;
    for (const std::string& part : error.context) place += part;
    faults.push_back("schema " + name + ": " + place + ": " + error.description);
  }
  return faults;
}

void expect_schema(const std::string& text, const std::string& source) {
  for (const std::string& fault : schema_faults(text)) ADD_FAILURE() << source << ": " << fault;
}

void expect_schemas_of_files(const fs::path& folder, fs::file_time_type start) {
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() != ".json" || !entry->is_regular_file(error)) continue;
    if (entry->last_write_time(error) >= start) expect_schema(text_of(entry->path()), entry->path().string());
  }
}

}  // namespace swarmcert::tests
