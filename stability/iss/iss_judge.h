/// @file Judges one run of an IssCheck: integrates the loop and compares the error with ball and transient bound.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "stability/bounds/theorem.h"
#include "stability/iss/iss_check.h"
#include "stability/iss/position_loop.h"

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

/// Thread-safe.
class IssJudge {
 public:
  /// @param check provides d_m, ball and duration of the campaign; must outlive this.
  IssJudge(const FlownLoop& loop, const IssCheck& check, const Theorem& theorem);

  /// Fills in the run's ratios up to the time at which a hypothesis or the integration fails.
  void judge(IssRun* run) const;

  const PositionLoop& loop() const { return loop_; }
  double rate_N_s() const { return check_.rate_N_s; }
  double duration_s() const { return check_.duration_s; }

 private:
  void integrate(IssRun* run) const;
  /// The arguments of the transient bound: |p~|, |p~'|, |s'| at t = 0, and d_m; s'(0) contains the learning error.
  std::array<double, 4> start_sizes(const IssRun& run, const PositionLoop::State& state) const;
  /// Accounts for one sample of |p~|; returns false if the run has diverged (|p~| >= 1e6 balls) and need not continue.
  bool weigh(double error_m, int k, bool from_rest, const std::array<double, 4>& sizes, IssRun* run) const;

  PositionLoop loop_;
  const IssCheck& check_;
  const Theorem& theorem_;
  std::optional<TransientTable> table_;
};

}  // namespace swarmcert::stability
