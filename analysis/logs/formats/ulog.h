/// @file PX4 ULog (`.ulg`), version 0 and 1 of the file format.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// True if the magic number of ULog starts `head`.
bool looks_like_ulog(std::string_view head);

/// Topics by name and instance (multi_id), times from their field `timestamp`. Texts: information messages; several of
/// one key are `key[0]`, `key[1]`, ... Parameters as the log starts; later settings are parameter_changes.
/// A topic whose subscription or format the file lost is named in `skipped`. Messages of unknown types are skipped, as
/// the format demands. Where no sound message follows, the reader looks for the next sound message that leads to
/// others, and counts the place and the bytes in `health`; sections appended after a crash are read as well.
/// @throws files::InputError if the file is empty or no ULog, or announces features without which it cannot be read.
RawLog read_ulog(std::istream& in, const std::string& path);

}  // namespace swarmcert::logs
