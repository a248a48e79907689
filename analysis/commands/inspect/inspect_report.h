/// @file The page of `inspect --report`.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/inspect/inspect_result.h"

namespace swarmcert::analysis {

/// Returns lines "time height thrust air" for gnuplot, at most 1500, separated by empty lines at gaps. Thrust is
/// relative to its 75 % quantile in the log, NaN if the log has none. `air` is 1 in the air.
std::string curve_of(const logs::Log& log);

/// Writes FOLDER/report.html: the collections, then each log with its phases, events, gaps, signals, what can be
/// judged and what to log next time. Returns its path. Only the table lists logs beyond a fixed number.
/// @param curves of the logs in `result`, in their order
/// @param described `result` with its head
/// @throws as Report::write().
std::string write_inspect_report(const InspectResult& result, const std::vector<std::string>& curves,
                                 const files::Node& described, const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
