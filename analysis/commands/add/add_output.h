/// @file An error ladder as JSON and as text.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/ladder.h"
#include "nn/base/json.h"

namespace swarmcert::analysis {

/// Returns one entry per row: `effect`, `fit_rmse`, `select_rmse`, `test_rmse` in newton, `accepted`, `reason`.
files::Json ladder_json(const std::vector<stability::LadderRow>& rows);

/// Adds `ladder`, `earlier`, `test_looks`, `split` and `effects` to the result.
void add_ladder(const identification::Ladder& ladder, const residuals::Inputs& inputs, files::Json& result);

/// Prints the ladder as text.
void print_ladder(const std::vector<stability::LadderRow>& rows);
/// Says which quantity the errors of the rows measure: the force residual, or the balance of the rotors where that
/// was fitted.
std::string what_rows_measure(const std::vector<stability::LadderRow>& rows);
void print_ladder(const identification::Ladder& ladder);

}  // namespace swarmcert::analysis
