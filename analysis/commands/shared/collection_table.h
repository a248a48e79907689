/// @file Table of the parts of a log collection that can be judged, one line per folder.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/report/table.h"
#include "nn/base/record.h"

namespace swarmcert::analysis {

/// The outcome for one log.
struct LogOutcome {
  std::string path;
  bool opened = false;
  bool force[3] = {};        ///< judged along x, y, z of the world
  bool torque = false;       ///< at least its mean in slow flight
  double seconds = 0;        ///< flight time: in the air, or the time used if a model was compared
  double run_s = 0;          ///< run time of reading and judging the log; 0: not measured
  std::string left_out_why;  ///< empty if at least one axis is judged
};

/// Sums over the logs of one folder.
struct CollectionRow {
  std::string name;
  std::size_t logs = 0, opened = 0, force[3] = {}, torque = 0;
  double seconds = 0, run_s = 0;
  std::map<std::string, std::size_t> left_out;  ///< by reason
};

/// Returns one row per folder that the user named in `words`, or one row per subfolder if the logs of a named folder
/// are in several of its direct subfolders; plus a row of totals if there are several rows. Empty if no folder was
/// named.
std::vector<CollectionRow> collection_rows(const std::vector<std::string>& words,
                                           const std::vector<LogOutcome>& logs);

/// Without run_s, because a result depends on its inputs only.
void describe(files::Record& record, const CollectionRow& row);

/// Returns one line per row, with the run time if it was measured.
Table collection_table(const std::vector<CollectionRow>& rows);

/// Prints it; `seconds` says which seconds of flight are counted.
void print_collections(const std::vector<CollectionRow>& rows, const std::string& seconds);

}  // namespace swarmcert::analysis
