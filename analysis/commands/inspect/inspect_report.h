/// @file The page of `inspect --report`.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/collection_table.h"
#include "analysis/logs/log.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// The data of one log that the page shows.
struct InspectedLog {
  std::string path;
  files::Json described;            ///< describe_log()
  std::vector<std::string> damage;  ///< logs::findings()
  std::string curve;                ///< curve_of()
};

/// Returns lines "time height thrust air" for gnuplot, at most 1500, separated by empty lines at gaps. Thrust is
/// relative to its 75 % quantile in the log, NaN if the log has none. `air` is 1 in the air.
std::string curve_of(const logs::Log& log);

/// Writes FOLDER/report.html: the collections, then each log with its phases, events, gaps, signals, what can be
/// judged and what to log next time. Returns its path. Only the table lists logs beyond a fixed number.
/// @throws as Report::write().
std::string write_inspect_report(const std::vector<InspectedLog>& logs,
                                 const std::vector<CollectionRow>& rows, const files::Json& result,
                                 const std::string& folder, bool overwrite);

}  // namespace swarmcert::analysis
