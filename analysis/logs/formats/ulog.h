/// @file PX4 ULog (`.ulg`), file format versions 0 and 1.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Returns true if `head` starts with the magic number of ULog.
bool looks_like_ulog(std::string_view head);

/// Reads a log. Topics are identified by name and instance (multi_id); times come from their field `timestamp`. Texts
/// are the information messages; several with the same key become `key[0]`, `key[1]`, ... Parameters are those at the
/// start of the log; later settings become parameter_changes. A topic whose subscription or format is lost is listed in
/// `skipped`. Messages of unknown types are skipped, as the format requires. If no valid message follows, the reader
/// searches for the next valid message that is followed by others, and counts the damaged place and the skipped bytes
/// in `health`. Sections appended after a crash are read as well.
/// @throws files::InputError if the file is empty or not a ULog file, or requires features that are not supported.
RawLog read_ulog(std::istream& in, const std::string& path);

}  // namespace swarmcert::logs
