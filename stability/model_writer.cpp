#include <fmt/core.h>

#include "stability/effect_text.h"
#include "stability/model.h"

namespace swarmcert::stability {
namespace {

/// Returns the shortest text that reads back as the same double, with a point or an exponent, as TOML requires for
/// floats.
std::string number(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

/// Returns a TOML basic string.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      result += fmt::format("\\u{:04X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      result += c;
    }
  }
  return result + '"';
}

/// Returns a key, without quotes where TOML allows it.
std::string key(const std::string& name) {
  const bool bare = !name.empty() && name.find_first_not_of(
                                         "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                         "0123456789_-") == std::string::npos;
  return bare ? name : quoted(name);
}

template <typename Range, typename Text>
std::string joined(const Range& range, const Text& text) {
  std::string result;
  for (const auto& item : range) result += (result.empty() ? "" : ", ") + text(item);
  return result;
}

std::string interval_table(const std::map<std::string, Interval>& intervals) {
  return "{ " +
         joined(intervals,
                [](const auto& item) {
                  return key(item.first) + " = [" + number(item.second.lower) + ", " +
                         number(item.second.upper) + "]";
                }) +
         " }";
}

std::string expression_text(const EffectExpression& expression) {
  std::string text = "[effect.expression]\n";
  for (const auto& [target, formula] : expression.formulas)
    text += key(target) + " = " + quoted(formula) + "\n";
  text += "linear = [" + joined(expression.linear, quoted) + "]\n";
  if (!expression.bounds.empty()) text += "bounds = " + interval_table(expression.bounds) + "\n";
  if (!expression.grid.empty()) {
    text += "grid = { " +
            joined(expression.grid,
                   [](const auto& item) {
                     return key(item.first) + " = [" + joined(item.second, number) + "]";
                   }) +
            " }\n";
  }
  if (expression.per_neighbour) text += "per_neighbour = true\n";
  return text;
}

std::string fit_text(const FitProvenance& fit) {
  std::string text = "[effect.fit]\n";
  if (!fit.flights.empty()) text += "flights = [" + joined(fit.flights, quoted) + "]\n";
  if (!fit.interval.empty()) text += "interval = " + interval_table(fit.interval) + "\n";
  if (fit.select_rmse_before_N > 0)
    text += "select_rmse_before_N = " + number(fit.select_rmse_before_N) + "\n";
  if (fit.select_rmse_after_N > 0) text += "select_rmse_after_N = " + number(fit.select_rmse_after_N) + "\n";
  if (fit.test_looks > 0) text += fmt::format("test_looks = {}\n", fit.test_looks);
  if (!fit.note.empty()) text += "note = " + quoted(fit.note) + "\n";
  return text;
}

std::string effect_text(const EffectSpec& effect) {
  std::string text = "\n[[effect]]\nname = " + quoted(effect.name) + "\n";
  if (!effect.vehicle.empty()) text += "vehicle = " + quoted(effect.vehicle) + "\n";
  if (!effect.parameters.empty()) {
    text += "parameters = { " +
            joined(effect.parameters,
                   [](const auto& item) { return key(item.first) + " = " + number(item.second); }) +
            " }\n";
  }
  if (!effect.network.empty()) text += "network = " + quoted(effect.network) + "\n";
  if (effect.is_expression()) text += expression_text(effect.expression);
  if (!effect.fit.is_empty()) text += fit_text(effect.fit);
  return text;
}

std::string row_text(const LadderRow& row) {
  std::string text = "\n[[ladder]]\neffect = " + quoted(row.effect) + "\n";
  if (!row.accepted) text += "accepted = false\n";
  text += "fit_rmse_N = " + number(row.fit_rmse_N) + "\nselect_rmse_N = " + number(row.select_rmse_N) +
          "\ntest_rmse_N = " + number(row.test_rmse_N) + "\nnoise_floor_N = " + number(row.noise_floor_N) +
          fmt::format("\ntest_looks = {}\n", row.test_looks);
  if (row.measure) {
    const auto pair = [](const std::array<double, 2>& of) {
      return "[" + number(of[0]) + ", " + number(of[1]) + "]";
    };
    text += "measure = { quantity = " + quoted(row.measure->quantity) +
            ", unit = " + quoted(row.measure->unit) + ", select = " + pair(row.measure->select) +
            ", test = " + pair(row.measure->test) + " }\n";
  }
  if (!row.note.empty()) text += "note = " + quoted(row.note) + "\n";
  text += "values = { " +
          joined(row.values, [](const auto& item) { return key(item.first) + " = " + number(item.second); }) +
          " }\n";
  return text;
}

std::string rotors_text(const Model& model) {
  if (model.rotors.empty()) return "";
  std::string text = "rotors = [  # forward, left and up from the centre; spin seen from above\n";
  for (const RotorPlace& rotor : model.rotors) {
    text += "  { position_m = [" + number(rotor.x_m) + ", " + number(rotor.y_m) + ", " + number(rotor.z_m) +
            "], spin = " + (rotor.counterclockwise ? "\"ccw\"" : "\"cw\"") + " },\n";
  }
  return text + "]\n";
}

std::string thrust_text(const Model& model) {
  if (model.thrust_curve_N)
    return "\n[vehicle.thrust_curve]\nforce_N = [" + joined(*model.thrust_curve_N, number) + "]\n";
  const ThrustMap& map = model.thrust;
  return "\n[vehicle.thrust]\nc00 = " + number(map.c00) + "\nc10 = " + number(map.c10) +
         "\nc01 = " + number(map.c01) + "\nc20 = " + number(map.c20) + "\nc11 = " + number(map.c11) + "\n";
}

}  // namespace

std::string to_toml(const EffectSpec& effect) { return effect_text(effect).substr(1); }

std::string to_toml(const Model& model, const std::vector<std::string>& comments) {
  std::string text;
  for (const std::string& comment : comments) text += "# " + comment + "\n";
  text += "schema = \"swarmcert/model/1\"\n\n[vehicle]\n";
  text += "kind = " + quoted(model.kind) + "\n";
  text += "mass_kg = " + number(model.mass_kg) + "\n";
  text += "inertia_kg_m2 = [" + joined(model.inertia_kg_m2, number) + "]\n";
  if (model.rotors.empty()) text += "arm_m = " + number(model.arm_m) + "\n";
  text += "torque_per_thrust_m = " + number(model.torque_per_thrust_m) + "\n";
  if (model.battery_range_V != kOneCell_V) {
    text += "battery_range_V = [" + number(model.battery_range_V.lower) + ", " +
            number(model.battery_range_V.upper) + "]\n";
  }
  text += rotors_text(model) + thrust_text(model);
  const SensorModel& sensor = model.sensor;
  text += "\n[sensor]\n";
  text += "accelerometer_cutoff_hz = " + number(sensor.accelerometer_cutoff_hz) + "\n";
  text += "accelerometer_noise_m_s2 = " + number(sensor.accelerometer_noise_m_s2) + "\n";
  text += "position_noise_m = " + number(sensor.position_noise_m) + "\n";
  text += "velocity_noise_m_s = " + number(sensor.velocity_noise_m_s) + "\n";
  text += "attitude_noise_rad = " + number(sensor.attitude_noise_rad) + "\n";
  text += "log_rate_hz = " + number(sensor.log_rate_hz) + "\n";
  for (const EffectSpec& effect : model.effects) text += effect_text(effect);
  for (const LadderRow& row : model.ladder) text += row_text(row);
  return text;
}

}  // namespace swarmcert::stability
