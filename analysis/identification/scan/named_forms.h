/// @file Effects of the registry suggested by formulas of the scan.
///
/// A thermal, a wall or a dropped payload has a place or time that no coarse grid covers, and many candidates would
/// increase the number of false claims. These effects are therefore candidates only if the scan, which is protected
/// against chance findings, has found their variable; they start at the place found by its formula and then compete
/// with that formula.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/candidates.h"
#include "analysis/identification/scan/formulas.h"

namespace swarmcert::identification {

/// Returns true for effects that are candidates only through named_forms().
bool needs_scan(const std::string& effect);

/// Returns the candidates suggested by `formulas`, in their order; each effect once for every formula that suggests it
/// with another shape. Effects that `model` has are skipped.
std::vector<Candidate> named_forms(const std::vector<Formula>& formulas, const stability::Model& model,
                                   const Coverage& coverage);

}  // namespace swarmcert::identification
