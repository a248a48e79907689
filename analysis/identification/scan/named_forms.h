/// @file Effects of the registry that formulas of the scan point to.
///
/// A thermal, a wall or a dropped payload has a place or a time that no grid of a few values finds, and many candidates
/// raise the number of false claims. So these effects are candidates only where the scan, which is guarded against
/// accidents, has found their variable, with the place that its formula found. They then compete with that formula.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/candidates.h"
#include "analysis/identification/scan/formulas.h"

namespace swarmcert::identification {

/// True for effects that are candidates by named_forms() only.
bool needs_scan(const std::string& effect);

/// True if formulas over this variable of the scan make `effect` a candidate.
bool points_to(const std::string& variable, const std::string& effect);

/// Candidates that `formulas` point to, in their order, each effect once for every formula that points to it with
/// another shape. Effects that `model` has are left out.
std::vector<Candidate> named_forms(const std::vector<Formula>& formulas, const stability::Model& model,
                                   const Coverage& coverage);

}  // namespace swarmcert::identification
