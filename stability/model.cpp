#include "stability/model.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nn/base/file_io.h"
#include "nn/base/file_keys.h"
#include "nn/base/input_error.h"
#include "nn/base/rotor_speed.h"
#include "nn/base/suggest.h"
#include "nn/base/toml.h"
#include "stability/effects/registry.h"
#include "stability/vehicle_units.h"

namespace swarmcert::stability {
namespace {

using files::TomlTable;

constexpr char kSchema[] = "swarmcert/model/1";

const std::vector<std::string> kSpins = {"ccw", "cw"};

void describe_rotor(files::Keys& keys) {
  keys.must<std::array<double, 3>>("position_m", "Forward, left and up from the centre.", "m");
  keys.must("spin", "Seen from above.", "", files::OneOf{kSpins});
}

void describe_thrust(files::Keys& keys) {
  for (const char* const name : {"c00", "c10", "c01", "c20", "c11"})
    keys.must<double>(name, "Coefficient.", "gf");
}

void describe_thrust_curve(files::Keys& keys) {
  keys.may<std::array<double, 3>>("force_N", "[a, b, c]: a + b u + c u^2 at command u in 0 .. 1.", "N");
  keys.may<std::array<double, 3>>("force_of_speed", "[a, b, c]: a + b W + c W^2 at W rad/s.", "N");
}

void describe_vehicle(files::Keys& keys) {
  keys.must<std::string>("kind", "Which networks and flights it has: small, large, ...");
  keys.must<double>("mass_kg", "", "kg");
  keys.must<std::array<double, 3>>("inertia_kg_m2", "Jxx, Jyy, Jzz of the body.", "kg m^2");
  keys.may<double>("arm_m", "From the centre to each of four rotors in X.", "m");
  keys.may_tables("rotors", "In place of arm_m: 3 to 8, in the order of the motors in logs.", describe_rotor);
  keys.must<double>("torque_per_thrust_m", "Yaw torque of a rotor per newton of its thrust.", "m");
  keys.may_table("thrust",
                 "Gram-force of one rotor: c00 + c10 p + c01 v + c20 p^2 + c11 p v, p = PWM / 65536, v = V / "
                 "4.2.",
                 describe_thrust);
  keys.may_table("thrust_curve", "In place of thrust: force of one rotor.", describe_thrust_curve);
  keys.may<Interval>("battery_range_V", "Voltages that the battery may have; absent: one cell.", "V");
}

void describe_sensor(files::Keys& keys) {
  keys.may<double>("accelerometer_cutoff_hz", "Of the filter.", "Hz");
  keys.may<double>("accelerometer_noise_m_s2", "Standard deviation per sample.", "m/s^2");
  keys.may<double>("position_noise_m", "Likewise.", "m");
  keys.may<double>("velocity_noise_m_s", "Likewise.", "m/s");
  keys.may<double>("attitude_noise_rad", "Likewise.", "rad");
  keys.may<double>("log_rate_hz", "", "Hz");
}

void describe_fit(files::Keys& keys) {
  keys.may<std::vector<std::string>>("flights", "That were used.");
  keys.may<std::map<std::string, Interval>>("interval", "90 %, by parameter.");
  keys.may<double>("select_rmse_before_N", "On flights that were not used.", "N");
  keys.may<double>("select_rmse_after_N", "Likewise, with the effect.", "N");
  keys.may<int>("test_looks", "How often the test flights had been scored.");
  keys.may<std::string>("note", "");
}

void describe_effect_of_file(files::Keys& keys) {
  using Entry =
      std::variant<std::string, bool, std::vector<std::string>, std::map<std::string, std::vector<double>>>;
  keys.must<std::string>("name", "Of the effect.");
  keys.may<std::string>("vehicle", "Only of this vehicle.");
  keys.may<std::map<std::string, double>>("parameters", "Units stand in the names.");
  keys.may<std::string>("network", "network.toml of the effect deep_set.");
  keys.may<std::map<std::string, Entry>>(
      "expression",
      "A user-defined effect: formulas by target, such as force_z_N; linear: parameters in which they are "
      "linear; per_neighbour: whether they are summed over neighbours; bounds and grid: by parameter.");
  keys.may_table("fit", "Where the values come from.", describe_fit);
}

void describe_measure_of_file(files::Keys& keys) {
  keys.must<std::string>("quantity", "");
  keys.must<std::string>("unit", "");
  keys.must<std::array<double, 2>>("select", "Before the step and after it, on the selecting flights.");
  keys.must<std::array<double, 2>>("test", "On the test flights; zeros: not tested.");
}

void describe_row_of_file(files::Keys& keys) {
  keys.must<std::string>("effect", "That was tried; nominal for the first.");
  keys.may<bool>("accepted", "");
  keys.may<double>("fit_rmse_N", "On the flights of the fit.", "N");
  keys.may<double>("select_rmse_N", "On the selecting flights.", "N");
  keys.may<double>("test_rmse_N", "On the test flights.", "N");
  keys.may<double>("noise_floor_N", "", "N");
  keys.may_table("measure", "What decided, if not the force residual.", describe_measure_of_file);
  keys.may<int>("test_looks", "How often the test flights had been scored.");
  keys.may<std::string>("note", "Why it was rejected, or kept nevertheless.");
  keys.may<std::map<std::string, double>>("values", "Of all parameters after this step.");
}

double positive(const TomlTable& table, const std::string& key) {
  const double value = table.number(key);
  if (!(value > 0)) table.refuse(key, std::to_string(value), "must be positive");
  return value;
}

/// Reads the rate of a sensor. No sensor of a multirotor exceeds 100 kHz.
double rate_hz(const TomlTable& table, const std::string& key) {
  constexpr double kHighest_hz = 1e5;
  const double value = positive(table, key);
  if (value > kHighest_hz) {
    table.refuse(key, fmt::format("{:g}", value), fmt::format("is above {:g} Hz", kHighest_hz),
                 "the value is in hertz: write 100 for 100 Hz");
  }
  return value;
}

double not_negative(const TomlTable& table, const std::string& key, double otherwise) {
  if (!table.has(key)) return otherwise;
  const double value = table.number(key);
  if (value < 0) table.refuse(key, std::to_string(value), "must not be negative");
  return value;
}

Interval interval(const TomlTable& table, const std::string& key) {
  const std::vector<double> numbers = table.numbers(key);
  if (numbers.size() != 2 || numbers[0] > numbers[1]) {
    table.refuse(key, "", "must be [lower, upper]");
  }
  return {numbers[0], numbers[1]};
}

/// Returns the battery range in the file, or else that of one cell.
Interval battery_range(const TomlTable& vehicle) {
  constexpr double kHighest_V = 1000;
  if (!vehicle.has("battery_range_V")) return kOneCell_V;
  const Interval range = interval(vehicle, "battery_range_V");
  if (!(range.lower > 0))
    vehicle.refuse("battery_range_V", fmt::format("{:g}", range.lower), "must be positive");
  if (range.upper > kHighest_V) {
    vehicle.refuse("battery_range_V", fmt::format("{:g}", range.upper),
                   fmt::format("is above {:g} V; millivolts were probably meant", kHighest_V),
                   fmt::format("the value is in V: {:g} mV is {:g}", range.upper, range.upper / 1000));
  }
  return range;
}

RotorPlace read_rotor(const TomlTable& table) {
  table.allow_only(files::key_names(describe_rotor));
  const std::vector<double> position = table.numbers("position_m");
  if (position.size() != 3)
    table.refuse("position_m", "", "must be three numbers, [x, y, z]: forward, left and up from the centre");
  return {position[0], position[1], position[2], table.choice("spin", kSpins) == 0};
}

/// Reads rotors and computes arm_m from them; without rotors, reads arm_m of four in X.
void read_rotors(const TomlTable& vehicle, Model* model) {
  if (!vehicle.has("rotors")) {
    model->arm_m = positive(vehicle, "arm_m");
    return;
  }
  if (vehicle.has("arm_m"))
    vehicle.refuse("arm_m", "", "cannot be combined with rotors, which already give the positions",
                   "omit one of the two");
  for (const TomlTable& rotor : vehicle.tables("rotors")) model->rotors.push_back(read_rotor(rotor));
  const std::size_t count = model->rotors.size();
  if (count < kFewestRotors || count > kMostRotors) {
    vehicle.refuse("rotors", fmt::format("{} rotors", count),
                   fmt::format("must be {} to {} rotors", kFewestRotors, kMostRotors));
  }
  // Rotors on one line through the centre of mass cannot control the attitude.
  double xx = 0, xy = 0, yy = 0;
  for (const RotorPlace& rotor : model->rotors) {
    model->arm_m += std::hypot(rotor.x_m, rotor.y_m) / static_cast<double>(count);
    xx += rotor.x_m * rotor.x_m;
    xy += rotor.x_m * rotor.y_m;
    yy += rotor.y_m * rotor.y_m;
  }
  if (!(xx * yy - xy * xy > 1e-6 * xx * yy))
    vehicle.refuse("rotors", "", "lie on one line: roll and pitch cannot both be controlled");
}

/// Reads the load cell's polynomial or, for other vehicles, the thrust curve in newton.
void read_thrust(const TomlTable& vehicle, Model* model) {
  if (!vehicle.has("thrust_curve")) {
    const TomlTable thrust = vehicle.table("thrust");
    thrust.allow_only(files::key_names(describe_thrust));
    model->thrust = {thrust.number("c00"), thrust.number("c10"), thrust.number("c01"), thrust.number("c20"),
                     thrust.number("c11")};
    return;
  }
  if (vehicle.has("thrust"))
    vehicle.refuse("thrust", "", "cannot be combined with thrust_curve, which replaces it",
                   "omit one of the two");
  const TomlTable curve = vehicle.table("thrust_curve");
  curve.allow_only(files::key_names(describe_thrust_curve));
  const bool of_speed = curve.has("force_of_speed");
  if (of_speed && curve.has("force_N"))
    curve.refuse("force_of_speed", "", "cannot be combined with force_N", "omit one of the two");
  const std::string name = of_speed ? "force_of_speed" : "force_N";
  std::vector<double> force_N = curve.numbers(name);
  if (force_N.size() != 3)
    curve.refuse(name, "",
                 of_speed ? "must be [a, b, c]: a rotor gives a + b W + c W^2 newton at W rad/s"
                          : "must be [a, b, c]: a rotor gives a + b u + c u^2 newton at command u in 0 .. 1");
  if (of_speed) {
    force_N[1] *= kFullRotorSpeed_rad_s;
    force_N[2] *= kFullRotorSpeed_rad_s * kFullRotorSpeed_rad_s;
  }
  if (!(force_N[1] >= 0) || !(force_N[1] + 2 * force_N[2] >= 0) || !(force_N[1] + force_N[2] > 0))
    curve.refuse(name, "",
                 of_speed ? "does not increase with the speed in 0 .. 3000 rad/s"
                          : "does not increase with the command in 0 .. 1");
  set_thrust_curve({force_N[0], force_N[1], force_N[2]}, *model);
}

void read_vehicle(const TomlTable& vehicle, Model* model) {
  vehicle.allow_only(files::key_names(describe_vehicle));
  model->kind = vehicle.text("kind");
  if (model->kind.empty()) vehicle.refuse("kind", "", "is empty", "name it, e.g. \"small\"");
  model->mass_kg = positive(vehicle, "mass_kg");
  const std::vector<double> inertia = vehicle.numbers("inertia_kg_m2");
  if (inertia.size() != 3 || *std::min_element(inertia.begin(), inertia.end()) <= 0) {
    vehicle.refuse("inertia_kg_m2", "", "must be three positive numbers, [Jxx, Jyy, Jzz]");
  }
  std::copy(inertia.begin(), inertia.end(), model->inertia_kg_m2.begin());
  read_rotors(vehicle, model);
  model->torque_per_thrust_m = positive(vehicle, "torque_per_thrust_m");
  model->battery_range_V = battery_range(vehicle);
  read_thrust(vehicle, model);
  check_vehicle_units(vehicle, *model);
}

void read_sensor(const TomlTable& sensor, SensorModel* model) {
  sensor.allow_only(files::key_names(describe_sensor));
  if (sensor.has("accelerometer_cutoff_hz")) {
    model->accelerometer_cutoff_hz = rate_hz(sensor, "accelerometer_cutoff_hz");
  }
  if (sensor.has("log_rate_hz")) model->log_rate_hz = rate_hz(sensor, "log_rate_hz");
  model->accelerometer_noise_m_s2 =
      not_negative(sensor, "accelerometer_noise_m_s2", model->accelerometer_noise_m_s2);
  model->position_noise_m = not_negative(sensor, "position_noise_m", model->position_noise_m);
  model->velocity_noise_m_s = not_negative(sensor, "velocity_noise_m_s", model->velocity_noise_m_s);
  model->attitude_noise_rad = not_negative(sensor, "attitude_noise_rad", model->attitude_noise_rad);
}

EffectExpression read_expression(const TomlTable& table) {
  EffectExpression expression;
  for (const std::string& key : table.keys()) {
    if (key == "linear") {
      expression.linear = table.texts(key);
    } else if (key == "per_neighbour") {
      expression.per_neighbour = table.flag(key);
    } else if (key == "bounds") {
      const TomlTable bounds = table.table(key);
      for (const std::string& name : bounds.keys()) expression.bounds[name] = interval(bounds, name);
    } else if (key == "grid") {
      const TomlTable grid = table.table(key);
      for (const std::string& name : grid.keys()) expression.grid[name] = grid.numbers(name);
    } else {
      expression.formulas[key] = table.text(key);
    }
  }
  if (expression.formulas.empty()) {
    table.refuse("", "", "contains no formula", "add e.g. force_z_N = \"a * T\"");
  }
  return expression;
}

FitProvenance read_fit(const TomlTable& table) {
  table.allow_only(files::key_names(describe_fit));
  FitProvenance fit;
  if (table.has("flights")) fit.flights = table.texts("flights");
  if (table.has("interval")) {
    const TomlTable intervals = table.table("interval");
    for (const std::string& name : intervals.keys()) fit.interval[name] = interval(intervals, name);
  }
  fit.select_rmse_before_N = not_negative(table, "select_rmse_before_N", 0);
  fit.select_rmse_after_N = not_negative(table, "select_rmse_after_N", 0);
  fit.test_looks = static_cast<int>(std::min(not_negative(table, "test_looks", 0), 1e6));
  if (table.has("note")) fit.note = table.text("note");
  return fit;
}

/// Checks names and bounds of the parameters that `spec` states.
void check_parameters(const TomlTable& effect, const EffectSpec& spec, const EffectInfo& info) {
  if (!effect.has("parameters")) return;
  const TomlTable table = effect.table("parameters");
  std::vector<std::string> known;
  for (const std::vector<Parameter>* parameters : {&info.linear, &info.shape}) {
    for (const Parameter& parameter : *parameters) {
      known.push_back(parameter.name);
      const auto stated = spec.parameters.find(parameter.name);
      if (stated == spec.parameters.end()) continue;
      if (stated->second < parameter.lower || stated->second > parameter.upper) {
        table.refuse(
            parameter.name, std::to_string(stated->second),
            "must lie in [" + std::to_string(parameter.lower) + ", " + std::to_string(parameter.upper) + "]");
      }
    }
  }
  table.allow_only(known);
}

EffectSpec read_effect(const TomlTable& effect, const Model& model) {
  effect.allow_only(files::key_names(describe_effect_of_file));
  EffectSpec spec;
  spec.name = effect.text("name");
  if (effect.has("vehicle")) spec.vehicle = effect.text("vehicle");
  if (effect.has("parameters")) {
    const TomlTable parameters = effect.table("parameters");
    for (const std::string& key : parameters.keys()) spec.parameters[key] = parameters.number(key);
  }
  if (effect.has("network")) spec.network = effect.text("network");
  if (effect.has("fit")) spec.fit = read_fit(effect.table("fit"));
  const std::vector<std::string> names = effect_names();
  const bool is_known = std::find(names.begin(), names.end(), spec.name) != names.end();
  if (effect.has("expression")) {
    if (is_known || spec.name.empty()) {
      effect.refuse("name", files::in_quotes(spec.name), "cannot name a user-defined effect",
                    "choose another name");
    }
    spec.expression = read_expression(effect.table("expression"));
    check_parameters(effect, spec, make_effect(spec, {"", {}, model.path})->info());
    return spec;
  }
  if (!is_known) {
    effect.refuse("name", files::in_quotes(spec.name), "is not a known effect",
                  files::did_you_mean(spec.name, names) + ", or add [effect.expression]");
  }
  if (!spec.network.empty() && spec.name != "deep_set") {
    effect.refuse("network", files::in_quotes(spec.network), "is allowed only for the effect deep_set");
  }
  const EffectInfo info = effect_info(spec.name, model);
  if (info.remembers && !spec.vehicle.empty()) {
    effect.refuse("vehicle", files::in_quotes(spec.vehicle), "cannot have its own lag or delay",
                  "give it its own model in flights.toml");
  }
  check_parameters(effect, spec, info);
  return spec;
}

LadderMeasure read_measure(const TomlTable& table) {
  table.allow_only(files::key_names(describe_measure_of_file));
  const auto pair = [&table](const char* key) {
    const std::vector<double> numbers = table.numbers(key);
    if (numbers.size() != 2) table.refuse(key, std::to_string(numbers.size()) + " numbers", "must be two");
    return std::array<double, 2>{numbers[0], numbers[1]};
  };
  return {table.text("quantity"), table.text("unit"), pair("select"), pair("test")};
}

LadderRow read_row(const TomlTable& table) {
  table.allow_only(files::key_names(describe_row_of_file));
  LadderRow row;
  row.effect = table.text("effect");
  if (table.has("accepted")) row.accepted = table.flag("accepted");
  row.fit_rmse_N = not_negative(table, "fit_rmse_N", 0);
  row.select_rmse_N = not_negative(table, "select_rmse_N", 0);
  row.test_rmse_N = not_negative(table, "test_rmse_N", 0);
  row.noise_floor_N = not_negative(table, "noise_floor_N", 0);
  if (table.has("measure")) row.measure = read_measure(table.table("measure"));
  row.test_looks = static_cast<int>(std::min(not_negative(table, "test_looks", 0), 1e6));
  if (table.has("note")) row.note = table.text("note");
  if (table.has("values")) {
    const TomlTable values = table.table("values");
    for (const std::string& key : values.keys()) row.values[key] = values.number(key);
  }
  return row;
}

}  // namespace

void describe_model_file(files::Keys& keys) {
  keys.schema(kSchema);
  keys.must_table("vehicle", "Mass, inertia, rotors and thrust map.", describe_vehicle);
  keys.may_table("sensor", "Noise and rate of the log that simulations write.", describe_sensor);
  keys.may_tables("effect", "Physical effects, each with its parameters.", describe_effect_of_file);
  keys.may_tables("ladder", "Steps by which effects were added.", describe_row_of_file);
}

Model parse_model(const std::string& text, const std::string& path) {
  const toml::table document = files::parse_toml(text, path);
  const TomlTable top(document, path);
  top.require_schema(kSchema);
  top.allow_only(files::key_names(describe_model_file));
  Model model;
  model.path = path;
  model.sha256 = files::sha256(text);
  read_vehicle(top.table("vehicle"), &model);
  if (top.has("sensor")) read_sensor(top.table("sensor"), &model.sensor);
  if (top.has("ladder")) {
    for (const TomlTable& row : top.tables("ladder")) model.ladder.push_back(read_row(row));
  }
  if (!top.has("effect")) return model;
  for (const TomlTable& effect : top.tables("effect")) {
    EffectSpec spec = read_effect(effect, model);
    for (const EffectSpec& other : model.effects) {
      if (other.name == spec.name && other.vehicle == spec.vehicle) {
        effect.refuse("name", files::in_quotes(spec.name), "appears twice", "keep one of the two");
      }
    }
    model.effects.push_back(std::move(spec));
  }
  return model;
}

std::vector<RotorPlace> rotor_places(const Model& model) {
  if (!model.rotors.empty()) return model.rotors;
  const double d = model.arm_m * std::sqrt(0.5);
  return {{d, -d, 0, true}, {-d, -d, 0, false}, {-d, d, 0, true}, {d, d, 0, false}};
}

void set_thrust_curve(const std::array<double, 3>& curve_N, Model& model) {
  model.thrust_curve_N = curve_N;
  model.thrust = {};
  model.thrust.c00 = curve_N[0] / kGramForce_N;
  model.thrust.c10 = curve_N[1] / kGramForce_N;
  model.thrust.c20 = curve_N[2] / kGramForce_N;
}

void refuse_other_rotors(const Model& model, const std::string& what) {
  if (model.rotors.empty()) return;
  throw files::InputError({model.path.empty() ? model.kind : model.path, "", "vehicle.rotors",
                           fmt::format("{} rotors", model.rotors.size()), what + " needs four rotors in X",
                           "give arm_m instead of rotors if it has four rotors in X"});
}

double full_battery_V(double most_V) {
  return kFullBattery_V * std::max(std::ceil(most_V / kOneCell_V.upper), 1.0);
}

std::string battery_problem(const Model& model, double battery_V) {
  const auto& [lower_V, upper_V] = model.battery_range_V;
  if (battery_V >= lower_V && battery_V <= upper_V) return "";
  std::string problem =
      fmt::format("{:g} V lies outside the battery range of {}, {:g} .. {:g} V{}", battery_V,
                  model.path.empty() ? "the model" : model.path, lower_V, upper_V,
                  model.battery_range_V == kOneCell_V ? " (one cell, the default of battery_range_V)" : "");
  if (battery_V / 1000 >= lower_V && battery_V / 1000 <= upper_V)
    problem += fmt::format("; the value is in V: {:g} mV is {:g}", battery_V, battery_V / 1000);
  return problem;
}

Model read_model(const std::string& path) { return parse_model(files::read_file(path), path); }

}  // namespace swarmcert::stability
