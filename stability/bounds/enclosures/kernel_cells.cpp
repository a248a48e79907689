#include "stability/bounds/enclosures/kernel_cells.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "stability/bounds/enclosures/contracting_system.h"

namespace swarmcert::stability {
namespace {

constexpr int kTaylorTerms = 18;
constexpr double kLargestStep_s = 1e-3;

double length_above(const std::vector<double>& w) {
  Interval total;
  for (const double x : w) total += Interval(x) * x;
  return sqrt(total).upper;
}

/// exp(A step) up to `remainder` in the 2-norm.
struct Step {
  IntervalMatrix matrix;
  double remainder = 0;
};

/// @param size upper bound on |A| step, at most 1.
Step exponential(const IntervalMatrix& A, double step_s, double size) {
  const std::size_t n = A.size();
  IntervalMatrix power(n);
  for (std::size_t i = 0; i < n; ++i) power(i, i) = 1;
  Step step{power, 0};
  for (int k = 1; k < kTaylorTerms; ++k) {
    power = power * A;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        power(i, j) = power(i, j) * Interval(step_s) / Interval(k);
        step.matrix(i, j) += power(i, j);
      }
    }
  }
  // Remainder: size^18/18! (1 + size/19 + ...) with size <= 1, and 18! > 6.4e15. The series is below 1.06; the factor
  // 1.1 also covers round-off.
  step.remainder = 1.1 * nth_power(Interval(size * 1.000001), kTaylorTerms).upper / 6.4e15;
  return step;
}

/// The true state is within `error` of w in the 2-norm.
struct EnclosedState {
  std::vector<double> w;
  double error = 0;

  explicit EnclosedState(const std::vector<Interval>& b) : w(b.size()) {
    for (std::size_t i = 0; i < b.size(); ++i) {
      w[i] = (b[i].lower + b[i].upper) / 2;
      error = up(error + (b[i].upper - b[i].lower));
    }
  }

  double largest_norm() const { return up(length_above(w) + error); }

  /// Encloses row x state. @param row_norm upper bound on |row|.
  Interval value(const std::vector<Interval>& row, double row_norm) const {
    const double missed = up(row_norm * error);
    return dot(row, w) + Interval(-missed, missed);
  }

  void advance(const Step& step) {
    std::vector<double> next(w.size());
    Interval missed;
    for (std::size_t i = 0; i < w.size(); ++i) {
      Interval total;
      for (std::size_t j = 0; j < w.size(); ++j) total += step.matrix(i, j) * w[j];
      next[i] = total.lower + (total.upper - total.lower) / 2;
      const double half = up(std::max(total.upper - next[i], next[i] - total.lower));
      missed += Interval(half) * half;
    }
    error = up(up(error + sqrt(missed).upper) + up(step.remainder * length_above(w)));
    w = std::move(next);
  }
};

double frobenius_above(const IntervalMatrix& A) {
  Interval squares;
  for (std::size_t i = 0; i < A.size(); ++i) {
    for (std::size_t j = 0; j < A.size(); ++j) {
      const double entry = A(i, j).mag();
      squares += Interval(entry) * entry;
    }
  }
  return sqrt(squares).upper;
}

}  // namespace

double KernelCells::total() const {
  double sum = 0;
  for (const double x : integral) sum = up(sum + x);
  return sum;
}

Interval KernelCells::whole_net(std::size_t k) const {
  Interval result = net[k];
  for (const std::vector<double>& mode : modes) result += Interval(-std::abs(mode[k]), std::abs(mode[k]));
  return result;
}

std::optional<KernelCells> kernel_cells(const TransferFunction& y, double cell_s, int count) {
  if (y.delay_s > 0) return std::nullopt;
  const Polynomial denominator = sum(y.denominator, y.feedback);
  return kernel_cells(IntervalVector(y.numerator.begin(), y.numerator.end()),
                      IntervalVector(denominator.begin(), denominator.end()), cell_s, count);
}

std::optional<KernelCells> kernel_cells(const IntervalVector& numerator, const IntervalVector& denominator,
                                        double cell_s, int count) {
  const std::optional<ContractingSystem> system = contracting(numerator, denominator);
  if (!system) return std::nullopt;
  const double norm_A = frobenius_above(system->A);
  const int parts = static_cast<int>(std::ceil(cell_s / std::min(kLargestStep_s, 0.5 / norm_A)));
  const double step_s = cell_s / parts;  // parts step_s equals cell_s up to round-off, which is covered below
  const Step step = exponential(system->A, step_s, up(norm_A * step_s));
  const double bend_norm = norm_above(system->rows[3]);

  const double row_norm = norm_above(system->rows[1]);
  EnclosedState state(system->b);
  const double steepest = up(norm_above(system->rows[2]) * state.largest_norm());  // sup |y'|
  KernelCells cells;
  Interval last = state.value(system->rows[1], row_norm);
  for (int k = 0; k < count; ++k) {
    double integral = 0;
    double largest = 0;
    Interval net;
    for (int p = 0; p < parts; ++p) {
      // The norm of the state decreases, so its value at the start of the step bounds y'' over the whole step.
      const double bend = up(up(bend_norm * state.largest_norm()) * up(step_s * step_s));
      state.advance(step);
      const Interval now = state.value(system->rows[1], row_norm);
      largest = std::max(largest, up(std::max(last.mag(), now.mag()) + bend / 8));
      integral = up(integral + up(step_s * up(up(last.mag() + now.mag()) / 2 + bend / 12)));
      const double bent = up(bend / 12);
      net += Interval(step_s) * ((last + now) * Interval(0.5) + Interval(-bent, bent));
      last = now;
    }
    cells.integral.push_back(integral);
    cells.net.push_back(net);
    cells.largest.push_back(largest);
    cells.peak = std::max(cells.peak, largest);
  }
  // The cell boundaries k cell_s and sums of step_s differ by a few units in the last place of the time; |y| is at most
  // `peak`.
  for (std::size_t k = 0; k < cells.integral.size(); ++k) {
    const double shift_s = 1e-15 * (parts + 4) * static_cast<double>(k + 2) * cell_s;
    const double more = 1e-13 * cells.integral[k] + cells.peak * shift_s;
    cells.integral[k] = up(cells.integral[k] + up(more));
    cells.net[k] += Interval(-more, more) * Interval(1 + 1e-12);
    cells.largest[k] = up(cells.largest[k] + up(steepest * shift_s * (1 + 1e-12)));
  }
  if (!std::isfinite(cells.peak)) return std::nullopt;
  return cells;
}

std::vector<double> convolved(const KernelCells& kernel, const std::vector<double>& sizes) {
  if (kernel.integral.size() < sizes.size())
    throw std::invalid_argument("convolved: the kernel is too short");
  const std::size_t count = sizes.size();
  std::vector<double> larger(count);
  for (std::size_t k = 0; k < count; ++k) larger[k] = k == 0 ? sizes[0] : std::max(sizes[k], sizes[k - 1]);
  // Sums of nonnegative numbers have a relative round-off error of at most `count` units.
  const double rounding = 1 + 4e-16 * static_cast<double>(count + 4);
  std::vector<double> result(count);
  for (std::size_t n = 0; n < count; ++n) {
    double total = 0;
    for (std::size_t m = 0; m <= n; ++m) total += kernel.integral[m] * larger[n - m];
    result[n] = total * rounding;
  }
  return result;
}

Interval answer(const KernelCells& kernel, std::size_t m, Interval w) {
  const double centre = w.lower + (w.upper - w.lower) / 2;
  const double radius = up(std::max(w.upper - centre, centre - w.lower));
  const double spread = up(kernel.integral[m] * up(radius));
  return kernel.whole_net(m) * centre + Interval(-spread, spread);
}

Interval answer_to_past(const KernelCells& kernel, const std::vector<Interval>& w, std::size_t n) {
  // Sums the terms of answer() with rounding to nearest: each has an error of a few units, their sum one of n units of
  // the sum of magnitudes.
  double centre = 0;
  double spread = 0;
  double size = 0;
  std::vector<double> by_mode(kernel.modes.size(), 0.0);
  for (std::size_t m = 1; m <= n; ++m) {
    const Interval both = hull(w[n - m], m < n ? w[n - m - 1] : Interval(0));
    const double c = both.lower + (both.upper - both.lower) / 2;
    const double radius = std::max(both.upper - c, c - both.lower);
    const Interval& net = kernel.net[m];
    const double g = net.lower + (net.upper - net.lower) / 2;
    centre += g * c;
    size += std::abs(g * c);
    for (std::size_t i = 0; i < by_mode.size(); ++i) {
      by_mode[i] += kernel.modes[i][m] * c;
      size += std::abs(kernel.modes[i][m] * c);
    }
    spread += kernel.integral[m] * radius + std::max(net.upper - g, g - net.lower) * std::abs(c);
  }
  for (const double x : by_mode) spread += std::abs(x);
  spread += 4e-16 * static_cast<double>(n + 8) * (size + spread) + 1e-300;
  return {down(centre - spread), up(centre + spread)};
}

}  // namespace swarmcert::stability
