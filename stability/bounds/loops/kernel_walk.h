/// @file Walks along the kernel of a sampled loop in strides of many periods where nothing happens. Not for users.
///
/// The kernel is a linear functional of a row that goes from period to period by the loop's map M, r_j = r_0 M^j. Sums
/// of a functional r_j c over the periods a to b - 1 are (r_a - r_b) (I - M)^-1 c, so a stretch of many periods costs
/// as much as one of them.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <utility>
#include <vector>

#include "stability/bounds/loops/sampled_adjoint.h"

namespace swarmcert::stability {

/// Consecutive periods, backwards in time, over which the kernel keeps its sign and its values at the starts and at the
/// ends of the periods are monotonic. S is the integral of the kernel (of samples: their sum) from the output's time.
struct KernelStretch {
  double periods = 1;          ///< infinite for the rest of the kernel, if only one real mode is left
  double start = 0, end = 0;   ///< the kernel at the start and at the end of the first period
  double peak = 0, least = 0;  ///< largest and smallest |kernel|
  double change = 0;           ///< of S over the stretch
  double left = 0;             ///< change of S from the start of the stretch to the end of the kernel
  double area = 0;             ///< int (S - S at the end of the kernel); of samples the sum times the period

  /// Extends the range from `least` to `peak` to a value of the kernel.
  void include(double value) {
    peak = std::max(peak, std::abs(value));
    least = std::min(least, std::abs(value));
  }
};

class KernelWalk {
 public:
  /// The kernel of a force: a linear function on each period.
  static KernelWalk of_force(const SampledAdjoint& adjoint);
  /// The kernel of an input that adds `input` [size + 1] to the state after the control of every period, as that of a
  /// force held for a period, per unit of its integral.
  static KernelWalk of_held(const SampledAdjoint& adjoint, const Eigen::VectorXd& input);
  /// The responses to that input themselves. S is their sum.
  static KernelWalk of_samples(const SampledAdjoint& adjoint, const Eigen::VectorXd& input);

  double period_s() const { return adjoint_->period_s(); }

  /// Walks for `kLanes` outputs at once, given as rows over the state after the control.
  /// @param sinks one per output. `period(start, end)` takes a single period, `stretch(s)` several, `rest(s)` the rest
  ///     of the kernel; a stretch over which one of them `crosses_zero(change)` is divided. A stretch lasts at most
  ///     Sink::kLongest_rad, in radians of the fastest mode that is left, and Sink::kLongestSwing_rad once a single
  ///     oscillation is left; single periods may be longer. If Sink::kSums, `repeat(before, but_last, share, ratio)`
  ///     ends an oscillation: what was added since the sink was `before`, without `share` of the last period, which
  ///     `but_last` lacks, is added infinitely many times more, each time scaled by `ratio`.
  template <std::size_t kLanes, class Sink>
  void run(const Eigen::MatrixXd& outputs, std::array<Sink, kLanes>& sinks) const;

 private:
  /// Functionals of the row. Those before kLeft keep their signs over a stretch.
  enum Column { kStart, kEnd, kStartStep, kEndStep, kSecondStep, kLeft, kArea, kColumns };
  template <std::size_t kLanes, class Sink>
  class Run;

  explicit KernelWalk(const SampledAdjoint& adjoint);
  void set_kernel(const Eigen::VectorXd& start, const Eigen::VectorXd& end);
  /// Returns c such that r c is the sum of r_j `part` over this period and all before it in time.
  Eigen::VectorXd summed(const Eigen::VectorXd& part) const;

  const SampledAdjoint* adjoint_;
  Eigen::MatrixXd columns_;              ///< [size x kColumns]
  std::vector<Eigen::MatrixXd> powers_;  ///< M^(2^i)
};

/// One walk.
template <std::size_t kLanes, class Sink>
class KernelWalk::Run {
 public:
  using Lanes = Eigen::Array<double, static_cast<int>(kLanes), 1>;
  struct Point {
    std::vector<Lanes> row;
    std::array<Lanes, kColumns> value;
  };

  Run(const KernelWalk& walk, std::array<Sink, kLanes>& sinks)
      : walk_(walk), sinks_(sinks), middle_(walk.powers_.size()) {}

  void all(const Eigen::MatrixXd& rows) {
    const SampledAdjoint& adjoint = *walk_.adjoint_;
    Point now, next;
    for (Eigen::Index i = 0; i < rows.cols(); ++i) now.row.emplace_back(rows.col(i).array());
    next = now;
    for (Point& point : middle_) point.row = now.row;
    evaluate(now);
    const long until = adjoint.last_pair() ? adjoint.last_pair()->alone_after : adjoint.periods();
    long period = 0;
    while (period < until) {
      const double most = Sink::kLongest_rad / adjoint.fastest_mode(period);
      std::size_t level = 0;
      for (double length = 2; level + 1 < walk_.powers_.size() && length <= most; length *= 2) ++level;
      advance(now, level, next);
      std::swap(now, next);
      period += 1L << level;
    }
    if (adjoint.last_pair()) oscillate(now, adjoint.periods() - period);
    if (!(adjoint.ratio() > 0)) return;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      KernelStretch rest = from(now, lane);
      rest.periods = std::numeric_limits<double>::infinity();
      rest.change = rest.left;
      sinks_[lane].rest(rest);
    }
  }

 private:
  /// A functional of a single oscillation, Re(z mode^j), and the periods until its next zero and its next extremum.
  struct Wave {
    std::complex<double> z;
    double zero = 0, extremum = 0;
  };

  /// A single oscillation of mode exp(log_mode) in one lane: goes from one change of a sign to the next.
  class Oscillation {
   public:
    /// @param a, b values of the functionals in this period and in the next one.
    Oscillation(const Point& a, const Point& b, Eigen::Index lane, std::complex<double> log_mode)
        : log_mode_(log_mode),
          half_cycle_(kPi / log_mode.imag()),
          longest_(std::max(1.0, std::floor(Sink::kLongestSwing_rad / log_mode.imag()))) {
      const std::complex<double> mode = std::exp(log_mode);
      for (std::size_t c = 0; c < kColumns; ++c) {
        const double v = a.value[c][lane], next = b.value[c][lane];
        Wave& wave = waves_[c];
        wave.z = {v, (v * mode.real() - next) / mode.imag()};
        wave.zero = until(wave.z, kPi / 2);
        wave.extremum = until(wave.z, std::atan(log_mode.real() / log_mode.imag()));
      }
    }

    void walk(double periods, Sink& sink) {
      while (periods > 0) periods -= swing(std::min(longest_, periods), sink);
    }

    /// Walks `periods`, the end of which is that of the kernel. Sums do not need all of them: half cycles repeat,
    /// smaller by the same ratio, up to the squared angle of a period, by which they depend on where they begin in a
    /// period.
    void walk_to_end(double periods, Sink& sink) {
      if constexpr (Sink::kSums) {
        constexpr double kResolved = 1e-12;
        const double decay = -log_mode_.real(), turn = log_mode_.imag();
        const double settled = std::ceil(std::max(0.0, std::log(turn * turn / kResolved) / decay));
        const double block = std::ceil(half_cycle_);
        if (settled + block < periods) {
          walk(settled, sink);
          const Sink before = sink;
          walk(block - 1, sink);
          const Sink but_last = sink;
          walk(1, sink);
          return sink.repeat(before, but_last, block - half_cycle_, std::exp(-decay * half_cycle_));
        }
      }
      walk(periods, sink);
    }

   private:
    static constexpr double kPi = 3.141592653589793;

    /// Returns the periods until the phase of z mode^j is `angle`, up to half turns.
    double until(std::complex<double> z, double angle) const {
      const double ahead = std::fmod(angle - std::arg(z), kPi);
      return (ahead < 0 ? ahead + kPi : ahead) / log_mode_.imag();
    }

    /// Hands the periods up to the next change of a sign, at most `most`, to the sink. Returns their number.
    double swing(double most, Sink& sink) {
      KernelStretch s;
      s.start = waves_[kStart].z.real();
      s.end = waves_[kEnd].z.real();
      s.peak = s.least = std::abs(s.start);
      s.include(s.end);
      s.left = waves_[kLeft].z.real();
      s.periods = std::min({most, std::ceil(waves_[kStart].zero), std::ceil(waves_[kEnd].zero),
                            std::ceil(waves_[kLeft].zero) - 1});
      if (s.start * s.end < 0 || !(s.periods > 1)) s.periods = 1;
      std::complex<double> step = std::exp(s.periods * log_mode_);
      s.change = s.left - (waves_[kLeft].z * step).real();
      if (s.periods > 1 && sink.crosses_zero(s.change)) s.periods = 1, step = std::exp(log_mode_);
      s.area = waves_[kArea].z.real() - (waves_[kArea].z * step).real();
      for (const Column c : {kStart, kEnd}) include_extremum(waves_[c], s);
      for (Wave& wave : waves_) advance(wave, s.periods, step);
      s.include(waves_[kStart].z.real());
      s.include(waves_[kEnd].z.real());
      if (s.periods > 1) {
        sink.stretch(s);
      } else {
        sink.period(s.start, s.end);
      }
      return s.periods;
    }

    void include_extremum(const Wave& wave, KernelStretch& s) const {
      for (const double at : {std::floor(wave.extremum), std::ceil(wave.extremum)})
        if (at <= s.periods) s.include((wave.z * std::exp(at * log_mode_)).real());
    }

    void advance(Wave& wave, double periods, std::complex<double> step) const {
      wave.z *= step;
      for (double* const next : {&wave.zero, &wave.extremum}) {
        *next -= periods;
        while (*next < 0) *next += half_cycle_;
      }
    }

    std::complex<double> log_mode_;
    double half_cycle_, longest_;  ///< periods
    std::array<Wave, kColumns> waves_;
  };

  void oscillate(const Point& a, long periods) {
    Point b = a;
    multiply(a, 0, b);
    evaluate(b);
    const std::complex<double> log_mode = std::log(walk_.adjoint_->last_pair()->mode);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      Oscillation one(a, b, static_cast<Eigen::Index>(lane), log_mode);
      one.walk_to_end(static_cast<double>(periods), sinks_[lane]);
    }
  }

  void evaluate(Point& point) const {
    for (Eigen::Index c = 0; c < kColumns; ++c) {
      const double* const column = &walk_.columns_(0, c);
      Lanes total = Lanes::Zero();
      for (std::size_t i = 0; i < point.row.size(); ++i) total += point.row[i] * column[i];
      point.value[static_cast<std::size_t>(c)] = total;
    }
  }

  void multiply(const Point& a, std::size_t level, Point& b) const {
    const double* column = walk_.powers_[level].data();
    for (Lanes& to : b.row) {
      Lanes total = Lanes::Zero();
      for (std::size_t i = 0; i < a.row.size(); ++i) total += a.row[i] * column[i];
      to = total;
      column += a.row.size();
    }
  }

  /// Computes the point 2^level periods later and hands everything between to the sinks.
  void advance(const Point& a, std::size_t level, Point& b) {
    multiply(a, level, b);
    evaluate(b);
    if (level > 0 && has_event(a, b)) {
      advance(a, level - 1, middle_[level]);
      advance(middle_[level], level - 1, b);
      return;
    }
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      KernelStretch s = from(a, lane);
      if (level == 0) {
        sinks_[lane].period(s.start, s.end);
        continue;
      }
      const auto l = static_cast<Eigen::Index>(lane);
      s.periods = static_cast<double>(1L << level);
      s.include(b.value[kStart][l]);
      s.include(b.value[kEnd][l]);
      s.change = s.left - b.value[kLeft][l];
      s.area -= b.value[kArea][l];
      sinks_[lane].stretch(s);
    }
  }

  KernelStretch from(const Point& a, std::size_t lane) const {
    const auto l = static_cast<Eigen::Index>(lane);
    KernelStretch s;
    s.start = a.value[kStart][l];
    s.end = a.value[kEnd][l];
    s.peak = s.least = std::abs(s.start);
    s.include(s.end);
    s.left = a.value[kLeft][l];
    s.area = a.value[kArea][l];
    return s;
  }

  bool has_event(const Point& a, const Point& b) const {
    for (int c = kStart; c < kLeft; ++c) {
      if (changes_sign(a, c, b, c)) return true;
    }
    if (changes_sign(a, kStart, b, kEnd)) return true;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const auto l = static_cast<Eigen::Index>(lane);
      if (sinks_[lane].crosses_zero(a.value[kLeft][l] - b.value[kLeft][l])) return true;
    }
    return false;
  }

  /// Ignores changes of sign that are smaller than the round-off of both values.
  bool changes_sign(const Point& a, int of_a, const Point& b, int of_b) const {
    constexpr double kRoundOff = 1e-13;
    const Lanes& at_a = a.value[static_cast<std::size_t>(of_a)];
    const Lanes& at_b = b.value[static_cast<std::size_t>(of_b)];
    if (!(at_a * at_b < 0).any()) return false;
    Lanes size = Lanes::Zero();
    for (std::size_t i = 0; i < a.row.size(); ++i)
      size += a.row[i].abs() * std::abs(walk_.columns_(static_cast<Eigen::Index>(i), of_a));
    return (at_a * at_b < 0 && at_a.abs().max(at_b.abs()) > kRoundOff * size).any();
  }

  const KernelWalk& walk_;
  std::array<Sink, kLanes>& sinks_;
  std::vector<Point> middle_;  ///< one per level
};

template <std::size_t kLanes, class Sink>
void KernelWalk::run(const Eigen::MatrixXd& outputs, std::array<Sink, kLanes>& sinks) const {
  Run<kLanes, Sink>(*this, sinks).all(outputs * adjoint_->model().control());
}

}  // namespace swarmcert::stability
