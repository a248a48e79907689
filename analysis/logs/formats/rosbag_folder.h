/// @file A folder that rosbag2 wrote: metadata.yaml and one or several files.
#pragma once

#include <string>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// True for a folder with a metadata.yaml of rosbag2.
bool looks_like_rosbag_folder(const std::string& path);

/// The files of the folder as one log, in the order of metadata.yaml; topics go on from file to file. Only files inside
/// the folder are read, whatever metadata.yaml says. Files that were compressed as a whole (`.zstd`) are read as well.
/// A file that cannot be read, or is missing, is named in `skipped` and sets `health.truncated`, unless none can be
/// read.
/// @throws files::InputError if none of the files can be read.
RawLog read_rosbag_folder(const std::string& path);

}  // namespace swarmcert::logs
