/// @file Effects that act on the thrust itself, before all other effects.
#pragma once

#include <string>

#include "stability/effects/registry.h"

namespace swarmcert::residuals {

/// Returns true for such an effect. The other effects of a model, including a scale of it, see the thrust after it.
inline bool is_thrust_stage(const std::string& effect) {
  return stability::traits_of(effect).place == stability::Place::kThrust;
}

}  // namespace swarmcert::residuals
