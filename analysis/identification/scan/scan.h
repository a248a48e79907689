/// @file What the remainder depends on: the share explained by curves over each variable on held-out flights.
///
/// The remainder consists of means over 0.1 s along the axes of the world and of the body. A curve is piecewise linear
/// with 4, 8 or 16 knots, or a grid for two variables; it is fitted without one fold and evaluated on that fold. Folds
/// are flights or, if there are fewer than five, chunks of two blocks of 2 s.
///
/// Shares are corrected twice. First, a controller reacts to disturbances, so the remainder may appear to depend on the
/// reaction: of a curve f over v only beta f counts, where beta is the slope of the remainder over f(v), estimated with
/// the instrument f(v as commanded). Second, the largest of many shares is significant only if it exceeds what the same
/// scan finds when the signs of whole chunks are drawn at random, which removes any dependence (wild bootstrap of the
/// maximum).
///
/// Torques and rotors are judged in the same way, as torques about the body axes and as the excess force of each rotor.
/// A rotor is reported for a variable only if no other rotor varies half as much with it, because an effect on two
/// rotors points to the vehicle. The rotor then replaces the torques over that variable.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/instrument.h"
#include "analysis/identification/scan/samples.h"

namespace swarmcert::identification {

/// A point of a curve or map.
struct CurvePoint {
  std::vector<double> at;  ///< one number, or two for a map
  double value = 0;        ///< in ScanEntry::unit
  Interval interval;       ///< 90 %, from the fits without one fold
};

/// A variable on which a component of the remainder depends.
struct ScanEntry {
  std::string variable, frame, axis;  ///< "climb"; for the others see ScanColumn and along_velocity()
  std::string quantity = "force", unit = "N";
  /// Corrected share of the mean square about the mean: of the force vector, of the torque about the one axis, or of
  /// the four rotors together.
  double share = 0;
  double uncorrected_share = 0;  ///< before the correction for the controller's reaction
  Interval share_interval;       ///< 90 %, by resampling flights or chunks
  /// In newton, of the force vector at single records; otherwise of the column in its unit, for means over 0.1 s.
  double rmse_before = 0, rmse_after = 0;
  std::vector<CurvePoint> curve;
  bool is_checked = false;   ///< setpoints allow the check against closed-loop bias
  InstrumentedValue slope;   ///< beta; 1 if the controller has no influence
  double lag_s = 0;          ///< age of the neighbour's state
  bool over_ground = false;  ///< absolute velocity of a neighbour, not relative to the vehicle
  double period_s = 0;       ///< of a periodic component; 0: none
  /// The variables of formulas for this entry.
  std::vector<ScanVariable> variables;  ///< empty for neighbours and constants
  int column = 0;                       ///< of ScanSamples::residual
};

struct Scan {
  std::vector<ScanEntry> entries;  ///< best first
  double least_share = 0;          ///< smaller shares are considered chance
  int tried = 0;                   ///< number of variables times components
};

/// The criterion by which a curve is considered significant.
enum class Judges {
  kThisScan,  ///< its share must exceed random signs by three standard deviations
  /// Half of the variance is enough if it exceeds the mean under random signs, because random signs hardly change the
  /// result for a force that acts in only a few passes.
  kOtherFlights
};

/// Scans the samples. The result depends only on the samples and `judges`.
/// @param samples see scan_samples()
Scan scan(const ScanSamples& samples, int jobs, Judges judges = Judges::kThisScan);

/// Returns the curve over the speed of the force along the velocity, as an entry with the frame "velocity" and the axis
/// "along"; without a curve if the speed hardly varies. scan() does not try it.
ScanEntry along_velocity(const ScanSamples& samples);

}  // namespace swarmcert::identification
