/// @file Identifies a weak rotor by comparing its load in slow flight with that of the healthy vehicle.
///
/// A rotor that gives the fraction rho of its thrust gets 1 / rho times the command, while the others keep theirs,
/// because the true forces must still carry the weight and their torques must cancel. So the rise of its load over the
/// mean of the two rotors that rose least is (1 - rho) of its load. A payload of mass m under rotor k raises the load
/// of that rotor by 3/4 m g and of its neighbours by 1/4, and lowers that of the opposite one by 1/4. It is detected as
/// well, and slow flight cannot distinguish the two.
///
/// Loads also vary between flights with the position of the battery. A battery displaced by d along one axis raises two
/// rotors by W d / (4 l) and lowers the other two, where l is the distance of the rotors from the axis: a relative rise
/// of a rotor's load over the lowest two of 2 d / l. Rises below that, for d = kBatteryPlay_m, identify no rotor; nor
/// does a rise of which a second rotor has more than half, because that is the effect of a shifted centre of mass.
#pragma once

#include <array>

#include "analysis/identification/rotors/rotor_loads.h"
#include "nn/base/interval.h"

namespace swarmcert::identification {

/// How far the position of a battery varies under its strap.
inline constexpr double kBatteryPlay_m = 1.5e-3;
/// If a second rotor rose by more than this fraction of the largest rise, neither is identified.
inline constexpr double kMostOfSecond = 0.5;

struct RotorFactor {
  double value = 1;         ///< fraction of the previous thrust of the rotor; 1: unchanged
  Interval interval{1, 1};  ///< 90 %, including the scatter of the healthy flights
};

/// The result for a vehicle in one flight or in all of its flights.
struct RotorBalance {
  std::string vehicle, flight;  ///< flight is empty for the mean of all
  int flights = 0, healthy_flights = 0;
  std::size_t records = 0;  ///< of the vehicle's own slow flight
  Eigen::Vector4d load_N = Eigen::Vector4d::Zero(), healthy_N = Eigen::Vector4d::Zero();
  Eigen::Vector4d rise_N = Eigen::Vector4d::Zero();  ///< over the mean of the two rotors that rose least
  double least_rise_N = 0;                           ///< the smallest rise that identifies a rotor
  std::array<RotorFactor, 4> factors;
  int rotor = 0;  ///< 1 .. 4: weak or with a load near it; 0: none identified
};

/// Compares `own` with `healthy` flights of the same vehicle. Precondition: neither is empty.
RotorBalance rotor_balance(const std::vector<RotorLoads>& own, const std::vector<RotorLoads>& healthy,
                           const stability::Model& model);

/// Returns the results for each vehicle with healthy flights: first for all of its flights together, then one by one.
std::vector<RotorBalance> rotor_balances(const std::vector<RotorLoads>& own,
                                         const std::vector<RotorLoads>& healthy,
                                         const stability::Model& model);

/// Describes the result: "rotor 3 (back left) is weak, or carries a load near it: 14 % less thrust than in healthy
/// flight"; without a rotor: "no rotor stands out".
std::string in_words(const RotorBalance& balance);

}  // namespace swarmcert::identification
