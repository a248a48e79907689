/// @file Effects that stand in the path of the thrust, before everything that acts on it.
#pragma once

#include <string>

namespace swarmcert::residuals {

/// The thrust behind the effect is what the other effects of a model see, a `thrust_ratio` among them.
inline bool is_thrust_stage(const std::string& effect) { return effect == "delay" || effect == "motor_lag"; }

}  // namespace swarmcert::residuals
