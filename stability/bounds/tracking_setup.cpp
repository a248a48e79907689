#include "stability/bounds/tracking_setup.h"

#include <fmt/core.h>

#include "stability/effects/registry.h"

namespace swarmcert::stability {

TrackingSetup load_tracking_setup(const std::string& gains, const std::string& model, double battery_V) {
  TrackingSetup result;
  result.gains = load_gains(gains);
  result.model = read_model(model);
  result.plant.mass_kg = result.model.mass_kg;
  result.plant.largest_thrust_N = result.model.largest_thrust_N(battery_V);
  for (const EffectSpec& effect : result.model.effects) {
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
