/// @file model.toml: the parameters of one kind of vehicle.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "controller/battery.h"
#include "controller/position_law.h"
#include "nn/base/interval.h"

namespace swarmcert::files {
class Keys;
}

namespace swarmcert::stability {

using controller::kGravity_m_s2;
/// One gram-force, the unit of the thrust map and of the published networks.
inline constexpr double kGramForce_N = controller::kNewtonPerGramForce;
/// The voltage of a full cell, to which the thrust maps of Crazyflies refer.
inline constexpr double kFullBattery_V = controller::kReferenceVoltage_V;
/// Voltages of one lithium-polymer cell: from empty under load to a full high-voltage cell plus measurement error.
inline constexpr Interval kOneCell_V = {2.5, 4.5};
/// Returns the voltage of a full pack of which `most_V` is the largest voltage: 4.2 V for each cell in series. Packs
/// that take off have more than those with a cell less can have.
double full_battery_V(double most_V);

/// Force of one rotor, by the thrust map used in flight. Outside the calibrated range the polynomial may decrease with
/// p.
struct ThrustMap : controller::ThrustMap<double> {
  /// Returns the force, never negative. @param pwm p = PWM / 65536, in [0, 1]
  double force_N(double pwm, double battery_V) const { return force_of_pwm(*this, pwm, battery_V); }
  /// Returns the p in [0, 1] that gives `force_N`; 0 or 1 if the force is outside the range.
  double pwm(double force_N, double battery_V) const { return pwm_of_force(*this, force_N, battery_V); }
  /// Returns the largest force of one rotor, in newton.
  double largest_N(double battery_V) const { return force_N(1, battery_V); }
};

/// One rotor, which pushes along the body z axis. Body axes: x forward, y left, z up.
struct RotorPlace {
  double x_m = 0, y_m = 0, z_m = 0;
  bool counterclockwise = true;  ///< seen from above; its reaction torque turns the body the other way

  /// Signed yaw torque per newton of thrust, for a rotor with the ratio `torque_per_thrust_m`.
  double yaw_m(double torque_per_thrust_m) const {
    return counterclockwise ? -torque_per_thrust_m : torque_per_thrust_m;
  }
};
inline constexpr std::size_t kFewestRotors = 3, kMostRotors = 8;

/// Sensor model of the logs. Defaults: the published flights (BMI088 accelerometer behind a two-pole low-pass of 30 Hz,
/// logged at about 100 Hz; positions from motion capture).
struct SensorModel {
  double accelerometer_cutoff_hz = 30;
  double accelerometer_noise_m_s2 = 0.12;  ///< standard deviation per logged sample, after the filter
  double position_noise_m = 2e-4;
  double velocity_noise_m_s = 5e-3;
  double attitude_noise_rad = 1e-3;
  double log_rate_hz = 100;
};

/// An effect written in the model file as expressions instead of C++; see effects/expression.h for the variables.
struct EffectExpression {
  std::map<std::string, std::string> formulas;  ///< "force_z_N" -> "a * T * exp(-z / b)"
  std::vector<std::string> linear;              ///< parameters in which the formulas are linear, e.g. {"a"}
  std::map<std::string, Interval> bounds;       ///< of any parameter
  std::map<std::string, std::vector<double>> grid;  ///< values that identification tries for the others
  bool per_neighbour = false;                       ///< evaluated for each neighbour and summed
};

/// The origin of an effect's numbers. Written by identification and preserved when models are rewritten.
struct FitProvenance {
  std::vector<std::string> flights;                          ///< used by the fit
  std::map<std::string, Interval> interval;                  ///< 90 % intervals, by parameter
  double select_rmse_before_N = 0, select_rmse_after_N = 0;  ///< on flights not used by the fit
  int test_looks = 0;  ///< number of times the test flights had been scored
  std::string note;

  bool is_empty() const { return flights.empty() && interval.empty() && note.empty() && test_looks == 0; }
};

/// One [[effect]] of a model file. Parameters that are not named take the effect's defaults.
struct EffectSpec {
  std::string name;
  std::string vehicle;  ///< "cf50": acts on this vehicle only; empty: on every vehicle of the kind
  std::map<std::string, double> parameters;
  std::string network;          ///< of `deep_set`: path as written, relative to the model's folder
  EffectExpression expression;  ///< of user-defined effects
  FitProvenance fit;

  bool is_expression() const { return !expression.formulas.empty(); }
  bool acts_on(const std::string& name_of_vehicle) const {
    return vehicle.empty() || vehicle == name_of_vehicle;
  }
};

/// One row of the ladder of errors that led to a model: an effect tried on top of the rows before it.
/// What decides about a step that leaves the force residual as it is.
struct LadderMeasure {
  std::string quantity, unit;  ///< "imbalance of the rotors", "N"
  /// Before the step and after it; `test` is zero if nothing is tested.
  std::array<double, 2> select = {0, 0}, test = {0, 0};
};

struct LadderRow {
  std::string effect;  ///< "nominal" for the first
  bool accepted = true;
  double fit_rmse_N = 0, select_rmse_N = 0, test_rmse_N = 0, noise_floor_N = 0;
  std::optional<LadderMeasure> measure;  ///< absent: the force residual decides
  int test_looks = 0;                    ///< number of times the test flights had been scored
  std::string note;                      ///< why it was rejected, or kept nevertheless
  /// Parameter values of every effect after this row, so that the row can be restored: "motor_lag.tau_s",
  /// "constant_force@cf50.force_x_N".
  std::map<std::string, double> values;
};

/// One kind of vehicle. Invariant after read_model(): all numbers finite, mass, inertia and arm positive, 3 to 8
/// rotors, every effect known and within its parameters' bounds.
struct Model {
  std::string path;    ///< as given by the user; empty if made in memory
  std::string sha256;  ///< of the file
  std::string kind;    ///< "small", "large", ...: selects phi and rho of a network
  double mass_kg = 0;
  std::array<double, 3> inertia_kg_m2 = {0, 0, 0};  ///< diagonal, body axes x forward, y left, z up
  double arm_m = 0;                                 ///< from the centre to the rotors; their mean distance
  double torque_per_thrust_m = 0;                   ///< yaw torque of a rotor per newton of its thrust
  Interval battery_range_V = kOneCell_V;            ///< possible battery voltages of the vehicle
  ThrustMap thrust{};
  /// Force of one rotor at command u in [0, 1], independent of the voltage: a + b u + c u^2, in newton. If a file
  /// states it, `thrust` is the same polynomial in gram-force.
  std::optional<std::array<double, 3>> thrust_curve_N;
  /// In the order of the motors in logs. Empty: four rotors in X at `arm_m`, in the motor order of a Crazyflie.
  std::vector<RotorPlace> rotors;
  SensorModel sensor;
  std::vector<EffectSpec> effects;
  std::vector<LadderRow> ladder;  ///< empty if the effects were not fitted step by step

  double weight_N() const { return mass_kg * kGravity_m_s2; }
  std::size_t num_rotors() const { return rotors.empty() ? 4 : rotors.size(); }
  /// Voltage of the full pack, from the stated range.
  double full_battery_V() const { return stability::full_battery_V(battery_range_V.upper); }
  /// Thrust of all rotors together.
  double largest_thrust_N(double battery_V) const {
    return static_cast<double>(num_rotors()) * thrust.largest_N(battery_V);
  }
};

/// Returns the positions of the rotors: Model::rotors or, if that is empty, four in X: front right, back right, back
/// left, front left.
std::vector<RotorPlace> rotor_places(const Model& model);

/// Sets `thrust_curve_N` and the equivalent `thrust`.
void set_thrust_curve(const std::array<double, 3>& curve_N, Model& model);

/// @throws files::InputError unless the vehicle has four rotors in X, which `what` requires.
void refuse_other_rotors(const Model& model, const std::string& what);

/// Describes a model file.
void describe_model_file(files::Keys& keys);

/// Reads a model file.
/// @throws files::InputError with line, key, value and hint; for unknown keys, effects and parameters the hint suggests
///     similar names.
Model read_model(const std::string& path);

/// Returns why the vehicle cannot be at `battery_V`, with the range and the probable unit; empty if it can.
std::string battery_problem(const Model& model, double battery_V);

/// Like read_model(), but parses `text`; `path` gives the folder for networks, and the name in messages.
Model parse_model(const std::string& text, const std::string& path);

/// Returns a file that reads back as `model`, with numbers in the shortest form that gives the same double.
/// @param comments lines for the head of the file, without '#'.
std::string to_toml(const Model& model, const std::vector<std::string>& comments = {});

}  // namespace swarmcert::stability
