/// @file Attempts to falsify the tracking theorem's ball and transient bound by integrating the disturbed loop.
///
/// The loop consists of the position law in continuous time with the clamped integral, the lags that gains.toml
/// declares and the thrust limit of the model, acting on a point mass:
///   m v' = f - m g - (eps0 + eps(t)),  |eps'| <= d_m.
/// Under the theorem's hypotheses this is exactly the system that the theorem covers. With lags, clamps or gains
/// outside the theorem's form it is a different system, and violations are to be expected. Finding no violation is not
/// a proof. A run is judged only as long as the flight satisfies the hypotheses: no saturation, no active clamp, and a
/// commanded force that is not near zero and points upwards. What happens later says nothing about the theorem.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "stability/bounds/flown_loop.h"

namespace swarmcert::stability {

/// A learning error with eps(0) = 0 apart from the bias, whose rate is piecewise constant.
struct RateDisturbance {
  Eigen::Vector3d bias_W_N = Eigen::Vector3d::Zero();
  std::vector<double> until_s;              ///< ends of the intervals, ascending
  std::vector<Eigen::Vector3d> rate_W_N_s;  ///< per interval; zero after the last one

  Eigen::Vector3d at(double time_s) const;
};

/// One run: its initial state, its disturbance, and how close it came to the bounds.
struct IssRun {
  std::string kind;  ///< "ramp", "worst_linear", "bang_bang", "random", "initial_state", "optimised"
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero(),
                  velocity_m_s = Eigen::Vector3d::Zero();  ///< errors at t = 0
  RateDisturbance disturbance;
  double ratio = 0;  ///< largest |p~| / ball; only for runs that start at rest without bias
  /// Largest |p~(t)| / transient bound(t), where that is more than a thousandth of the ball.
  double transient_ratio = 0;
  double largest_m = 0, at_s = 0;
  bool is_violation = false;  ///< one of the ratios is above 1
  /// The hypothesis that the run violated, in words, and when. The run is not judged from then on. Empty: satisfied
  /// throughout.
  std::string left;
  double left_at_s = 0;
  std::string failure;  ///< why the integration failed; judged up to there. Empty: it succeeded

  bool is_complete() const { return left.empty() && failure.empty(); }
};

struct IssOptions {
  int runs = 200;
  double rate_N_s = 0;  ///< d_m; 0: a fifth of the weight over the settling time of the loop
  std::uint64_t seed = 0;
  int jobs = 0;
  std::function<void(int done, int total)> progress;
  const std::atomic<bool>* cancelled = nullptr;
};

struct IssCheck {
  bool theorem_applies = false;
  std::vector<std::string> why_not;  ///< hypotheses that fail
  bool has_ball = false;             ///< the gains have the theorem's form, even if other hypotheses fail
  double rate_N_s = 0;               ///< d_m
  double ball_m = 0;      ///< the theorem's ball, or d_m / (m Ki) if !has_ball, which no theorem supports
  double duration_s = 0;  ///< per run
  std::vector<IssRun> runs;
  int violations = 0;  ///< runs that exceed a bound while all monitored hypotheses hold
  int left = 0;        ///< runs that violate a hypothesis
  int failed = 0;      ///< runs whose integration failed
  double worst_ratio = 0, worst_transient_ratio = 0;
  int worst = -1;  ///< index of the run with the worst ratio
  /// Delay in gains.toml that was ignored: an ordinary differential equation has none, so the runs do not cover it.
  double delay_left_out_s = 0;
  bool unstable = false;  ///< the linear loop has no decaying response
  bool cancelled = false;

  /// Returns true if the ball is refuted: some run exceeds a bound of the theorem although every hypothesis holds,
  /// those on the gains and, up to that time, those on the flight.
  bool is_refuted() const { return theorem_applies && violations > 0; }
  /// Returns the reasons why a campaign that does not refute the ball is inconclusive; empty: it found no violation.
  std::vector<std::string> why_inconclusive() const;
};

/// Runs the campaign. The result does not depend on the number of jobs. A violation is a ratio above 1 + 1e-6, well
/// above the integrator's tolerance of 1e-9. A run whose integration fails is reported, and the campaign continues.
IssCheck check_iss(const FlownLoop& loop, const IssOptions& options);

}  // namespace swarmcert::stability
