/// @file A proposal of columns.toml for a CSV, with the evidence for each guess.
#pragma once

#include <string>

namespace swarmcert::logs {

/// Signal, unit and frame of every column of a CSV that is recognised, as a columns.toml that reads the file to the
/// same samples. Units and signs are those by which the stored numbers and the interpreted signals differ; comments say
/// what was decided from the data. Columns without a meaning are listed at the end.
/// @throws files::InputError as read_log(), and where the file is no CSV.
std::string columns_draft(const std::string& path);

}  // namespace swarmcert::logs
