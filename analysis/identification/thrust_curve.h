/// @file Force of a rotor as a polynomial of its command or speed, from flights.
///
/// In means over blocks, the load l (specific force along the thrust axis, over g) is regressed on the means over the
/// rotors of the powers of their commands u:
///   l = a + b mean(u) + c mean(u^2),
/// so that a rotor gives the force (a + b u + c u^2) m g / rotors. Tried are the power that the log is read with alone,
/// b u + c u^2, and all three. More terms are taken if they predict flights better that they were not fitted to.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "analysis/logs/log.h"

namespace swarmcert::identification {

/// Means over blocks of one flight.
struct LoadBlocks {
  std::vector<Eigen::Vector3d> powers;  ///< 1, mean(u), mean(u^2)
  std::vector<double> load;             ///< over g
};

/// Returns the blocks of the records of `log` in which `is_airborne`; a fifth of a second each, without the first and
/// the last two seconds. Precondition: Signals::motor_commands > 0.
LoadBlocks load_blocks(const logs::Log& log, const std::vector<char>& is_airborne);

/// A polynomial of the command, in shares of the weight that a rotor carries.
struct ThrustCurve {
  Eigen::Vector3d shares = Eigen::Vector3d::Zero();  ///< a, b, c; zero: the given power alone
  std::string why;                                   ///< what decided, in words
  bool is_found() const { return !shares.isZero(); }
};

/// Returns the polynomial that replaces the given power of the command. It is found if the error on flights held out in
/// turn (of a single one, on its fifths) falls by 1 % on average over fifths of flights, and by more than two standard
/// errors of that mean; if it grows from command 0 to 1, as model files require; and if the power alone explains nine
/// tenths of the variance of the load: else the commands follow disturbances, and the polynomial would be that of the
/// controller.
/// @param power 1 or 2
ThrustCurve thrust_curve(const std::vector<LoadBlocks>& flights, int power);

}  // namespace swarmcert::identification
