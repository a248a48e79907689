/// @file Derivatives of noisy series by local polynomials.
#pragma once

#include <algorithm>
#include <vector>

#include "analysis/logs/signal_table.h"

namespace swarmcert::logs {

/// Windows of the derived signals, at which the noise of known collections falls to 1 % of the weight or less.
inline constexpr double kVelocityWindow_s = 0.10, kPositionWindow_s = 0.16;

/// Window widths for a log with this median step: at least four steps for the velocity and six for the position.
inline double velocity_window_s(double step_s) { return std::max(kVelocityWindow_s, 4.01 * step_s); }
inline double position_window_s(double step_s) { return std::max(kPositionWindow_s, 6.01 * step_s); }

/// Returns derivatives of `series` at each record, in this order, from a polynomial fitted by least squares to the
/// records within half a window, never across a gap. At the ends of a stretch the window is one-sided. NaN if a stretch
/// is too short.
/// @param degree 2 or 3; `derivatives` are 0 to degree
std::vector<std::vector<double>> local_derivatives(const SignalTable& table,
                                                   const std::vector<double>& series, double window_s,
                                                   int degree, const std::vector<int>& derivatives);

}  // namespace swarmcert::logs
