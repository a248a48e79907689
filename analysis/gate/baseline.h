/// @file The values and conditions of the last release, with which the next release is compared.
#pragma once

#include <map>
#include <string>

#include "analysis/gate/check.h"
#include "analysis/gate/conditions.h"
#include "nn/base/record.h"

namespace swarmcert::gate {

struct Baseline {
  std::map<std::string, double> values;  ///< by row name
  Conditions conditions;
  std::string content_sha256;  ///< of the file that is written
};

/// Describes the file.
void describe(files::Record& record, const Baseline& baseline);
void describe_baseline_file(files::Record& record);

/// Reads a baseline file. A baseline carries a hash of its content, so that no number changes unnoticed.
/// @throws files::InputError if the file cannot be read, is not a baseline, or was edited.
Baseline read_baseline(const std::string& path);

/// Atomically replaces the file by the values of `checks`, without NaN and infinities, and the conditions.
void write_baseline(const std::string& path, const Checks& checks, const Conditions& conditions = {});

}  // namespace swarmcert::gate
