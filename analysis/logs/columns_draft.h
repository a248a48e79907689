/// @file Proposes a columns.toml for a CSV file, with the evidence for each guess.
#pragma once

#include <string>

namespace swarmcert::logs {

/// Returns a columns.toml with the signal, unit and frame of each column that read_log() uses, for CSV and micro-SD
/// logs; reading the file with it gives the same log. Comments state the evidence. Columns without a meaning are
/// listed at the end.
/// @throws files::InputError as read_log() does, and for other formats
std::string columns_draft(const std::string& path);

}  // namespace swarmcert::logs
