/// @file Validates results of commands against the JSON Schemas that ship with the tool.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace swarmcert::tests {

/// Returns the violations of the schema named by the field `schema` of a result or file. Empty if it conforms, if
/// `text` is not one of our JSON objects, or if it is a private file from which a command resumes.
std::vector<std::string> schema_faults(const std::string& text);

/// Adds a test failure for each fault of `text`, which came from `source`.
void expect_schema(const std::string& text, const std::string& source);

/// Does the same for each .json file below `folder` written since `start`.
void expect_schemas_of_files(const std::filesystem::path& folder, std::filesystem::file_time_type start);

}  // namespace swarmcert::tests
