/// @file Converts numbers measured in flights to a disturbance source; shared by `bound --from`, promises over flights
/// and the gate.
#pragma once

#include <array>

#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::analysis {

/// One axis of an error measured over consecutive windows, in newton for a force, m/s for a velocity. Infinite:
/// unknown.
struct MeasuredAxis {
  double bias = 0;       ///< |mean| of a flight
  double amplitude = 0;  ///< largest value, bias included
  double rate = 0;       ///< largest rate of change, per second
  double variation = 0;  ///< total variation within a window
  double impulse = 0;    ///< integral of the absolute value over a window, times s
};

/// Converts a force error. Every window of the flight may contribute the variation and the impulse of one window again.
/// @param window_s zero if unknown: then variation and impulse refer to the whole flight.
stability::DisturbanceSource measured_source(const std::array<MeasuredAxis, 3>& force, double window_s);

/// Converts an estimation error. The amplitude contains the bias; if the measured amplitude is below the bias, which
/// can happen for quantiles of few flights, the bias is added.
stability::EstimateError measured_estimate(const MeasuredAxis& error, double window_s);

}  // namespace swarmcert::analysis
