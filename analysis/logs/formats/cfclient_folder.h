/// @file Sessions of the Crazyflie client: a folder with one CSV file for each log block.
#pragma once

#include <string>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Returns true for a folder whose CSV files all have names as `pose-20260131T12-00-59.csv`.
bool looks_like_cfclient_folder(const std::string& path);

/// Reads a session as one log with a topic for each block.
/// @throws files::InputError if a file cannot be read
RawLog read_cfclient_folder(const std::string& path);

}  // namespace swarmcert::logs
