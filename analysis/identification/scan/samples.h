/// @file Residuals of a model in flight, as means over 0.1 s, with all variables that may explain them.
#pragma once

#include <Eigen/Core>
#include <array>
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
  kBodyVx,  ///< velocity along the body axes; only for forces along the body axes
  kBodyVy,
  kBodyVz,
  kSpeed,
  kAirspeed,  ///< speed relative to the wind implied by a constant force and a linear drag
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

/// The scanned quantity: the residual force, or the residual torques and rotor forces.
enum class ScanQuantity { kForce, kBalance };

/// A column of ScanSamples::residual.
struct ScanColumn {
  const char* quantity;  ///< "force", "torque", or "rotor_force": excess force attributed to a single rotor
  const char* frame;     ///< "world", "body" or "neighbour"
  const char* axis;      ///< "x" .. "z"; "toward"; "roll", "pitch", "yaw"; "rotor_1" .. "rotor_4"
  const char* unit;      ///< "N" or "Nm"
  const char* target;    ///< in [effect.expression]; empty if not available
};
/// Returns the columns. Force: x, y, z in the world, then in the body, then horizontally towards the nearest neighbour,
/// without the mean along the world's axes. Balance: roll, pitch, yaw, then the rotors.
const std::vector<ScanColumn>& scan_columns(ScanQuantity quantity);
/// The last column of the force.
inline constexpr int kTowardColumn = 6;

/// Static properties of a variable.
struct ScanVariableInfo {
  const char* name;    ///< "climb", as in results
  const char* symbol;  ///< in [effect.expression]; empty if not available in formulas
  const char* unit;    ///< as in parameter names: "m", "m_s"
  /// The controller reacts to disturbances with this variable, so it counts only as far as setpoints confirm it.
  bool is_answer;
  bool in_world, in_body;  ///< used for forces along these axes
};
const ScanVariableInfo& scan_variable(ScanVariable variable);

using ScanValues = std::array<double, static_cast<std::size_t>(kNumScanVariables)>;
/// Returns the values of the variables that an instant holds, and NaN for the others.
ScanValues scan_values(const stability::Instant& now);

/// Relative position and velocity of the laterally nearest neighbour within 1.5 m in height, now and up to 0.5 s ago.
struct NeighbourPlaces {
  static constexpr int kLags = 6;
  static constexpr double kLag_s = 0.1;  ///< between consecutive lags
  /// [samples x kLags]; lateral distance and height above, NaN without such a neighbour.
  Eigen::MatrixXf lateral_m, height_m;
  /// [samples x 3 kLags], lag by lag: x, y, z of its past velocity minus the vehicle's current velocity; NaN as above.
  Eigen::MatrixXf velocity_m_s;

  /// Returns the column of one component; `variable` is kNeighbourVx .. kNeighbourVz.
  static Eigen::Index velocity_column(ScanVariable variable, int lag) {
    return 3 * lag + static_cast<int>(variable) - static_cast<int>(ScanVariable::kNeighbourVx);
  }
};

/// One row per 0.1 s of flight in the blocks of cut_into_blocks(). Records between two consecutive blocks are included,
/// because nothing here has a memory longer than the 10 ms of the accelerometer.
struct ScanSamples {
  Eigen::MatrixXf values;     ///< [samples x kNumScanVariables]; NaN where unknown
  Eigen::MatrixXf commanded;  ///< the same as commanded by setpoints; NaN if not commanded
  ScanQuantity quantity = ScanQuantity::kForce;
  Eigen::MatrixXf residual;  ///< [samples x columns of scan_columns()], in their units
  Eigen::MatrixXf axes;      ///< [samples x 9]: rotation from body to world, column by column
  NeighbourPlaces neighbours;
  std::vector<int> flight, block;  ///< block counts through all flights
  int flights = 0, blocks = 0;
  double mean_square_N2 = 0;  ///< of the force vector at single records

  Eigen::Index size() const { return residual.rows(); }
  bool has_neighbours() const;
};

/// Returns every n-th sample, such that there are at most `most`.
ScanSamples thinned(const ScanSamples& samples, Eigen::Index most);

/// Returns means over 0.1 s of the residuals of the models with `specs` added.
/// @param quantity kBalance: balance_columns() minus the mean of each track, because trims differ between vehicles;
///   tracks without these columns are skipped
ScanSamples scan_samples(const Passes& passes, const std::vector<stability::EffectSpec>& specs,
                         ScanQuantity quantity = ScanQuantity::kForce);

}  // namespace swarmcert::identification
