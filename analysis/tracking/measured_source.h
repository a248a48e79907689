/// @file From numbers that flights showed to a disturbance source: what `bound --from`, promises over flights and the
/// gate share.
#pragma once

#include <array>

#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

/// One axis of an error that was measured over windows that follow one another, in newton for a force, m/s for a
/// velocity. Infinite: not known.
struct MeasuredAxis {
  double bias = 0;       ///< |mean| of a flight
  double amplitude = 0;  ///< largest value, bias included
  double rate = 0;       ///< largest rate of change, per second
  double variation = 0;  ///< total variation within a window
  double impulse = 0;    ///< integral of the absolute value over a window, times s
};

/// The force error. Every window of the flight may bring the variation and the impulse of one again.
/// @param window_s zero where it is not known: then both are those of the whole flight.
stability::DisturbanceSource measured_source(const std::array<MeasuredAxis, 3>& force, double window_s);

/// The error of an estimate. The amplitude contains the bias; where it was measured below it, as quantiles of few
/// flights can be, it is added.
stability::EstimateError measured_estimate(const MeasuredAxis& error, double window_s);

}  // namespace swarmcert::analysis
