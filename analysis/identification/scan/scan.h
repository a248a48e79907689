/// @file What the remainder depends on: its share that curves over each variable explain on flights left out.
///
/// The remainder is taken as means over 0.1 s, along the world's axes and the body's. A curve is piecewise linear with
/// 4, 8 or 16 knots, for two variables a grid; it is fitted without one fold and judged on that fold. Folds are
/// flights, or where there are fewer than five, chunks of two blocks of 2 s.
///
/// Shares are corrected twice. A controller answers disturbances, so that the remainder may seem to depend on the
/// answer: of a curve f over v only beta f counts, where beta is the slope of the remainder over f(v) by the instrument
/// f(v as commanded). And the largest of many shares is no accident only if it exceeds what the same scan finds where
/// the signs of whole chunks are drawn at random, which leaves no dependence (wild bootstrap of the largest value).
///
/// Torques and rotors are judged in the same way, as torques about the body's axes and as the force that each rotor
/// gives too much. A rotor counts over a variable only where no other one varies half as much with it: what moves two
/// speaks of the vehicle. It then stands for the torques over that variable.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/instrument.h"
#include "analysis/identification/scan/samples.h"

namespace swarmcert::identification {

/// One point of a curve or map.
struct CurvePoint {
  std::vector<double> at;  ///< one number, or two of a map
  double value = 0;        ///< in ScanEntry::unit
  Interval interval;       ///< 90 %, from the fits without one fold
};

/// One variable over which one component of the remainder varies.
struct ScanEntry {
  std::string variable, frame, axis;  ///< "climb"; for the rest see ScanColumn
  std::string quantity = "force", unit = "N";
  /// Corrected, of the mean square about the mean: of the force's vector, of the torque about the one axis, or of the
  /// four rotors together.
  double share = 0;
  double uncorrected_share = 0;  ///< before the correction for the controller's answer
  Interval share_interval;       ///< 90 %, by resampling flights or chunks
  /// In newton, of the force's vector at single records; else of the column in its unit, means over 0.1 s.
  double rmse_before = 0, rmse_after = 0;
  std::vector<CurvePoint> curve;
  bool is_checked = false;   ///< set points allow the check against closed-loop bias
  InstrumentedValue slope;   ///< beta; 1 where the controller plays no part
  double lag_s = 0;          ///< neighbours as they were so long ago
  bool over_ground = false;  ///< velocity of a neighbour, not minus the vehicle's
  double period_s = 0;       ///< of what repeats in time; 0: it does not
  /// What formulas are fitted to.
  std::vector<ScanVariable> variables;  ///< empty for neighbours and constants
  int column = 0;                       ///< of ScanSamples::residual
};

struct Scan {
  std::vector<ScanEntry> entries;  ///< best first
  double least_share = 0;          ///< smaller ones are taken for accidents
  int tried = 0;                   ///< variables times components
};

/// Who decides whether a curve is an accident.
enum class Judges {
  kThisScan,  ///< its share must be beyond three standard deviations of what signs drawn at random give
  kOtherFlights  ///< half of the variance is enough, if it is more than such draws give in the mean: where a force
                 ///< acts in a few passes only, a draw can hardly miss it
};

/// @param samples see scan_samples(). The result depends on nothing but them and `judges`.
Scan scan(const ScanSamples& samples, int jobs, Judges judges = Judges::kThisScan);

}  // namespace swarmcert::identification
