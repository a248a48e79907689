#include "stability/bounds/enclosures/kernel_cells.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "stability/bounds/enclosures/contracting_system.h"
#include "stability/bounds/enclosures/enclosed_state.h"

namespace swarmcert::stability {
namespace {

constexpr double kLargestStep_s = 1e-3;

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

std::optional<KernelCells> kernel_cells(const IntervalVector& numerator, const IntervalVector& denominator,
                                        double cell_s, int count) {
  const std::optional<ContractingSystem> system = contracting(numerator, denominator);
  if (!system) return std::nullopt;
  const double norm_A = norm_above(system->A);
  const int parts = static_cast<int>(std::ceil(cell_s / std::min(kLargestStep_s, 0.5 / norm_A)));
  const double step_s = cell_s / parts;  // parts step_s equals cell_s up to round-off, which is covered below
  const EnclosedStep step(system->A, step_s, up(norm_A * step_s));
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
  const double centre = middle(w), spread = up(kernel.integral[m] * farthest(w, centre));
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
    const double c = middle(both);
    const Interval& net = kernel.net[m];
    const double g = middle(net);
    centre += g * c;
    size += std::abs(g * c);
    for (std::size_t i = 0; i < by_mode.size(); ++i) {
      by_mode[i] += kernel.modes[i][m] * c;
      size += std::abs(kernel.modes[i][m] * c);
    }
    spread += kernel.integral[m] * farthest(both, c) + farthest(net, g) * std::abs(c);
  }
  for (const double x : by_mode) spread += std::abs(x);
  spread += 4e-16 * static_cast<double>(n + 8) * (size + spread) + 1e-300;
  return {down(centre - spread), up(centre + spread)};
}

}  // namespace swarmcert::stability
