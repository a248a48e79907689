/// @file Judges one run of an IssCheck: integrates the loop and compares the error with ball and transient bound.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "stability/bounds/theorem.h"
#include "stability/iss/iss_check.h"

namespace swarmcert::stability {

inline constexpr int kIssSamples = 250;  ///< error samples per run

/// The transient bound at the sample times, tabulated for one unit of each quantity in which it is linear.
class TransientTable {
 public:
  TransientTable(const Theorem& theorem, double mass_kg, double duration_s);
  /// Returns the bound on |p~| at sample k, given |p~|, |p~'|, |s'| at t = 0, and d_m.
  double at(int k, const std::array<double, 4>& sizes) const;

 private:
  static constexpr int kParts = 4;
  std::vector<double> values_[kParts];
};

/// State and matrix of FlownLoop::matrix(). As long as the theorem's hypotheses hold, the loop is linear:
/// d x/dt = A x, with eps entering v as -eps / m.
using LoopState = Eigen::Matrix<double, 15, 1>;
using LoopMatrix = Eigen::Matrix<double, 15, 15>;

/// Thread-safe.
class IssJudge {
 public:
  /// @param check provides d_m, ball and duration of the campaign; must outlive this.
  IssJudge(const FlownLoop& loop, const IssCheck& check, const Theorem& theorem);

  /// Fills in the run's ratios up to the time at which a hypothesis or the integration fails.
  void judge(IssRun* run) const;

  const LoopMatrix& matrix() const { return matrix_; }
  double mass_kg() const { return mass_kg_; }
  double rate_N_s() const { return check_.rate_N_s; }
  double duration_s() const { return check_.duration_s; }

 private:
  void integrate(IssRun* run) const;
  LoopState derivative(const LoopState& x, const Eigen::Vector3d& eps_W_N) const;
  /// Returns the hypothesis of the tracking theorem that fails in the state x, in words; null if all hold. They are:
  /// the commanded force is at most what the rotors give, is not near zero and points above the horizon (an attitude
  /// law turns the vehicle towards it), and no integral has reached its clamp.
  const char* left_hypothesis(const LoopState& x) const;
  /// The arguments of the transient bound: |p~|, |p~'|, |s'| at t = 0, and d_m; s'(0) contains the learning error.
  std::array<double, 4> start_sizes(const IssRun& run, const LoopState& state) const;
  /// Accounts for one sample of |p~|; returns false if the run has diverged (|p~| >= 1e6 balls) and need not continue.
  bool weigh(double error_m, int k, bool from_rest, const std::array<double, 4>& sizes, IssRun* run) const;

  LoopMatrix matrix_;
  PidMatrices law_;
  PerAxis limit_m_s_;  ///< on |int e|
  double mass_kg_;
  Interval thrust_N_;
  const IssCheck& check_;
  const Theorem& theorem_;
  std::optional<TransientTable> table_;
};

}  // namespace swarmcert::stability
