/// @file Proposes a columns.toml for a CSV file, with the evidence for each guess.
#pragma once

#include <string>

namespace swarmcert::logs {

/// Returns a columns.toml with the signal, unit and frame of each recognised column of a CSV file; reading the file
/// with it gives the same samples. Units and signs are derived by comparing the stored numbers with the interpreted
/// signals; comments state what was decided from the data. Columns without a meaning are listed at the end.
/// @throws files::InputError as read_log() does, and if the file is not a CSV file.
std::string columns_draft(const std::string& path);

}  // namespace swarmcert::logs
