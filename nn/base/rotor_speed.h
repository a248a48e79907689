/// @file Rotor speeds as commands of motors.
#pragma once

namespace swarmcert {

/// The rotor speed that counts as command 1: above that of the rotors of small multirotors. Where a log holds rotor
/// speeds, the command of a motor is its speed over this one, and Model::thrust_curve_N is a polynomial of that.
inline constexpr double kFullRotorSpeed_rad_s = 3000;

}  // namespace swarmcert
