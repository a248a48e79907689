/// @file Effects for `add formula` and `add shape`: effects without a name, found by scanning the remainder.
#pragma once

#include <optional>
#include <string>

#include "analysis/identification/scan/formulas.h"

namespace swarmcert::identification {

/// Returns true for "formula", "formula:K" with K from 1, "shape" and "shape:K".
bool is_proposal(const std::string& name);

/// Returns a curve for `entry` if formulas can use its variable: an offset and up to seven ramps between equidistant
/// knots, f(v) = offset + sum_k r_k clamp((v - v_k) / h, 0, 1). If the fit is monotonic, the bounds of the ramps
/// enforce it.
std::optional<stability::EffectSpec> shape_of(const ScanSamples& samples, const ScanEntry& entry);

/// Returns the K-th best formula or shape for what the models of `passes` with `specs` leave. Returns nothing if the
/// scan finds too few.
/// @param name see is_proposal()
std::optional<stability::EffectSpec> proposal(const Passes& passes,
                                              const std::vector<stability::EffectSpec>& specs,
                                              const std::string& name);

/// Returns `effect` with zero coefficients, so that a fit starts from scratch: see candidate().
stability::EffectSpec switched_off(stability::EffectSpec effect);

}  // namespace swarmcert::identification
