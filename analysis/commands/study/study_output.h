/// @file The result of `study` as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/before_after.h"
#include "analysis/identification/fleet/difference.h"
#include "analysis/identification/study/study.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Returns the whole answer in one sentence, with its numbers.
std::string headline(const identification::Study& study, const residuals::ForceUnit& unit);

/// Adds `before`, `after`, `ladder`, `ranking`, `remainder`, `verdict`, `next` and `split`; forces in newton.
void add_study(const identification::Study& study, const residuals::Inputs& inputs, files::Json& result);

/// Prints about ten lines for the terminal.
void print_study(const identification::Study& study, const residuals::ForceUnit& unit);

/// Differences from the flights of --against.
struct Changes {
  std::vector<identification::Difference> differences;  ///< one per vehicle
  files::Json judged;                                   ///< from changed_json()
};

/// Returns `verdict`, `ranking` and `rotors`, as written by diagnose --against.
files::Json changed_json(const std::vector<identification::Difference>& differences,
                         const residuals::Inputs& inputs, const residuals::Inputs& others, int jobs);

/// Adds `against` and `changed`.
void add_changes(const Changes& changes, const std::vector<std::string>& other_files, files::Json& result);

/// Returns one sentence per vehicle, and one per rotor that is named.
std::vector<std::string> in_words(const Changes& changes);

void print_changes(const Changes& changes);

}  // namespace swarmcert::analysis
