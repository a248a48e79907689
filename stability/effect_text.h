/// @file An effect as it stands in a model file.
#pragma once

#include <string>

#include "stability/model.h"

namespace swarmcert::stability {

/// [[effect]] with everything that belongs to it; read_model() reads it back.
std::string to_toml(const EffectSpec& effect);

}  // namespace swarmcert::stability
