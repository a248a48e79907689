/// @file The page of `inspect --report`.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/collection_table.h"
#include "analysis/logs/log.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// What the page needs of one log.
struct InspectedLog {
  std::string path;
  files::Json described;            ///< describe_log()
  std::vector<std::string> damage;  ///< logs::findings()
  std::string curve;                ///< curve_of()
};

/// Lines "time height thrust air" for gnuplot, at most 1500, broken by empty lines at gaps. Thrust is relative to what
/// is common in the log; NaN where it has none. `air` is 1 in the air.
std::string curve_of(const logs::Log& log);

/// Writes FOLDER/report.html: the collections, then each log with its phases, events, gaps, signals, what can be judged
/// and what to log next time; returns its path. Beyond a number of logs, the rest is in the table only. @throws as
/// Report::write().
std::string write_inspect_report(const std::vector<InspectedLog>& logs,
                                 const std::vector<CollectionRow>& rows, const files::Json& result,
                                 const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
