/// @file Text of `inspect`, and the sentences and tables that its page shows as well.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/inspect/inspect_result.h"
#include "analysis/report/table.h"

namespace swarmcert::analysis {

/// Prints what a file holds to standard output; nothing for a file that cannot be read.
void print_file(const InspectedFile& file);

/// Returns a table with a line per log: records, time in the air, axes that can be judged, and the reason if it is not
/// a flight.
Table log_list(const std::vector<const LogFile*>& logs);

/// Returns what is known about a log as sentences without a full stop: the recording and its damage, what was seen in
/// the data, what can be judged.
std::vector<std::string> sentences_on(const LogFile& file);

/// Returns the tables on a log that are not empty: signals, what to log next time, phases and events.
/// @param log as described
std::vector<Table> tables_on(const files::Node& log);

/// Prints which logs were taken as one flight and why.
void print_grouping(const residuals::FoundFlights& found);

}  // namespace swarmcert::analysis
