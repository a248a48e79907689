/// @file The length of the string on which a load swings, from the resonance of the horizontal force.
#pragma once

#include <optional>

#include "analysis/identification/candidates.h"
#include "analysis/identification/refinement.h"

namespace swarmcert::identification {

/// The effect that this file searches.
inline constexpr char kPendulum[] = "pendulum";

/// The pendulum with the length and damping that suit best beside a scale of the thrust and a constant horizontal
/// force, with neighbouring shapes for a fit to move to.
/// @param beside effects that are known already
Candidate best_pendulum(const Passes& passes, const Coverage& covered,
                        const std::vector<stability::EffectSpec>& beside);

/// best_pendulum() if the flights show that a load swings: beside a scale of the thrust, which is what a fixed payload
/// looks like, it lowers the error of blocks left out as an effect must (Selection::is_acceptable()); it is damped so
/// little that it oscillates; and it has a tenth of the vehicle's mass, or its weight explains half of that scale.
std::optional<Candidate> visible_pendulum(const Passes& passes, const Coverage& covered,
                                          const std::vector<stability::EffectSpec>& beside);

}  // namespace swarmcert::identification
