/// @file Effects in the format of model files.
#pragma once

#include <string>

#include "stability/model.h"

namespace swarmcert::stability {

/// Returns the [[effect]] table with all its parts; read_model() reads it back.
std::string to_toml(const EffectSpec& effect);

}  // namespace swarmcert::stability
