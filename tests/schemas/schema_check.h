/// @file Results of commands held against the JSON Schemas that ship with the tool.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace swarmcert::tests {

/// What a result or file of ours breaks of the schema that its own field `schema` names. Empty if it conforms, if
/// `text` is no JSON object of ours, or if it is of a kind that a command keeps to itself to be resumed.
std::vector<std::string> schema_faults(const std::string& text);

/// Adds a test failure for each fault of `text`, which came from `source`.
void expect_schema(const std::string& text, const std::string& source);

/// The same for every .json file below `folder` that was written since `start`.
void expect_schemas_of_files(const std::filesystem::path& folder, std::filesystem::file_time_type start);

}  // namespace swarmcert::tests
