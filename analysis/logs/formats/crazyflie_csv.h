/// @file CSV files of Crazyflie log variables, as written by cfclient and by cflib scripts.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// Returns true if `head` starts with a line of names whose first is a time ("Timestamp", "time", "tick") and another
/// one has the form `group.name`, with or without a unit in brackets.
bool looks_like_crazyflie_csv(std::string_view head);

/// Returns one topic, "csv", with all columns including the time. Cells that are not numbers become NaN; columns
/// without any number are listed in `skipped`. The time unit is taken from the header; without one the median step
/// decides: below 0.5 is s, 0.5 to 1500 is ms (as cfclient writes), larger steps are us, then ns. `texts["time_unit"]`
/// holds the result.
/// @throws files::InputError if the file is empty or its header contains a name twice.
RawLog read_crazyflie_csv(std::istream& in, const std::string& path);

/// Returns true for a folder recorded by cfclient, which writes a file `<block>-<date>T<time>.csv` for each log block.
bool looks_like_cfclient_folder(const std::string& path);

/// Reads all files of the folder as one log, with one topic per block; they share the vehicle's clock.
/// @throws files::InputError as read_crazyflie_csv() does.
RawLog read_cfclient_folder(const std::string& path);

}  // namespace swarmcert::logs
