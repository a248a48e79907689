/// @file Identifies a weak rotor without flights of the healthy vehicle, by the direction in which the loads deviate.
///
/// In slow flight each rotor carries a quarter of the weight. With f_k, the force that the thrust map gives for its
/// duty, d_k = 4 f_k / (m g) - 1 vanishes if the model is right. A rotor that gives the fraction rho of its thrust
/// leaves d = (1 / rho - 1) e_k. A thrust scale, an offset centre of mass and unequal rotors leave other directions. A
/// direction drawn at random in four dimensions lies within the angle theta of one of the four axes with probability
/// 4 (theta - sin theta cos theta) / pi, which is 1 % if cos^2 theta = kSurelyOneRotor: the rotor then holds this share
/// of |d|^2.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/missing.h"
#include "analysis/identification/rotors/rotor_loads.h"

namespace swarmcert::identification {

inline constexpr double kSurelyOneRotor = 0.95;

struct LoneRotor {
  int rotor = 0;     ///< 1 .. 4; 0: the loads do not point to a single rotor
  double share = 0;  ///< of |d|^2
  bool is_sure =
      false;  ///< the share is at least kSurelyOneRotor, and the same rotor rose most in every flight
};

/// Judges the flights of one vehicle. A rotor is returned if its load exceeds the mean of the two lowest by more than a
/// battery displaced by kBatteryPlay_m explains, no other rotor's by half as much, and it accounts for at least half of
/// the excess of all loads over the weight: it may then be what a thrust_ratio below 1 shows. Precondition: `flights`
/// is not empty.
LoneRotor lone_rotor(const std::vector<RotorLoads>& flights, const stability::Model& model);

/// If `ranking`, found in the flights `which` of vehicles of `kind`, has a thrust_ratio below 1 that a weak rotor
/// explains: replaces it by rotor_thrust with the ratio as a rival if the rotor is sure, else adds rotor_thrust to its
/// rivals. Changes nothing if several vehicles flew, because their rotors differ, or without slow flight.
void name_lone_rotor(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                     int jobs, std::vector<Missing>& ranking);

}  // namespace swarmcert::identification
