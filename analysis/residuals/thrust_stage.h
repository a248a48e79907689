/// @file Effects that act on the thrust itself, before all other effects.
#pragma once

#include <string>

namespace swarmcert::residuals {

/// Returns true for such an effect. The other effects of a model, including `thrust_ratio`, see the thrust after it.
inline bool is_thrust_stage(const std::string& effect) { return effect == "delay" || effect == "motor_lag"; }

}  // namespace swarmcert::residuals
