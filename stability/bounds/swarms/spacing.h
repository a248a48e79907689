/// @file Keep-out region below other vehicles, from a downwash field and bounds on the tracking error.
#pragma once

#include <vector>

#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::stability {

/// |f_z| due to one vehicle above at height gap dz and horizontal distance r from its wake: amplitude (0.3/dz)^decay
/// (1 + q x)^(-1/q), x = r^2/(2 s^2), s = spread + slope dz; exp(-x) for q = 0. A gap below `nearest_m` is replaced by
/// it.
struct DownwashField {
  double amplitude_N = 0;
  double decay = 0;
  double spread_m = 0, spread_slope = 0;
  double tail = 0;  ///< q, 0 to 1
  double nearest_m = 0.12;

  double peak_N(double height_gap_m) const;
  double spread_at_m(double height_gap_m) const;
  /// Returns the distance, in spreads, at which the force has fallen to a share of its peak.
  double spreads_at(double share) const;
  /// Returns the integral of the profile along a line through its centre, in spreads.
  double line_integral() const;
};

struct SpacingQuestion {
  double max_error_m = 0;
  double dwell_s = 2;  ///< least time outside the keep-out radius between two passes
  int neighbours = 1;  ///< number above at once; their forces add at most linearly
  double guard = 1;    ///< factor on every predicted force, from comparison with flights
  double from_m = 0.15, to_m = 0.8;
  int steps = 27;
};

/// One height gap.
struct SpacingRow {
  double height_gap_m = 0;  ///< of the references
  double peak_force_N = 0;
  double stay_error_m = 0;       ///< bound for any motion below, however slow
  bool may_stay = false;         ///< stay_error_m <= max_error_m and the thrust suffices
  double keep_out_radius_m = 0;  ///< see spacing(); 0 if may_stay
  double least_speed_m_s = 0;    ///< see spacing(); infinite if no speed suffices, 0 if may_stay
  /// Saturation::margin_N() of crossing at the least speed, else of staying; negative: no bound holds
  double thrust_margin_N = 0;
};

struct Spacing {
  std::vector<SpacingRow> shape;
  double least_gap_to_stay_m = 0;  ///< among the rows; infinite if none allows it
  double least_gap_to_cross_m = 0;
};

/// Computes the spacing for the lower vehicle, without feedforward. Its own error may bring it closer, so forces are
/// evaluated at the gap less max_error_m. Each row is one statement: the error stays below max_error_m for any number
/// of straight passes through the keep-out radius at least_speed_m_s or more (relative, horizontal), with at least
/// dwell_s between the end of one and the start of the next, and any motion outside the radius meanwhile.
///
/// Outside, the force is at most F, of which twice as much would cause max_error_m or use up the thrust; the rest of a
/// pass is an impulse of at most J = peak s line_integral()/v. The error is at most A F + I J, with A the amplitude
/// gain, I the impulse gain summed over all earlier passes as far as they are still felt; with the gains of the loop
/// without integral, plus the effect of the largest integral, if the clamp may act. In the same way the feedback is at
/// most E F + C J, and at most E times the peak, with E and C the gains to the command; the thrust must suffice for it.
/// The bounds hold for forces within the field; `guard` accounts for its deviation from flights.
/// @param beside all else that disturbs the lower vehicle; its error and its share of the thrust are contained.
/// @throws std::invalid_argument if Lambda or K couples the z axis to others, and for an error of the thrust ratio.
Spacing spacing(const FlownLoop& loop, const DownwashField& field, const DisturbanceSource& beside,
                const SpacingQuestion& question);

}  // namespace swarmcert::stability
