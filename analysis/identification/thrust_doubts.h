/// @file A thrust ratio that is only the mean of a force that depends on something else.
#pragma once

#include <vector>

#include "analysis/identification/missing.h"
#include "analysis/identification/scan/formulas.h"

namespace swarmcert::identification {

/// Returns whether `ranking` has a thrust_ratio within two percent of 1 that is only the mean of a vertical force which
/// vanishes somewhere: beside one of `formulas` without its offset, most of the ratio is surely not there, and the
/// formula alone explains more. Both by comparing fits to the same blocks of 2 s. The decisions are statistical, at
/// 90 % and two standard errors; they guarantee nothing.
/// @param formulas of the remainder beside `ranking`, see find_formulas()
bool is_mean_of_a_force(const Passes& passes, const std::vector<Missing>& ranking,
                        const std::vector<Formula>& formulas);

}  // namespace swarmcert::identification
