/// @file Registry of all effects by name.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// Returns the names of the effects that this library knows, in the order of the documentation.
std::vector<std::string> effect_names();

/// Makes an effect for one vehicle's model.
using EffectMaker = std::function<std::unique_ptr<Effect>(const EffectSpec&, const EffectContext&)>;

struct EffectEntry {
  EffectInfo info;
  EffectMaker make;
};

/// Registers a user-defined effect: model files may name it, the simulator applies it, and identification tries it like
/// the built-in ones. Call this before models are read, from one thread.
/// @throws std::invalid_argument if the name is empty or taken, or if the effect has no coefficient or too many.
void register_effect(EffectInfo info, EffectMaker make);

/// Removes an effect from the registry and returns it, so that tests can look for what the library lacks, or register
/// the effect under another name. Call this when no model or reference from effect_info() is in use.
/// @throws std::invalid_argument if no effect has that name.
EffectEntry withdraw_effect(const std::string& name);

/// Returns the description of a registered effect.
/// @throws std::invalid_argument if no effect has that name.
const EffectInfo& effect_info(const std::string& name);

/// Returns the traits of a registered effect, and those of an ordinary force for any other name, such as a formula's.
const EffectTraits& traits_of(const std::string& name);

/// Returns the name of the first effect that is the plain form of `family`, or that `data` show.
/// @throws std::invalid_argument if there is none.
std::string plain_effect(Family family);
std::string effect_shown_by(ShownBy data);

/// Makes the effect that `spec` names or, if it has formulas, defines.
/// @throws files::InputError if a network or a formula cannot be read; std::invalid_argument for an unknown name.
std::unique_ptr<Effect> make_effect(const EffectSpec& spec, const EffectContext& context);

/// Returns the size of a unit for a vehicle. Precondition: its mass and arm are positive.
double size_of(Unit unit, const Model& model);

/// Returns size_of() in words: "weight times arm"; empty for kOwn.
std::string size_words(Unit unit);

/// Returns the description of a registered effect with bounds for this vehicle.
EffectInfo effect_info(const std::string& name, const Model& model);

/// Coefficients and theta of `spec` in the order of the effect's info: the parameters that `spec` names, and the
/// effect's defaults for the others.
struct EffectValues {
  std::vector<double> linear, shape;
};
EffectValues effect_values(const EffectInfo& info, const EffectSpec& spec);

/// Returns one parameter of `spec`, or the effect's default. Precondition: the effect has a parameter of this name.
double effect_value(const EffectSpec& spec, const std::string& name);

}  // namespace swarmcert::stability
