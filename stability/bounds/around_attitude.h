/// @file The loop that flies around its attitude loop, which stands in place of the first-order lag of the thrust's
/// direction: margins, gains, and whether that lag contains it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "stability/bounds/flown_loop.h"

namespace swarmcert::stability {

/// Exact gains of the loop of one axis around its attitude loop, per unit of one disturbance: of a force per mass, of
/// an error of the estimated velocity, and of a torque per moment of inertia.
struct CascadeGains {
  ResponseNorms force, velocity_error, torque;
};

/// How far the loop of an axis, or of all coupled axes as one, is from a limit cycle.
struct AttitudeRow {
  std::vector<int> axes;
  CascadeMargins margins;
  Nearness nearness = Nearness::kUnstable;
  std::optional<CascadeGains> exact;  ///< of a single axis
  std::vector<CascadeMargins> alone;  ///< of coupled axes: where the gain or the delay of one changes
};

/// Returns one row per decoupled horizontal axis, with its gains, and one row without gains for all coupled axes.
/// Requires gains.attitude.
std::vector<AttitudeRow> attitude_rows(const FlownLoop& loop);

/// Returns by how much the gains from a force to x and y around the attitude loop exceed those of the loop with
/// `attitude_lag_s`: the largest ratio of amplitude, edge and impulse gain. Both are sampled, and delayed, with
/// rate_hz; else both are in continuous time without delay. Nothing without gains.attitude, with coupled horizontal
/// axes, and if a loop is unstable.
std::optional<double> gain_beyond_lag(const FlownLoop& loop);

/// Returns why no bound of x or y holds around the attitude loop that is stated: it diverges, or gain_beyond_lag() > 1.
/// Empty if they hold, and without such a loop.
std::string attitude_objection(const FlownLoop& loop);

/// Returns a lag, s, whose loop has no smaller gain: gain_beyond_lag() <= 1. Nothing if none of 1 ms to 1 s is found.
std::optional<double> lag_that_contains_attitude_s(FlownLoop loop);

}  // namespace swarmcert::stability
