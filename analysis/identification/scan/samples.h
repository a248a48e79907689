/// @file What a model leaves of the flights, as means over 0.1 s beside every variable that may explain it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/identification/refinement.h"

namespace swarmcert::identification {

/// Variables of the scan, in SI units; angles in radians.
enum class ScanVariable : int {
  kX,
  kY,
  kZ,
  kVx,
  kVy,
  kVz,
  kBodyVx,  ///< velocity along the body's axes: offered to forces in the body's axes only
  kBodyVy,
  kBodyVz,
  kSpeed,
  kAirspeed,  ///< speed against the wind that a constant force beside a linear drag stands for
  kClimb,     ///< velocity along the thrust axis
  kHeading,
  kTilt,
  kThrust,
  kDuty1,
  kDuty2,
  kDuty3,
  kDuty4,
  kBattery,
  kTime,
  kSetpointX,
  kSetpointY,
  kSetpointZ,
  kRateX,
  kRateY,
  kRateZ,
  kNeighbourX,  ///< place and velocity of the laterally nearest neighbour minus the vehicle's, as NeighbourPlaces
  kNeighbourY,
  kNeighbourVx,
  kNeighbourVy,
  kNeighbourVz,
  kCount
};
inline constexpr int kNumScanVariables = static_cast<int>(ScanVariable::kCount);

/// What is scanned: what is left of the force, or of what the rotors balance.
enum class ScanQuantity { kForce, kBalance };

/// A column of ScanSamples::residual.
struct ScanColumn {
  const char* quantity;  ///< "force", "torque", or "rotor_force": what one rotor alone gives too much
  const char* frame;     ///< "world", "body" or "neighbour"
  const char* axis;      ///< "x" .. "z"; "toward"; "roll", "pitch", "yaw"; "rotor_1" .. "rotor_4"
  const char* unit;      ///< "N" or "Nm"
  const char* target;    ///< in [effect.expression]; empty where it has none
};
/// Force: x, y, z in the world, then in the body, then horizontally towards the nearest neighbour, without the mean
/// along the world's axes. Balance: roll, pitch, yaw, then the rotors.
const std::vector<ScanColumn>& scan_columns(ScanQuantity quantity);
/// The last one of the force.
inline constexpr int kTowardColumn = 6;

/// What is known of a variable without looking at a flight.
struct ScanVariableInfo {
  const char* name;    ///< "climb", as results show it
  const char* symbol;  ///< in [effect.expression]; empty where formulas cannot use it
  const char* unit;    ///< as in parameter names: "m", "m_s"
  /// The controller answers disturbances with it: it counts only as far as set points confirm it.
  bool is_answer;
  bool in_world, in_body;  ///< offered to forces along these axes
};
const ScanVariableInfo& scan_variable(ScanVariable variable);

/// Place and velocity of the laterally nearest neighbour among those within 1.5 m in height, now and up to 0.5 s ago.
struct NeighbourPlaces {
  static constexpr int kLags = 6;
  static constexpr double kLag_s = 0.1;  ///< between one and the next
  /// [samples x kLags]; lateral distance and height above, NaN where there is no such neighbour.
  Eigen::MatrixXf lateral_m, height_m;
  /// [samples x 3 kLags]: x, y, z of its velocity so long ago, lag by lag, minus the vehicle's now; NaN as above.
  Eigen::MatrixXf velocity_m_s;

  /// Of them, the column of one component; `variable` is kNeighbourVx .. kNeighbourVz.
  static Eigen::Index velocity_column(ScanVariable variable, int lag) {
    return 3 * lag + static_cast<int>(variable) - static_cast<int>(ScanVariable::kNeighbourVx);
  }
};

/// One row per 0.1 s of flight in the blocks of cut_into_blocks(). Records that separate a block from the next one
/// count as part of it: nothing here remembers the past beyond the 10 ms of the accelerometer.
struct ScanSamples {
  Eigen::MatrixXf values;     ///< [samples x kNumScanVariables]; NaN where unknown
  Eigen::MatrixXf commanded;  ///< the same as set points ask for it; NaN where nothing asks
  ScanQuantity quantity = ScanQuantity::kForce;
  Eigen::MatrixXf residual;  ///< [samples x columns of scan_columns()], in their units
  Eigen::MatrixXf axes;      ///< [samples x 9]: rotation from body to world, column by column
  NeighbourPlaces neighbours;
  std::vector<int> flight, block;  ///< block counts through all flights
  int flights = 0, blocks = 0;
  double mean_square_N2 = 0;  ///< of the vector of the force of the single records

  Eigen::Index size() const { return residual.rows(); }
  bool has_neighbours() const;
};

/// Every n-th sample, so that there are at most `most`.
ScanSamples thinned(const ScanSamples& samples, Eigen::Index most);

/// Means over 0.1 s of what the flights' models leave once they have `specs` as well.
/// @param quantity kBalance: what balance_columns() says, about the mean of each track, because trims differ between
/// vehicles; tracks of which it says nothing are left out.
ScanSamples scan_samples(const Passes& passes, const std::vector<stability::EffectSpec>& specs,
                         ScanQuantity quantity = ScanQuantity::kForce);

}  // namespace swarmcert::identification
