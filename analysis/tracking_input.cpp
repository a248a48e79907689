#include "analysis/tracking_input.h"

#include <fmt/core.h>

#include "stability/effects/registry.h"

namespace swarmcert::analysis {

void declare_tracking(CLI::App& app, TrackingArguments& arguments) {
  app.add_option("--gains", arguments.gains, "gains.toml: position gains, loop rate, lags")->required();
  app.add_option("--model", arguments.model, "model.toml of the vehicle")->required();
  app.add_option("--battery", arguments.battery_V, "Battery voltage, for the largest thrust (default 4.2)")
      ->check(CLI::PositiveNumber);
}

Tracking load_tracking(const TrackingArguments& arguments) {
  Tracking result;
  result.gains = stability::load_gains(arguments.gains);
  result.model = stability::read_model(arguments.model);
  result.plant.mass_kg = result.model.mass_kg;
  result.plant.largest_thrust_N = 4 * result.model.thrust.largest_N(arguments.battery_V);
  for (const stability::EffectSpec& effect : result.model.effects) {
    if (effect.is_expression()) continue;
    const auto first = [&](bool shape) {
      const stability::EffectValues values = effect_values(stability::effect_info(effect.name), effect);
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

}  // namespace swarmcert::analysis
