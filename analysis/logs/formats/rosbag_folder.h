/// @file Reads a rosbag2 folder: metadata.yaml and one or several files.
#pragma once

#include <string>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Returns true for a folder with a metadata.yaml of rosbag2.
bool looks_like_rosbag_folder(const std::string& path);

/// Reads the files of the folder as one log, in the order of metadata.yaml; topics continue from file to file. Only
/// files inside the folder are read, whatever metadata.yaml says. Files compressed as a whole (`.zstd`) are supported.
/// A file that is missing or cannot be read is listed in `skipped` and sets `health.truncated`.
/// @throws files::InputError if none of the files can be read.
RawLog read_rosbag_folder(const std::string& path);

}  // namespace swarmcert::logs
