/// @file Which part of a collection of logs can be judged: one line for each folder.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "nn/base/json.h"

namespace swarmcert::analysis {

/// What became of one log.
struct LogOutcome {
  std::string path;
  bool opened = false;
  bool force[3] = {};        ///< judged along x, y, z of the world
  bool torque = false;       ///< at least its mean in slow flight
  double seconds = 0;        ///< of flight: in the air or, where a model was compared, used
  double run_s = 0;          ///< that the program took to read and judge it; 0: not measured
  std::string left_out_why;  ///< empty where at least one axis is judged
};

/// Sums over the logs of one folder.
struct CollectionRow {
  std::string name;
  std::size_t logs = 0, opened = 0, force[3] = {}, torque = 0;
  double seconds = 0, run_s = 0;
  std::map<std::string, std::size_t> left_out;  ///< by reason
};

/// One row for each folder among `words` that a user named or, where its logs lie in several folders right below it,
/// for each of those; a row for all where there are several. Empty where no folder was named.
std::vector<CollectionRow> collection_rows(const std::vector<std::string>& words,
                                           const std::vector<LogOutcome>& logs);

/// Without run_s: a result depends on its inputs alone.
files::Json json_of(const std::vector<CollectionRow>& rows);

/// On stdout: flight seconds, with what `seconds` counts, and the run time where it was measured.
void print_collections(const std::vector<CollectionRow>& rows, const std::string& seconds);

}  // namespace swarmcert::analysis
