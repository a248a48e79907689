/// @file An error ladder as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/ladder.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// One entry per row: `effect`, `fit_rmse`, `select_rmse`, `test_rmse` in newton, `accepted`, `reason`.
files::Json ladder_json(const std::vector<stability::LadderRow>& rows);

/// `ladder`, `earlier`, `test_looks`, `split`, `effects`.
void add_ladder(const identification::Ladder& ladder, const residuals::Inputs& inputs, files::Json& result);

/// Text for people.
void print_ladder(const std::vector<stability::LadderRow>& rows);
/// What the errors of the rows are of: the force residual, or the rotors' balance where that is what was fitted.
std::string what_rows_measure(const std::vector<stability::LadderRow>& rows);
void print_ladder(const identification::Ladder& ladder);

}  // namespace swarmcert::analysis
