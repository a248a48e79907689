/// @file What `add formula` and `add shape` add: effects without a name in the registry, found by a scan of what is
/// left.
#pragma once

#include <optional>
#include <string>

#include "analysis/identification/scan/formulas.h"

namespace swarmcert::identification {

/// "formula", "formula:K" with K from 1, "shape" or "shape:K".
bool is_proposal(const std::string& name);

/// A curve for `entry`, where its variable is one that formulas can use: an offset and up to seven ramps between equal
/// knots, f(v) = offset + sum_k r_k clamp((v - v_k) / h, 0, 1). Where the fit rises or falls throughout, the bounds of
/// the ramps keep it so.
std::optional<stability::EffectSpec> shape_of(const ScanSamples& samples, const ScanEntry& entry);

/// The K-th formula or shape, best first, for what the models of `passes` leave beside `specs`. Nothing where the scan
/// finds too few.
/// @param name see is_proposal()
std::optional<stability::EffectSpec> proposal(const Passes& passes,
                                              const std::vector<stability::EffectSpec>& specs,
                                              const std::string& name);

/// `effect` with its coefficients at zero, so that a fit begins anew: see candidate().
stability::EffectSpec switched_off(stability::EffectSpec effect);

}  // namespace swarmcert::identification
