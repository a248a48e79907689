/// @file CSV of Crazyflie log variables, as cfclient writes it and people with cflib do.
#pragma once

#include <iosfwd>
#include <string>
#include <string_view>

#include "analysis/logs/raw_log.h"

namespace swarmcert::logs {

/// True if `head` starts with a line of names of which the first is a time ("Timestamp", "time", "tick") and another is
/// `group.name`, with a unit in brackets or without.
bool looks_like_crazyflie_csv(std::string_view head);

/// One topic, "csv", with all columns, that of the time included. Cells that are no numbers are NaN; columns without a
/// single number are named in `skipped`. The unit of time is the one in the header; without one, the median step
/// decides: 0.5 to 1500 is ms, as cfclient writes, less is s, more is us, then ns. `texts["time_unit"]` holds it.
/// @throws files::InputError if the file is empty or its head names a column twice.
RawLog read_crazyflie_csv(std::istream& in, const std::string& path);

/// True for a folder in which cfclient recorded: it writes a file `<block>-<date>T<time>.csv` for each block of
/// variables.
bool looks_like_cfclient_folder(const std::string& path);

/// All files of the folder as one log: a topic for each block, on the one clock that they share, the vehicle's.
/// @throws files::InputError as read_crazyflie_csv().
RawLog read_cfclient_folder(const std::string& path);

}  // namespace swarmcert::logs
