/// @file What there is to know about an effect besides its equation, for those who look for missing effects.
///
/// Identification knows effects by these properties alone, never by name: a twin under another name is judged alike.
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace swarmcert::stability {

/// Effects of one family are forms of the same thing, and explain each other's flights in part.
enum class Family {
  kNone,
  kPush,         ///< a force that is constant in the world
  kThrustScale,  ///< a fraction of the thrust
  kLate,         ///< thrust or records that come late
  kDrag,         ///< a force against the velocity
  kWake,         ///< a force below a neighbour
  kTorque,       ///< a torque that is constant in the body
  kLever         ///< a torque in proportion to the thrust
};

/// The data by which an effect is found and fitted.
enum class ShownBy {
  kForce,          ///< the force in flight
  kCurve,          ///< likewise, where a scan finds a curve from which its shape starts: Effect::start_at()
  kSwing,          ///< likewise, where the horizontal force has a resonance
  kTorques,        ///< mean torques of the rotors
  kRotors,         ///< loads of the rotors in slow flight
  kTurning,        ///< predictions of the attitude
  kAccelerometer,  ///< accelerometer against velocity
  kNothing         ///< written into the model file by hand
};

/// Where an effect acts.
enum class Place {
  kVehicle,
  kThrust,  ///< on the thrust itself: all other effects see the thrust after it
  kLog      ///< on the log, not on the vehicle
};

/// When an effect counts only if setpoints confirm it. Thrust reacts to every disturbance, and what multiplies the
/// thrust or its history imitates such a reaction.
enum class SetPoints { kNotNeeded, kBesideRemainder, kAlways };

/// Variables over which every drag, and every loss of high thrust, is a curve.
inline std::vector<std::string> velocity_variables() { return {"vx", "vy", "vz", "speed", "airspeed"}; }
inline std::vector<std::string> thrust_variables() {
  return {"thrust", "duty_1", "duty_2", "duty_3", "duty_4"};
}

struct EffectTraits {
  Family family = Family::kNone;
  /// The family whose plain member this effect becomes if the quantity that it varies with is constant. Members of a
  /// family that become nothing else are plain.
  Family reduces_to = Family::kNone;
  ShownBy shown_by = ShownBy::kForce;
  SetPoints set_points = SetPoints::kNotNeeded;
  /// Variables of a scan over which its force is a curve: "z", "vz". Outside the families, a force over such a variable
  /// may be only a part of something else.
  std::vector<std::string> variables = {};
  Place place = Place::kVehicle;
  double drag_exponent = 0;  ///< n of a drag -c |v|^(n - 1) v; 0: none
  /// Flights that stay above this height, in arms of the vehicle, do not show it.
  double seen_below_arms = std::numeric_limits<double>::infinity();
  /// Only changes within a flight show it: it varies with the height, by which flights with other thrust scales differ.
  bool within_flights = false;
  /// Flights hardly reach where it acts, so that its curve stays hidden: it is tried beside any remainder.
  bool hides_its_curve = false;

  bool is_plain(Family of) const { return family == of && reduces_to == Family::kNone; }
  /// Returns whether its force is a curve over this variable.
  bool varies_with(const std::string& variable) const {
    for (const std::string& own : variables) {
      if (own == variable) return true;
    }
    return false;
  }
};

}  // namespace swarmcert::stability
