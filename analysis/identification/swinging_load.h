/// @file Length of the string of a swinging load, from the resonance of the horizontal force.
#pragma once

#include <optional>

#include "analysis/identification/candidates.h"
#include "analysis/identification/refinement.h"

namespace swarmcert::identification {

/// Returns whether an effect is fitted here.
bool swings(const std::string& effect);

/// Returns the pendulum with the best length and damping beside a thrust scale and a constant horizontal force, with
/// neighbouring shapes for the fit.
/// @param beside effects that are already known
Candidate best_pendulum(const Passes& passes, const Coverage& covered,
                        const std::vector<stability::EffectSpec>& beside);

/// Returns best_pendulum() if the flights show a swinging load: beside a thrust scale, which is what a rigid payload
/// looks like, it reduces the error of held-out blocks as required of an effect (Selection::is_acceptable()); its
/// damping is low enough to oscillate; and it has at least a tenth of the vehicle's mass, or its weight explains half
/// of that scale.
std::optional<Candidate> visible_pendulum(const Passes& passes, const Coverage& covered,
                                          const std::vector<stability::EffectSpec>& beside);

}  // namespace swarmcert::identification
