/// @file Which rotor gives less than it did: its load in slow flight against that of the healthy vehicle.
///
/// A rotor that gives the share rho of its thrust is asked for 1 / rho times as much, the others for what they were:
/// the sum of the true forces still carries the weight and their torques still cancel. So the rise of its load over the
/// mean of the two rotors that rose least is (1 - rho) of its load. A load of mass m under rotor k raises that one by
/// 3/4 m g, its neighbours by 1/4 and lowers the opposite one by 1/4: it shows as well, and slow flight cannot tell the
/// two apart.
///
/// What else moves the loads from flight to flight is where the battery sits. One that sits d elsewhere along one axis
/// raises two rotors by W d / (4 l) and lowers the other two, l the distance of the rotors from the axis: a rise of
/// 2 d / l of a rotor's load over the lowest two. Rises below that, for kBatteryPlay_m, name no rotor; nor do rises of
/// which a second rotor has more than half, which is what a shifted centre of mass does.
#pragma once

#include <array>

#include "analysis/identification/rotors/rotor_loads.h"
#include "nn/base/interval.h"

namespace swarmcert::identification {

/// How far a battery's place varies under its strap.
inline constexpr double kBatteryPlay_m = 1.5e-3;
/// A second rotor that rose by more of the largest rise leaves both unnamed.
inline constexpr double kMostOfSecond = 0.5;

struct RotorFactor {
  double value = 1;         ///< of the rotor's thrust before; 1: as before
  Interval interval{1, 1};  ///< 90 %, with the scatter of the healthy flights
};

/// One vehicle, in one flight or in all of its flights.
struct RotorBalance {
  std::string vehicle, flight;  ///< flight empty: the mean of all
  int flights = 0, healthy_flights = 0;
  std::size_t records = 0;  ///< of the vehicle's own slow flight
  Eigen::Vector4d load_N = Eigen::Vector4d::Zero(), healthy_N = Eigen::Vector4d::Zero();
  Eigen::Vector4d rise_N = Eigen::Vector4d::Zero();  ///< over the mean of the two that rose least
  double least_rise_N = 0;                           ///< that names a rotor
  std::array<RotorFactor, 4> factors;
  int rotor = 0;  ///< 1 .. 4: weak, or with a load near it; 0: none is named
};

/// `own` against `healthy` flights of the same vehicle. @param own not empty, as `healthy`
RotorBalance rotor_balance(const std::vector<RotorLoads>& own, const std::vector<RotorLoads>& healthy,
                           const stability::Model& model);

/// Every vehicle that has healthy flights: first all of its flights together, then one by one.
std::vector<RotorBalance> rotor_balances(const std::vector<RotorLoads>& own,
                                         const std::vector<RotorLoads>& healthy,
                                         const stability::Model& model);

/// "rotor 3 (back left) is weak, or carries a load near it: 14 % less thrust than in healthy flight"; of no rotor: "no
/// rotor stands out".
std::string in_words(const RotorBalance& balance);

}  // namespace swarmcert::identification
