#include "stability/bounds/enclosures/verified_sampled_norms.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/bounds/enclosures/contracting_sampled_system.h"

namespace swarmcert::stability {
namespace {

using Eigen::Index;

/// Factor that turns sums and products of a few positive doubles, rounded to nearest, into upper bounds.
constexpr double kOver = 1 + 1e-14;
constexpr int kVerifiedPhases = 4;
constexpr long kMostPeriods = 1'500'000;

/// A linear function of the row: `mid` in doubles, and bounds on the deviation of the exact value from the sum in
/// doubles, per length of the computed row and per error of the row.
struct Linear {
  std::vector<double> mid;
  double per_length = 0, per_error = 0;

  Linear() = default;
  explicit Linear(const IntervalVector& c) {
    double radius = 0;
    for (const Interval& x : c) {
      mid.push_back(middle(x));
      radius = up(radius + farthest(x, mid.back()));
    }
    per_error = norm_above(c) * kOver;
    // gamma_n of a dot product, plus the same amount for the few operations on its result.
    per_length = (radius + 2.3e-16 * (static_cast<double>(c.size()) + 8) * per_error) * kOver;
  }
  double operator()(const std::vector<double>& row) const {
    double total = 0;
    for (std::size_t i = 0; i < row.size(); ++i) total += row[i] * mid[i];
    return total;
  }
};

/// One period of the kernel k, its integral S and the integral of S, Q; each with a bound on its error.
struct Cell {
  double k0, k1;  ///< k = k0 + k1 u
  double S0, Q0;
  double k_error, S_error, Q_error;

  static Interval around(Interval x, double error) { return x + Interval(-error, error); }
  Interval k(double u) const { return around(Interval(k0) + Interval(k1) * Interval(u), k_error); }
  Interval S(double u) const {
    return around(Interval(S0) + Interval(u) * (Interval(k0) + Interval(k1) * Interval(u / 2)), S_error);
  }
  Interval Q(double u) const {
    const Interval x(u);
    return around(
        Interval(Q0) + x * (Interval(S0) + x * (Interval(k0) / Interval(2) + Interval(k1) * x / Interval(6))),
        Q_error);
  }
};

/// Accumulates the total variation and the extremum of a continuous, piecewise monotonic function from its values at
/// the ends of the pieces.
class Runs {
 public:
  /// Starts a segment with this sign, at which the function has the value `at()`.
  template <class Value>
  void add(int sign, const Value& at) {
    if (sign == sign_) return;
    turn(at());
    sign_ = sign;
  }
  /// Adds a segment on which the function varies by at most `most`.
  void add_unsure(Interval at, double most) {
    turn(at);
    total_ += Interval(0, most);
    peak_.upper = std::max(peak_.upper, up(at.mag() + most));
    sign_ = 0;
  }
  void finish(Interval at) { turn(at), sign_ = 0; }
  Interval total() const { return total_; }
  Interval peak() const { return peak_; }

 private:
  void turn(Interval at) {
    if (sign_ != 0) {
      const Interval part = sign_ > 0 ? at - start_ : start_ - at;
      total_ += Interval(std::max(0.0, part.lower), std::max(0.0, part.upper));
    }
    start_ = at;
    peak_ = {std::max(peak_.lower, at.mig()), std::max(peak_.upper, at.mag())};
  }
  Interval total_, peak_, start_;
  int sign_ = 0;
};

/// An output: a row over the states before the control, and the direct contributions within its own period.
struct Output {
  IntervalVector row;
  double phase_s = 0;  ///< forces in its own period: the kernel is u up to this time
  Interval own;        ///< commands: response to the command of its own period
  Interval settled;    ///< response to a constant disturbance in the long run
};

class SampledEnclosure {
 public:
  /// @param input added to the state after the control once per period; empty: a force.
  /// @param integrates whether the output's response to a constant input vanishes in the long run.
  SampledEnclosure(const SampledLoop& loop, const IntervalVector& input, bool integrates,
                   const IntervalSampledModel& model, ContractingSampledSystem system)
      : h_(loop.period_s), is_force_(input.empty()), integrates_(integrates), system_(std::move(system)) {
    const std::size_t n = model.size();
    A_.resize(n * n);
    Interval radius;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        const Interval a = system_.A(i, j);
        A_[j * n + i] = middle(a);
        const double r = farthest(a, middle(a));
        radius += Interval(r) * r;
      }
    }
    step_error_ = (sqrt(radius).upper + 2.3e-16 * static_cast<double>(n + 2) * norm_above(system_.A)) * kOver;
    gap_ = Interval(1) - Interval(system_.gamma);
    IntervalVector k0(n);
    IntervalVector k1(n);
    if (is_force_) {
      for (std::size_t i = 0; i < n; ++i) {
        k0[i] = system_.R(static_cast<Index>(i), 1);
        k1[i] = system_.R(static_cast<Index>(i), 0);
      }
    } else {
      // An error of one period is equivalent to a force held for one period.
      for (std::size_t k = 0; k < n; ++k) {
        Interval held;
        for (std::size_t j = 0; j < input.size(); ++j) held += model.hold()(k, j) * input[j];
        for (std::size_t i = 0; i < n; ++i)
          k0[i] += Interval(system_.R(static_cast<Index>(i), static_cast<Index>(k))) * held / Interval(h_);
      }
    }
    const Interval h(h_);
    IntervalVector cell(n);  // integral of k over a period
    for (std::size_t i = 0; i < n; ++i) cell[i] = h * (k0[i] + h * k1[i] / Interval(2));
    const IntervalVector rest = summed(cell);  // of all periods from this one on
    IntervalVector second(n);                  // integral of S over a period, or h S at its end for commands
    for (std::size_t i = 0; i < n; ++i) {
      second[i] = is_force_ ? h * (h * (k0[i] / Interval(2) + h * k1[i] / Interval(6)) - rest[i])
                            : h * (cell[i] - rest[i]);
    }
    k0_ = Linear(k0), k1_ = Linear(k1), rest_ = Linear(rest);
    if (integrates_) second_rest_ = Linear(summed(second));
  }

  VerifiedNorms run(const Output& output) const {
    const std::size_t n = output.row.size();
    std::vector<double> row(n);
    std::vector<double> next(n);
    double error = 0;
    for (std::size_t i = 0; i < n; ++i) {
      row[i] = middle(output.row[i]);
      error = up(error + up(output.row[i].upper - output.row[i].lower));
    }
    const double settled = middle(output.settled);
    const double settled_error =
        up(output.settled.upper - output.settled.lower) + 1e-15 * output.settled.mag();
    Runs of_S;
    Runs of_Q;
    VerifiedNorms norms = own_period(output);
    double length = length_of(row);
    const double first = length;
    Cell cell{};
    for (long j = 0; length > std::max(1e-14 * first, 100 * error) && j < kMostPeriods; ++j) {
      set(cell, row, length, error, settled, settled_error);
      const double end = cell.k0 + cell.k1 * h_;
      const double most = std::max(std::abs(cell.k0), std::abs(end));
      norms.impulse = {std::max(norms.impulse.lower, most - cell.k_error),
                       std::max(norms.impulse.upper, up(most + cell.k_error))};
      const double least = cell.k0 * end > 0 ? std::min(std::abs(cell.k0), std::abs(end)) : 0;
      if (least > cell.k_error) {
        of_S.add(cell.k0 > 0 ? 1 : -1, [&] { return cell.S(0); });
      } else {
        follow([&](double a, double b) { return hull(cell.k(a), cell.k(b)); },
               [&](double a) { return cell.S(a); }, cell.k_error, 0, h_, kDepth, of_S);
      }
      if (integrates_) add_second(cell, most, of_Q);
      advance(row, next, length, error);
      row.swap(next);
      length = length_of(row);
    }
    set(cell, row, length, error, settled, settled_error);
    of_S.finish(cell.S(0));
    // The tail: |row| decreases by gamma per period.
    const double size = (length + error) * kOver;
    const double k_most = (k0_.per_error + k1_.per_error * h_) * size * kOver;
    const double periods = up(1 / gap_.lower);
    const double S_change = h_ * k_most * periods * kOver;
    norms.amplitude += of_S.total() + Interval(0, S_change);
    norms.edge = {std::max(norms.edge.lower, of_S.peak().lower),
                  std::max({norms.edge.upper, of_S.peak().upper, up(cell.S(0).mag() + S_change)})};
    norms.impulse.upper = std::max(norms.impulse.upper, k_most);
    if (integrates_) {
      of_Q.finish(cell.Q(0));
      const double S_most = (rest_.per_error * size + h_ * k_most) * kOver;
      norms.rate += of_Q.total() + Interval(0, h_ * S_most * periods * kOver);
    } else {
      norms.rate = {kInfinity, kInfinity};
    }
    return norms;
  }

  const ContractingSampledSystem& system() const { return system_; }

 private:
  static constexpr int kDepth = 40;

  static double length_of(const std::vector<double>& row) {
    double total = 0;
    for (const double x : row) total += x * x;
    return std::sqrt(total) * kOver;
  }

  /// Encloses x with x = c + A x, so that row x is the sum over all periods: the residual of a computed x bounds its
  /// error, as |(I - A)^-1| <= 1/(1 - gamma).
  IntervalVector summed(const IntervalVector& c) const {
    const std::size_t n = c.size();
    std::vector<double> x(n);
    Eigen::MatrixXd left = Eigen::MatrixXd::Identity(static_cast<Index>(n), static_cast<Index>(n));
    Eigen::VectorXd right(static_cast<Index>(n));
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) left(static_cast<Index>(i), static_cast<Index>(j)) -= A_[j * n + i];
      right[static_cast<Index>(i)] = middle(c[i]);
    }
    const Eigen::VectorXd solved = left.fullPivLu().solve(right);
    IntervalVector residual = c;
    for (std::size_t i = 0; i < n; ++i) {
      residual[i] = residual[i] - Interval(solved[static_cast<Index>(i)]);
      for (std::size_t j = 0; j < n; ++j)
        residual[i] += system_.A(i, j) * Interval(solved[static_cast<Index>(j)]);
    }
    const double wrong = (Interval(norm_above(residual)) / gap_).upper;
    IntervalVector result(n);
    for (std::size_t i = 0; i < n; ++i) {
      result[i] = Interval(solved[static_cast<Index>(i)]) + Interval(-wrong, wrong);
    }
    return result;
  }

  VerifiedNorms own_period(const Output& output) const {
    const Interval p(output.phase_s);
    const Interval own = abs(output.own);
    if (is_force_) {
      return {p * p * p / Interval(6), p * p / Interval(2), p * p / Interval(2), p};
    }
    return {own * Interval(h_), own, own, own / Interval(h_)};
  }

  void set(Cell& cell, const std::vector<double>& row, double length, double error, double settled,
           double settled_error) const {
    const auto off = [&](const Linear& l) { return (l.per_length * length + l.per_error * error) * kOver; };
    cell.k0 = k0_(row);
    cell.k1 = k1_(row);
    cell.S0 = settled - rest_(row);
    const double k1_error = off(k1_);
    cell.k_error = (off(k0_) + h_ * k1_error + 1e-15 * h_ * std::abs(cell.k1)) * kOver;
    cell.S_error = (off(rest_) + settled_error + 1e-15 * std::abs(settled) + h_ * cell.k_error) * kOver;
    if (!integrates_) return;
    cell.Q0 = -second_rest_(row);
    cell.Q_error = (off(second_rest_) + h_ * cell.S_error) * kOver;
  }

  /// Adds the runs of one sign of a function on [a, b], halved where its sign is not sure.
  /// @param range_on encloses the function on an interval. @param integral_at its antiderivative
  template <class RangeOn, class IntegralAt>
  static void follow(const RangeOn& range_on, const IntegralAt& integral_at, double error, double a, double b,
                     int depth, Runs& runs) {
    const Interval range = range_on(a, b);
    if (range.lower > 0 || range.upper < 0)
      return runs.add(range.lower > 0 ? 1 : -1, [&] { return integral_at(a); });
    if (depth == 0 || 8 * error > range.mag())
      return runs.add_unsure(integral_at(a), up(up(b - a) * range.mag()));
    const double middle = a + (b - a) / 2;
    follow(range_on, integral_at, error, a, middle, depth - 1, runs);
    follow(range_on, integral_at, error, middle, b, depth - 1, runs);
  }

  void add_second(const Cell& cell, double k_most, Runs& runs) const {
    if (!is_force_) {
      const Interval at_end = cell.S(h_);
      if (at_end.lower > 0 || at_end.upper < 0) {
        runs.add(at_end.lower > 0 ? 1 : -1, [&] { return cell.Q(0); });
      } else {
        runs.add_unsure(cell.Q(0), up(h_ * at_end.mag()));
      }
      return;
    }
    if (std::abs(cell.S0) > (h_ * (k_most + cell.k_error) + cell.S_error) * kOver) {
      runs.add(cell.S0 > 0 ? 1 : -1, [&] { return cell.Q(0); });
    } else {
      const auto range_on = [&](double a, double b) {
        const double middle = a + (b - a) / 2;
        return cell.S(middle) + hull(cell.k(a), cell.k(b)) * (Interval(a, b) - Interval(middle));
      };
      follow(
          range_on, [&](double a) { return cell.Q(a); }, cell.S_error, 0, h_, kDepth, runs);
    }
  }

  void advance(const std::vector<double>& row, std::vector<double>& next, double length,
               double& error) const {
    const double* column = A_.data();
    for (double& to : next) {
      double total = 0;
      for (std::size_t i = 0; i < row.size(); ++i) total += row[i] * column[i];
      to = total;
      column += row.size();
    }
    error = (system_.gamma * error + step_error_ * length) * kOver + 1e-290;
  }

  double h_;
  bool is_force_;
  bool integrates_;
  ContractingSampledSystem system_;
  Interval gap_;
  std::vector<double> A_;  ///< column by column
  double step_error_ = 0;
  Linear k0_, k1_, rest_, second_rest_;
};

Interval dot(const IntervalVector& row, const IntervalVector& column) {
  Interval total;
  for (std::size_t i = 0; i < row.size(); ++i) total += row[i] * column[i];
  return total;
}

/// @param input as in SampledEnclosure. @param at_rest response of e to a constant input in the long run.
std::optional<VerifiedSampledNorms> enclosed_norms(const SampledLoop& loop, const IntervalSampledModel& model,
                                                   const IntervalVector& input, bool integrates,
                                                   Interval at_rest) {
  std::optional<ContractingSampledSystem> system = contracting(model);
  if (!system) return std::nullopt;
  const bool is_force = input.empty();
  const SampledEnclosure enclosure(loop, input, integrates, model, *std::move(system));
  // Returns the norms of an output, given as a row over the state after the control.
  const auto output = [&](const IntervalVector& after, double phase_s, Interval settled) {
    return enclosure.run({(after * model.control()) * enclosure.system().R_inverse, phase_s,
                          is_force ? Interval(0) : dot(after, input), settled});
  };
  VerifiedSampledNorms result;
  for (int i = 0; i < kVerifiedPhases; ++i) {
    const double phase_s = loop.period_s * i / kVerifiedPhases;
    const VerifiedNorms here = output(model.error_at(phase_s), phase_s, at_rest);
    if (i == 0) result.at_samples = result.all_times = here;
    for (const auto gain : kVerifiedGains) {
      Interval& all = result.all_times.*gain;
      all = {std::max(all.lower, (here.*gain).lower), std::max(all.upper, (here.*gain).upper)};
    }
  }
  // The largest gains to a command or a lag output; for a force, `rate` is the gain to its sum with the force at that
  // time.
  VerifiedNorms bend{Interval(0), Interval(0), Interval(0), Interval(0)};
  for (std::size_t i = 0; i <= model.lags(); ++i) {
    IntervalVector after(model.size() + 1);
    after[i < model.lags() ? 2 + i : model.command_index()] = 1;
    const VerifiedNorms here = output(after, 0, Interval(0));
    for (const auto gain : kVerifiedGains)
      (bend.*gain).upper = std::max((bend.*gain).upper, (here.*gain).upper);
  }
  if (is_force) {
    bend.amplitude = bend.amplitude + Interval(1);
    // From the sample at which a command is computed until it acts, the force changes by less than this.
    bend.rate = bend.rate + Interval(static_cast<double>(model.past() + 2)) * Interval(loop.period_s);
  }
  bend.edge = bend.amplitude;  // an input of total variation 1 from rest stays below 1
  const double step_s = up(loop.period_s / kVerifiedPhases * (1 + 1e-15));
  for (const auto gain : kVerifiedGains) {
    Interval& all = result.all_times.*gain;
    if (std::isfinite(all.upper))
      all.upper = (Interval(all.upper) + Interval(step_s) * step_s / Interval(8) * (bend.*gain).upper).upper;
  }
  return result;
}

/// Divides every finite gain by `divisor`.
VerifiedSampledNorms over(VerifiedSampledNorms result, Interval divisor) {
  for (VerifiedNorms* const norms : {&result.at_samples, &result.all_times}) {
    for (const auto gain : kVerifiedGains) {
      if (std::isfinite((norms->*gain).upper)) norms->*gain = norms->*gain / divisor;
    }
  }
  return result;
}

}  // namespace

std::optional<VerifiedSampledNorms> verified_sampled_norms(const SampledLoop& loop, Channel channel) {
  const IntervalSampledModel model(loop);
  IntervalVector input;
  if (channel == Channel::kCommand) {
    input.resize(model.size() + 1);
    input[model.command_index()] = 1;
  }
  const bool integrates = loop.plant.Ki > 0;
  const Interval at_rest = integrates ? Interval(0) : Interval(1) / Interval(loop.plant.Kp);
  const auto norms = enclosed_norms(loop, model, input, integrates, at_rest);
  return norms ? std::optional(over(*norms, Interval(loop.plant.mass_kg))) : std::nullopt;
}

std::optional<VerifiedSampledNorms> verified_sampled_norms(const SampledLoop& loop, Estimate estimate) {
  const IntervalSampledModel model(loop);
  const std::size_t measured = estimate == Estimate::kPosition ? 0 : 1;
  IntervalVector input(model.size() + 1);
  for (std::size_t i = 0; i < input.size(); ++i)
    input[i] = model.control()(i, measured) - Interval(i == measured ? 1.0 : 0.0);
  // The vehicle follows a wrong position: e tends to its negative.
  if (estimate == Estimate::kPosition) return enclosed_norms(loop, model, input, false, Interval(-1));
  const bool integrates = loop.plant.Ki > 0;
  const Interval at_rest =
      integrates ? Interval(0) : Interval(0) - Interval(loop.plant.Kd) / Interval(loop.plant.Kp);
  return enclosed_norms(loop, model, input, integrates, at_rest);
}

}  // namespace swarmcert::stability
