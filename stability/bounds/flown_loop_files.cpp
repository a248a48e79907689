#include <fmt/core.h>

#include <utility>

#include "stability/bounds/flown_loop.h"
#include "stability/effects/registry.h"

namespace swarmcert::stability {

FlownLoop load_flown_loop(const std::string& gains, const std::string& model, double battery_V) {
  return flown_loop(load_gains(gains), read_model(model), battery_V);
}

FlownLoop flown_loop(Gains gains, Model model, double battery_V) {
  FlownLoop result = {std::move(gains), {}, std::move(model)};
  const Model& vehicle = result.model;
  result.plant.mass_kg = vehicle.mass_kg;
  result.plant.largest_thrust_N = vehicle.largest_thrust_N(battery_V);
  result.plant.least_thrust_N =
      static_cast<double>(vehicle.num_rotors()) * least_rotor_force_N(vehicle.thrust);
  for (const EffectSpec& effect : vehicle.effects) {
    if (effect.is_expression()) continue;
    const auto first = [&](bool shape) {
      const EffectValues values = effect_values(effect_info(effect.name), effect);
      return shape ? values.shape.at(0) : values.linear.at(0);
    };
    if (effect.name == "motor_lag" && result.gains.motor_lag_s == 0) {
      result.gains.motor_lag_s = first(true);
      result.notes.push_back(fmt::format("motor lag {} s of the model", result.gains.motor_lag_s));
    } else if (effect.name == "delay" && result.gains.delay_s == 0) {
      result.gains.delay_s = first(true);
      result.notes.push_back(fmt::format("delay {} s of the model", result.gains.delay_s));
    } else if (effect.name == "thrust_ratio") {
      result.plant.thrust_scale = 1 + first(false);
      result.notes.push_back(fmt::format("thrust scale {} of the model", result.plant.thrust_scale));
    }
  }
  return result;
}

}  // namespace swarmcert::stability
