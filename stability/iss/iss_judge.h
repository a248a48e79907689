/// @file Judges one run of an IssCheck: integrates the loop and holds the error against ball and transient.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "stability/bounds/theorem.h"
#include "stability/iss/iss_check.h"
#include "stability/iss/position_loop.h"

namespace swarmcert::stability {

inline constexpr int kIssSamples = 250;  ///< of the error, per run

/// The transient bound at the sample times, for one unit of each of the numbers that it is linear in.
class TransientTable {
 public:
  TransientTable(const Theorem& theorem, double mass_kg, double duration_s);
  /// Bound on |p~| at sample k, for |p~|, |p~'|, |s'| at t = 0, and d_m.
  double at(int k, const std::array<double, 4>& sizes) const;

 private:
  static constexpr int kParts = 4;
  std::vector<double> values_[kParts];
};

/// Safe to use from several threads.
class IssJudge {
 public:
  /// @param check its d_m, ball and duration are those of the campaign; must outlive this.
  IssJudge(const Gains& gains, const Model& model, const IssCheck& check, const Theorem& theorem);

  /// Fills in the run's ratios, as far as the run keeps the hypotheses and its integration succeeds.
  void judge(IssRun* run) const;

  const PositionLoop& loop() const { return loop_; }
  double rate_N_s() const { return check_.rate_N_s; }
  double duration_s() const { return check_.duration_s; }

 private:
  void integrate(IssRun* run) const;
  /// What the transient bound starts from: |p~|, |p~'|, |s'| at t = 0, and d_m; s'(0) contains the learning error.
  std::array<double, 4> start_sizes(const IssRun& run, const PositionLoop::State& state) const;
  /// Takes one sample of |p~| into account; false where the run has left all bounds and need not go on.
  bool weigh(double error_m, int k, bool from_rest, const std::array<double, 4>& sizes, IssRun* run) const;

  PositionLoop loop_;
  const IssCheck& check_;
  const Theorem& theorem_;
  std::optional<TransientTable> table_;
};

}  // namespace swarmcert::stability
