/// @file The result of `study` as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/commands/shared/before_after.h"
#include "analysis/identification/study/study.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// The whole answer in one sentence, with its numbers.
std::string headline(const identification::Study& study, const residuals::ForceUnit& unit);

/// `before`, `after`, `ladder`, `ranking`, `remainder`, `verdict`, `next` and `split`; forces in newton.
void add_study(const identification::Study& study, const residuals::Inputs& inputs, files::Json& result);

/// Ten lines for the terminal.
void print_study(const identification::Study& study, const residuals::ForceUnit& unit);

}  // namespace swarmcert::analysis
