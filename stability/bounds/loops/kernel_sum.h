/// @file Sums over the kernel of a sampled loop. Not for users.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "stability/bounds/loops/axis_loop.h"
#include "stability/bounds/loops/kernel_walk.h"

namespace swarmcert::stability {

/// Accumulates |kernel|, |its integral| and their extrema, backwards in time from the time of the output.
class KernelSum {
 public:
  /// @param at_once initial value of the integral. The rate gain is then that to the output plus at_once times the
  ///     disturbance; the other gains are those to the output alone.
  explicit KernelSum(double at_once = 0) : at_once_(at_once), integral_(at_once) {}

  /// Adds a segment of `length` on which the kernel is slope u + start, u growing backwards in time.
  void add_linear(double start, double slope, double length);
  /// Adds a sample of a kernel that is summed once per period.
  void add_sample(double kernel, double period_s);
  /// @param period_s length of the periods. The rest of a kernel requires that the integral tends to zero.
  void add_stretch(const KernelStretch& stretch, double period_s);
  /// Returns whether the integral changes its sign, by more than round-off, when it changes by `change`.
  bool crosses_zero(double change) const {
    const double after = integral_ + change;
    return integral_ * after < 0 &&
           std::min(std::abs(integral_), std::abs(after)) > kRoundOff * (norms_.edge + std::abs(at_once_));
  }
  /// Adds a jump of the integral alone.
  void add_jump(double jump) { integral_ += jump; }
  /// Adds the segment and infinitely many repetitions, each scaled by `ratio`; the integral converges in proportion.
  void add_series(double start, double slope, double length, double ratio) {
    add_series(0, start, slope, length, ratio);
  }
  /// The same with a jump before each repetition, scaled by the same ratio.
  void add_series(double jump, double start, double slope, double length, double ratio);

  /// Adds what was added since `before` infinitely many times more, each time scaled by `ratio`, but only 1 - share of
  /// what was added since `but_last`. The integral tends to zero.
  void repeat(const KernelSum& before, const KernelSum& but_last, double share, double ratio);

  const GainNorms& norms() const { return norms_; }

 private:
  /// Adds a segment on which the kernel keeps its sign, so that its integral is monotonic and has at most one zero.
  void add_signed(double start, double slope, double length);

  static constexpr double kRoundOff = 1e-13;
  GainNorms norms_;
  double at_once_, integral_;
};

/// Variation of the kernel of a sampled loop.
class KernelVariation {
 public:
  void add_linear(double start, double slope, double length) {
    const double end = start + slope * length;
    total_ += std::abs(start - end_) + std::abs(slope) * length;
    most_ = std::max({most_, std::abs(start - start_), std::abs(end - end_)});
    start_ = start;
    end_ = end;
  }
  void add_series(double start, double slope, double length, double ratio) {
    const double before = total_;
    const double jump = std::abs(start - end_);
    add_linear(start, slope, length);
    // Each period contributes its slope and the jump to the start of the next one.
    const double one = total_ - before - jump + std::abs(start * ratio - end_);
    total_ = before + jump + one / (1 - ratio);
    end_ = 0;
  }
  /// Returns the total variation, including jumps, the initial jump from zero and the return to zero.
  double total() const { return total_ + std::abs(end_); }
  /// Returns sup |kernel(v + period) - kernel(v)|, if every segment lasts one period.
  double most_per_period() const { return most_; }

 private:
  double total_ = 0, most_ = 0, start_ = 0, end_ = 0;
};

/// Returns the variation of the kernel of a force. @param after the output as a row over the state after the control.
KernelVariation force_variation(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& after);

/// Gains to outputs, given as rows over the state after the control, in units of acceleration or of the input.
/// @param walk KernelWalk::of_force(). @param own_s per output: how long before its time a force acts on it at once, as
///     it does on e, by 1 m/s per m/s^2 and second; else 0.
std::vector<GainNorms> force_gains(const KernelWalk& walk, const Eigen::MatrixXd& outputs,
                                   const std::vector<double>& own_s);
/// The same for a single output without that part. @param at_once as in KernelSum.
GainNorms force_gains(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& output, double at_once = 0);

/// Gains from an input once per period. @param walk KernelWalk::of_samples(). @param own per output: the response to
///     the input of its own period.
std::vector<GainNorms> sample_gains(const KernelWalk& walk, const Eigen::MatrixXd& outputs,
                                    const Eigen::VectorXd& own);
/// Returns the gains from an error of the command, added once per period, in units of acceleration.
/// @param with_own whether the error in the output's own period is included.
GainNorms command_gains(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& output,
                        bool with_own = true);
/// The same for an input that adds `input` [size + 1] to the state after the control, once per period.
/// @param at_once as in KernelSum: `rate` is the gain to the output plus at_once times the latest input.
GainNorms input_gains(const SampledAdjoint& adjoint, const Eigen::RowVectorXd& output,
                      const Eigen::VectorXd& input, bool with_own = true, double at_once = 0);

}  // namespace swarmcert::stability
