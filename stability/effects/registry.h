/// @file Every effect by name.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// Names of the effects that this library knows, in the order of the documentation.
std::vector<std::string> effect_names();

/// Makes an effect for one vehicle's model.
using EffectMaker = std::function<std::unique_ptr<Effect>(const EffectSpec&, const EffectContext&)>;

/// Adds an effect of your own: model files may name it, the simulator flies it, and identification tries it as it
/// tries the others. Call it before models are read, from one thread.
/// @throws std::invalid_argument if the name is empty or taken, or if it has no coefficient or too many.
void register_effect(EffectInfo info, EffectMaker make);

/// What is known of an effect of the registry.
/// @throws std::invalid_argument if there is none of that name.
const EffectInfo& effect_info(const std::string& name);

/// The effect that `spec` names or, where it has formulas, defines.
/// @throws files::InputError if a network or a formula cannot be read; std::invalid_argument for an unknown name.
std::unique_ptr<Effect> make_effect(const EffectSpec& spec, const EffectContext& context);

/// Coefficients and theta of `spec`: its parameters where it names them, else the effect's defaults; in the order of
/// the effect's info.
struct EffectValues {
  std::vector<double> linear, shape;
};
EffectValues effect_values(const EffectInfo& info, const EffectSpec& spec);

}  // namespace swarmcert::stability
