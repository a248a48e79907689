/// @file The result of `study` as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/study/study.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// The whole answer in one sentence, with its numbers.
std::string headline(const identification::Study& study, const residuals::ForceUnit& unit);

/// Flights that would answer what these leave open, best first: of the rivals of each effect, then of effects that these
/// flights could not have shown at any size.
std::vector<std::string> next_flights(const identification::Study& study);

/// `before`, `after`, `ladder`, `ranking`, `remainder`, `verdict`, `next` and `split`; forces in newton.
void add_study(const identification::Study& study, const residuals::Inputs& inputs, files::Json& result);

/// Ten lines for the terminal.
void print_study(const identification::Study& study, const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
