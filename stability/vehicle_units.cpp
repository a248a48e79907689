#include "stability/vehicle_units.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace swarmcert::stability {
namespace {

/// Largest distance from the centre to a rotor that is plausible in metres.
constexpr double kLongestArm_m = 5;
/// Largest ratio of thrust to weight; racing multirotors reach about 15.
constexpr double kLargestThrustToWeight = 30;

double largest_J(const Model& model) {
  return *std::max_element(model.inertia_kg_m2.begin(), model.inertia_kg_m2.end());
}

/// Radius of gyration over the arm: 0.6 for the Crazyflie 2.1, never far from 1 if rotors and body are one craft.
double gyration_to_arm(const Model& model, double mass_kg) {
  return std::sqrt(largest_J(model) / mass_kg) / model.arm_m;
}

bool fits_arm(double gyration_to_arm) { return gyration_to_arm > 0.05 && gyration_to_arm < 10; }

/// If the rotors cannot lift the vehicle, rejects the mass if it is plausible in gram, else the thrust map.
void check_lift(const files::TomlTable& vehicle, const Model& model) {
  const double lift_N = model.largest_thrust_N(model.full_battery_V());
  const std::string rotors = fmt::format("{} rotors", model.num_rotors());
  const double mass_kg = model.mass_kg;
  const std::string mass = fmt::format("{:g}", mass_kg);
  if (lift_N > kLargestThrustToWeight * model.weight_N()) {
    vehicle.refuse("mass_kg", mass,
                   fmt::format("weighs {:.3g} N, but {} give {:.3g} N, {:.3g} times as much",
                               model.weight_N(), rotors, lift_N, lift_N / model.weight_N()),
                   fmt::format("mass is in kg and {}: correct the wrong one",
                               model.thrust_curve_N ? "thrust_curve.force_N in newton"
                                                    : "the thrust polynomial in gram-force"));
  }
  if (lift_N > model.weight_N()) return;
  const bool lifts_gram = lift_N > model.weight_N() / 1000;
  if (lifts_gram && !fits_arm(gyration_to_arm(model, mass_kg)) &&
      fits_arm(gyration_to_arm(model, mass_kg / 1000))) {
    vehicle.refuse("mass_kg", mass,
                   fmt::format("weighs {:.4g} N, but {} lift {:.3g} N; grams were probably meant",
                               model.weight_N(), rotors, lift_N),
                   fmt::format("mass is in kg: {:g} g is {:g}", mass_kg, mass_kg / 1000));
  }
  if (model.thrust_curve_N) {
    vehicle.refuse("thrust_curve", "",
                   fmt::format("{} give {:.4g} N at full command, but the vehicle weighs {:.4g} N", rotors,
                               lift_N, model.weight_N()),
                   "force_N is the force of one rotor, in newton, for a command of 0 .. 1");
  }
  vehicle.refuse(
      "thrust", "",
      fmt::format("{} give {:.4g} N at {:.4g} V, but the vehicle weighs {:.4g} N", rotors, lift_N,
                  model.full_battery_V(), model.weight_N()),
      "the polynomial is in gram-force (not newton) of p = PWM / 65536 (not percent or counts) and "
      "v = V / 4.2");
}

void check_arm(const files::TomlTable& vehicle, const Model& model) {
  if (model.arm_m <= kLongestArm_m) return;
  vehicle.refuse(
      model.rotors.empty() ? "arm_m" : "rotors", fmt::format("{:g}", model.arm_m),
      fmt::format("means that the rotors are at {:g} m from the centre; millimetres were probably meant",
                  model.arm_m),
      fmt::format("the value is in m, from the centre to a rotor: {:g} mm is {:g}", model.arm_m,
                  model.arm_m / 1000));
}

void check_inertia(const files::TomlTable& vehicle, const Model& model) {
  std::array<double, 3> J = model.inertia_kg_m2;
  std::sort(J.begin(), J.end());
  const auto refuse = [&vehicle](double value, const std::string& problem) {
    vehicle.refuse("inertia_kg_m2", fmt::format("{:g}", value), problem,
                   "inertia is in kg m^2 and arm_m, from the centre to a rotor, in m: 1 g cm^2 is 1e-7");
  };
  // The largest moment of a rigid body is at most the sum of the other two; measured ones may exceed it by their
  // errors.
  if (J[2] > 2 * (J[0] + J[1])) refuse(J[2], "is more than twice the sum of the other two");
  if (fits_arm(gyration_to_arm(model, model.mass_kg))) return;
  refuse(J[2], fmt::format("means that the mass lies {:.3g} m from the axis, but the rotors are at {:g} m",
                           std::sqrt(J[2] / model.mass_kg), model.arm_m));
}

void check_torque(const files::TomlTable& vehicle, const Model& model) {
  if (model.torque_per_thrust_m <= model.arm_m) return;
  vehicle.refuse(
      "torque_per_thrust_m", fmt::format("{:g}", model.torque_per_thrust_m),
      fmt::format("is more than arm_m, {:g} m: the yaw torque of rotors is smaller than their roll and pitch "
                  "torques",
                  model.arm_m),
      "this is the torque in N m per newton of thrust");
}

}  // namespace

void check_vehicle_units(const files::TomlTable& vehicle, const Model& model) {
  check_arm(vehicle, model);
  check_lift(vehicle, model);
  check_inertia(vehicle, model);
  check_torque(vehicle, model);
}

}  // namespace swarmcert::stability
