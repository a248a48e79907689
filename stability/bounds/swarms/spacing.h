/// @file Keep-out region below other vehicles, from a downwash field and bounds on the tracking error.
#pragma once

#include <vector>

#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::stability {

/// |f_z| due to one vehicle above at height gap dz and horizontal distance r: amplitude (0.3/dz)^decay exp(-r^2/(2
/// s^2)), s = spread + slope dz; a gap below `nearest_m` is replaced by it.
struct DownwashField {
  double amplitude_N = 0;
  double decay = 0;
  double spread_m = 0, spread_slope = 0;
  double nearest_m = 0.12;

  double peak_N(double height_gap_m) const;
  double spread_at_m(double height_gap_m) const;
};

/// Further parameters of the lower vehicle.
struct SpacingVehicle {
  double effort_gain = 0;  ///< N/N
  double largest_thrust_N = 0;
  double integral_share = 1;  ///< see clamp_bounds()
  double integrator_limit_m_s = 0;
};

struct SpacingQuestion {
  double max_error_m = 0;
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
  double keep_out_radius_m = 0;  ///< horizontal distance beyond which any motion is allowed; 0 if may_stay
  /// Smallest relative horizontal speed of a straight pass at constant gap through the keep-out radius; infinite if no
  /// speed suffices, 0 if may_stay.
  double least_speed_m_s = 0;
  double thrust_margin_N = 0;  ///< at the peak force; negative: the thrust does not suffice at any speed
};

struct Spacing {
  std::vector<SpacingRow> shape;
  double least_gap_to_stay_m = 0;  ///< among the rows; infinite if none allows it
  double least_gap_to_cross_m = 0;
};

/// Computes the spacing for the lower vehicle, without feedforward. Its own error may bring it closer, so forces are
/// evaluated at the gap less max_error_m. Staying: amplitude bound. Passing at speed v: J = peak s sqrt(2 pi)/v and the
/// smaller of the impulse and the pulse bound. The bounds hold for forces within the field; `guard` accounts for its
/// deviation from flights. If the integrator's clamp may act, the bounds that hold with a clamp are used.
/// @param loop of the z axis, with the effective Ki.
/// @param gains of its force channel, over all times.
Spacing spacing(const AxisLoop& loop, const GainNorms& gains, const SpacingVehicle& vehicle,
                const DownwashField& field, const SpacingQuestion& question);

}  // namespace swarmcert::stability
