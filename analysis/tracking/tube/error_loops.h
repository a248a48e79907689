/// @file From forces over time to tracking errors, by the kernels of the position loops.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nn/base/interval.h"
#include "stability/bounds/enclosures/kernel_cells.h"
#include "stability/bounds/tracking_setup.h"

namespace swarmcert::analysis {

/// One axis of the loop that flies, without delay: m D e = s (f_a - f_hat + m x) + s (L - 1)(f_a - m p_d''), with f_a
/// the force that acts, f_hat what the controller believes, L the lags of its command. x is what the command, an
/// acceleration that a sampled loop holds over its period, differs from the continuous law's (hold_error.h); in a
/// continuous loop it is 0. So e = h' * (f_a - f_hat + m x) + g' * w with
///   h = L^-1[1/(m D)] (command channel),   g = L^-1[(L - 1)/(m D)],   w = f_a - m p_d''.
/// Each entry bounds its kernel in real arithmetic, for every constant lag of the motors in an interval where one is
/// given. h and g, which do not decay where Ki = 0, may be missing.
struct ErrorLoop {
  std::optional<stability::KernelCells> h, h1, h2;  ///< h, h', h''
  std::optional<stability::KernelCells> h3;         ///< h'''; missing where there is no lag
  std::optional<stability::KernelCells> g, g1, g2;  ///< all missing where there is no lag
  /// e'' is 1/m times w where there is a lag, of f_a - f_hat + m x where there is none, less this kernel's answer to
  /// it, and with a lag h''' * (f_a - f_hat + m x).
  std::optional<stability::KernelCells> direct_rest;  ///< missing where the loop is continuous
  /// KernelCells::total() of these kernels where the loop is sampled, else 0.
  double direct_rest_total = 0, h3_total = 0, g2_total = 0;
  /// Whether the cells of a sampled loop are whole periods of it. Then x = (t - t_k) y for t_k <= t < t_k + T with y in
  /// [c - r, c + r] is, to a kernel k, T/2 y and a rest whose mean over each cell is 0. By parts,
  ///   int k x  lies in  T/2 (c int k + [-r, r] int |k|) + [-1, 1] T^2/8 max|y| int |k'|   over a cell,
  /// as the antiderivative of t - t_k - T/2 that is 0 at both ends of the cell is at most T^2/8. These are |k'| for
  /// k = h', h'' and h'''. The last one is missing where there is no lag: e'' follows a force at once.
  bool has_whole_periods = false;
  std::optional<stability::KernelCells> slope1, slope2, slope3;
  /// From an error n of the estimated position to int (e + n), m s per m: L^-1[s (s L + Kd)/D]; missing where Ki = 0.
  std::optional<stability::KernelCells> demand;
  bool has_lag = false;
  double mass_kg = 0;
  double Kp = 0, Kd = 0, Ki = 0;
  Interval lags_s;      ///< sum of the time constants
  double period_s = 0;  ///< of a sampled loop; 0: continuous
};

struct ErrorLoops {
  ErrorLoop axis[3];
  std::string refusal;  ///< why there are none; empty where there are
  bool is_sampled() const { return axis[0].period_s > 0; }
};

/// Whether both differ in nothing but mass and delay.
bool same_gains_and_lags(const stability::AxisLoop& a, const stability::AxisLoop& b);

/// The loops of all axes, their kernels over `slices` slices, with the integral gain as the firmware's step makes it
/// act.
/// @param is_sampled the command is held over a period of the gains' rate; else the law is continuous.
/// @param motor_lag_s positive: the loops of all lags in it; else the one that the gains state.
ErrorLoops error_loops(const stability::TrackingSetup& tracking, double slice_s, int slices,
                       bool is_sampled = false, const std::optional<Interval>& motor_lag_s = {});

/// Bounds of |e| and |e'| at the times of each slice.
struct ErrorHistory {
  std::vector<double> position_m, velocity_m_s;
  void add(const ErrorHistory& other);
  double largest_position_m() const;
  double largest_velocity_m_s() const;
};

/// What is known of a signal slice by slice: sup |w|, and sup |w'| where it has a rate; w(0) may jump from 0.
struct Signal {
  std::vector<double> size;
  std::vector<double> rate;  ///< empty: not known
  double at_start = 0;       ///< at least |w(0)|; matters to the rate
};

/// Errors of one axis slice by slice that one newton of excess in the thrust at t = 0 causes, m and m/s per N: a lag
/// that starts there adds exp(-t/tau) to the force, so that e = tau h'. Of a loop with one lag.
struct LagStart {
  std::vector<Interval> position_m, velocity_m_s;  ///< empty without a lag: then the thrust follows at once
  std::vector<Interval> acceleration_m_s2;         ///< m/s^2 per N; empty where the loop is continuous
};
LagStart lag_start(const ErrorLoop& loop, double slice_s);

/// From rest: |e| <= |h'| * size, or |h| * rate + sup|h| |w(0)|, the smaller at each time; |e'| likewise, one
/// derivative on.
/// @param lagging the kernels g instead of h.
ErrorHistory respond(const ErrorLoop& loop, bool lagging, const Signal& signal);

/// Bounds of what is wrong with the position and the velocity that a vehicle's law and its network are given, axis by
/// axis, at any time and of any course; those of its neighbours, which it is told, have the same.
struct EstimateErrors {
  double velocity_m_s[3] = {0, 0, 0}, position_m[3] = {0, 0, 0};
  bool are_zero() const;
};

/// What errors of the estimates do to one axis, slice by slice: bounds of |e|, |e'| and, where the loop is sampled,
/// |e''|. With errors v of the velocity and n of the position, which a sampled loop sees as staircases, the law's
/// command is off by Kd v + Kp n + Ki int n, and where the loop is sampled its integrator by at most Ki T sup|n| more:
///   |e| <= |h'| * m (Kd sup|v| + (Kp + Ki T) sup|n|) + |h| * m Ki sup|n|.
struct EstimateAnswer {
  ErrorHistory errors;
  std::vector<double> acceleration_m_s2;  ///< empty where the loop is continuous
  double force_N = 0;                     ///< m (Kd sup|v| + (Kp + Ki T) sup|n|)
};
EstimateAnswer estimate_answer(const ErrorLoop& loop, double velocity_m_s, double position_m,
                               std::size_t slices);

}  // namespace swarmcert::analysis
