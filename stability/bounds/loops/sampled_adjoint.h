/// @file Kernel of a sampled loop by backward (adjoint) recursion, period by period. Not for users.
#pragma once

#include <cmath>
#include <complex>
#include <optional>
#include <vector>

#include "stability/bounds/loops/sampled_model.h"

namespace swarmcert::stability {

/// Returns the largest modulus of an eigenvalue.
double largest_modulus(const Eigen::MatrixXd& map);

/// Outputs are e at a phase within a period, or I or the new command after the control of a period; kernels are per
/// unit of acceleration.
class SampledAdjoint {
 public:
  enum class Output { kError, kIntegral, kCommand };

  explicit SampledAdjoint(const SampledLoop& loop, Output output = Output::kError);

  /// Returns true if the loop is stable and its slowest oscillation decays within kMostPeriods. Otherwise there are no
  /// kernels, and all gains are infinite.
  bool is_stable() const { return is_stable_; }
  double period_s() const { return period_s_; }
  /// Returns true if the output is e, on which a force acts at once.
  bool is_error() const { return output_ == Output::kError; }
  const SampledModel& model() const { return model_; }
  static constexpr double kMostPeriods = 3e6;
  /// Map of the row of an output from one period to the one before.
  const Eigen::MatrixXd& map() const { return map_; }
  /// Periods after which the kernel has fallen to e^-42, or only one real mode is left.
  long periods() const { return periods_; }
  /// Shrinking per period of that mode; 0: no mode is left.
  double ratio() const { return ratio_; }
  /// The last pair of complex modes, and the periods after which it is alone; empty if it never is before periods().
  struct LastPair {
    long alone_after = 0;
    std::complex<double> mode;  ///< factor per period, of positive imaginary part
  };
  const std::optional<LastPair>& last_pair() const { return last_pair_; }
  /// Returns the largest |log eigenvalue| of the modes that have not decayed to e^-42 after `period` periods, in
  /// radians per period; infinite while commands are on their way.
  double fastest_mode(long period) const;

  /// Calls visit(start, slope, length) for consecutive segments, on which the kernel from a force to the output is
  /// start + slope u, with u growing backwards in time. The first segment is the part of the period before the output's
  /// time. Ends where the kernel has fallen to e^-42, or where only one real mode is left: the kernel of every further
  /// period is then `ratio` times that of the one before, and finish(start, slope, length, ratio) is called with the
  /// next one.
  template <class Visit, class Finish>
  void force_kernel(double phase_s, const Visit& visit, const Finish& finish) const {
    if (output_ == Output::kError) visit(0.0, 1.0, phase_s);
    force_kernel(output_after_control(phase_s), visit, finish);
  }
  /// The same for any output, given as a row over the state after the control; a force in its own period must not
  /// affect it.
  template <class Visit, class Finish>
  void force_kernel(const Eigen::RowVectorXd& after, const Visit& visit, const Finish& finish) const {
    const std::vector<double> rest = walk(
        after * model_.control(), [&](const std::vector<double>& row) { visit(row[1], row[0], period_s_); });
    if (ratio_ > 0) finish(rest[1], rest[0], period_s_, ratio_);
  }

  /// Calls visit(kernel) with the response to an error of 1 m/s^2 in the command of this period, of the one before,
  /// ..., and finish(kernel, ratio) as above.
  template <class Visit, class Finish>
  void command_kernel(const Eigen::RowVectorXd& after, const Visit& visit, const Finish& finish) const {
    const Eigen::VectorXd input = model_.commanded().transpose();
    const Eigen::VectorXd held = model_.hold() * input;
    const auto kernel_of = [&](const std::vector<double>& row) {
      double kernel = 0;
      for (std::size_t i = 0; i < row.size(); ++i) kernel += row[i] * held[static_cast<Eigen::Index>(i)];
      return kernel;
    };
    visit(after.dot(input));
    const std::vector<double> rest =
        walk(after * model_.control(), [&](const std::vector<double>& row) { visit(kernel_of(row)); });
    if (ratio_ > 0) finish(kernel_of(rest), ratio_);
  }

  /// Returns the output as a row over the state after the control.
  Eigen::RowVectorXd output_after_control(double phase_s) const;

 private:
  /// row <- row * map, on plain arrays, as this loop runs up to a million times. Returns the row after the last one
  /// visited.
  template <class Visit>
  std::vector<double> walk(const Eigen::RowVectorXd& first, const Visit& visit) const {
    std::vector<double> now(first.data(), first.data() + first.size());
    std::vector<double> next(now.size());
    for (long j = 0; j < periods_; ++j) {
      visit(now);
      const double* column = map_.data();
      for (double& to : next) {
        double total = 0;
        for (std::size_t i = 0; i < now.size(); ++i) total += now[i] * column[i];
        to = total;
        column += now.size();
      }
      now.swap(next);
    }
    return now;
  }

  double period_s_;
  Output output_;
  SampledModel model_;
  Eigen::MatrixXd map_;
  struct Mode {
    double gone_after, rate;  ///< periods, radians per period
  };
  std::vector<Mode> modes_;
  bool is_stable_ = false;
  long periods_ = 0;
  double ratio_ = 0;
  std::optional<LastPair> last_pair_;
};

}  // namespace swarmcert::stability
