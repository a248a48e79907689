/// @file Effects that give a torque and no force.
#pragma once

#include <algorithm>
#include <array>
#include <string>

namespace swarmcert::stability {

/// Effects whose columns are torques only: no force residual shows them.
inline constexpr std::array<const char*, 7> kTorqueEffects = {"com_offset",  "downwash_torque", "flow_torque",
                                                              "gyroscopic",  "rate_damping",    "torque_bias",
                                                              "torque_ratio"};

inline bool is_torque_effect(const std::string& name) {
  return std::find(kTorqueEffects.begin(), kTorqueEffects.end(), name) != kTorqueEffects.end();
}

}  // namespace swarmcert::stability
