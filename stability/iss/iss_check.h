/// @file Attempts to falsify the tracking theorem's ball and transient bound by integrating the disturbed loop.
///
/// The loop: position law in continuous time with the clamped integral, behind the lags that gains.toml declares and
/// the thrust limit of the model, on a point mass:
///   m v' = f - m g - (eps0 + eps(t)),  |eps'| <= d_m.
/// With the theorem's hypotheses this is the system that the theorem speaks of; lags, clamps and gains outside the
/// theorem's form take it away from that, and then violations are to be expected. Finding no violation is not a proof.
/// A run is judged only as long as it keeps the hypotheses on the flight: no saturation, no clamp that acts, a
/// commanded force that is not near zero and points upwards. What happens later says nothing about the theorem.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "stability/gains.h"
#include "stability/model.h"

namespace swarmcert::stability {

/// A learning error: eps(0) = 0 beside the bias, then a rate that is constant from switch to switch.
struct RateDisturbance {
  Eigen::Vector3d bias_W_N = Eigen::Vector3d::Zero();
  std::vector<double> until_s;              ///< ends of the pieces, ascending
  std::vector<Eigen::Vector3d> rate_W_N_s;  ///< by piece; zero after the last one

  Eigen::Vector3d at(double time_s) const;
};

/// One run: its start, its disturbance, and how near it came.
struct IssRun {
  std::string kind;  ///< "ramp", "worst_linear", "bang_bang", "random", "initial_state", "optimised"
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero(),
                  velocity_m_s = Eigen::Vector3d::Zero();  ///< errors at t = 0
  RateDisturbance disturbance;
  double ratio = 0;  ///< largest |p~| / ball; only for runs that start at rest without bias
  double transient_ratio =
      0;  ///< largest |p~(t)| / transient bound(t), where that is more than a thousandth of the ball
  double largest_m = 0, at_s = 0;
  bool is_violation = false;  ///< one of the ratios is above 1
  /// The hypothesis that the run left, in words, and when. It is not judged from then on. Empty: kept to the end.
  std::string left;
  double left_at_s = 0;
  std::string failure;  ///< why the integration failed; the run is judged up to there. Empty: it did not

  bool is_complete() const { return left.empty() && failure.empty(); }
};

struct IssOptions {
  int runs = 200;
  double rate_N_s = 0;  ///< d_m; 0: a fifth of the weight over the time that the loop needs to settle
  std::uint64_t seed = 0;
  int jobs = 0;
  std::function<void(int done, int total)> progress;
  const std::atomic<bool>* cancelled = nullptr;
};

struct IssCheck {
  bool theorem_applies = false;
  std::vector<std::string> why_not;  ///< hypotheses that fail
  bool has_ball = false;             ///< the gains have the theorem's form, whatever else fails
  double rate_N_s = 0;               ///< d_m
  double ball_m = 0;      ///< the theorem's, or where !has_ball d_m / (m Ki), which no theorem supports
  double duration_s = 0;  ///< of every run
  std::vector<IssRun> runs;
  int violations = 0;  ///< runs that exceed a bound while they keep every hypothesis that is monitored
  int left = 0;        ///< runs that leave a hypothesis
  int failed = 0;      ///< runs whose integration failed
  double worst_ratio = 0, worst_transient_ratio = 0;
  int worst = -1;  ///< index of the run with the worst ratio
  /// Of gains.toml: a differential equation without memory has none, so the runs say nothing about it.
  double delay_left_out_s = 0;
  bool unstable = false;  ///< the linear loop has no decaying response at all
  bool cancelled = false;

  /// Whether the ball is refuted: a run exceeds a bound of the theorem while every hypothesis holds, those on the gains
  /// and, up to then, those on the flight.
  bool is_refuted() const { return theorem_applies && violations > 0; }
  /// Why the campaign shows nothing although it does not refute; empty: it found no violation.
  std::vector<std::string> why_inconclusive() const;
};

/// Runs the campaign. The same for every number of jobs. A violation is a ratio above 1 + 1e-6, well above the
/// integrator's tolerance of 1e-9. A run whose integration fails is reported, and the campaign goes on.
IssCheck check_iss(const Gains& gains, const Model& model, const IssOptions& options);

}  // namespace swarmcert::stability
