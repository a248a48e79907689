#include "stability/bounds/enclosures/lag_range_cells.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::stability {
namespace {

/// Distance of the lags in the grid, relative to the middle of the interval; the interpolation error of responses is
/// about its square.
constexpr double kDistance = 0.025;

/// Returns a + tau b.
IntervalVector at(const IntervalVector& a, const IntervalVector& b, double tau) {
  IntervalVector result = a;
  result.resize(std::max(a.size(), b.size()));
  for (std::size_t i = 0; i < b.size(); ++i) result[i] += Interval(tau) * b[i];
  return result;
}

/// Bounds kernel * y, given the integrals of |kernel| over cells and |y| <= sizes.
std::vector<double> answered(const std::vector<double>& integral, const std::vector<double>& sizes) {
  KernelCells kernel;
  kernel.integral = integral;
  return convolved(kernel, sizes);
}

}  // namespace

LagRangeCells::LagRangeCells(const IntervalVector& fixed, const IntervalVector& per_lag, Interval lag_s,
                             double cell_s, int count)
    : cell_s_(cell_s), count_(count) {
  const double width_s = per_lag.empty() ? 0 : lag_s.upper - lag_s.lower;
  // An even number, so that the middle of the interval is a lag of the grid.
  const int steps = 2 * static_cast<int>(std::ceil(width_s / (2 * kDistance * middle(lag_s))));
  for (int j = 0; j <= steps; ++j) {
    Node node;
    node.lag_s = j == 0       ? lag_s.lower
                 : j == steps ? lag_s.upper
                              : lag_s.lower + width_s * static_cast<double>(j) / steps;
    node.denominator = at(fixed, per_lag, node.lag_s);
    if (steps > 0) {
      node.rest = kernel_cells(fixed, node.denominator, cell_s, count);
      is_refused_ = is_refused_ || !node.rest;
    }
    nodes_.push_back(std::move(node));
  }
  for (std::size_t j = 0; !is_refused_ && j + 1 < nodes_.size(); ++j) {
    const std::optional<std::vector<double>> largest = largest_onwards(j, *nodes_[j].rest, nullptr);
    is_refused_ = !largest;
    if (!largest) return;
    for (const double x : *largest) nodes_[j].rest_onwards.push_back(up(up(cell_s * (1 + 1e-12)) * x));
  }
}

/// Bounds sup |y_tau| over each cell for tau from node j to the next. @param by_lag cells of n'/D_j; null: 0.
std::optional<std::vector<double>> LagRangeCells::largest_onwards(std::size_t j, const KernelCells& at_node,
                                                                  const KernelCells* by_lag) const {
  const std::vector<double>& rest = nodes_[j].rest->integral;
  // (1 + theta) |y_tau| <= |y_j| + theta (..): for the maximum over theta the divisor is at least 1.
  const Interval theta = Interval(step_s(j)) / nodes_[j].lag_s;
  const double again = (theta * rest[0]).upper;
  const Interval left = Interval(1) - Interval(again);
  if (!left.is_positive()) return std::nullopt;
  std::vector<double> result, larger;  // of |y_tau| in a cell; the maximum of this cell and the one before
  for (std::size_t n = 0; n < rest.size(); ++n) {
    double past = 0;
    for (std::size_t m = 1; m <= n; ++m) past += rest[m] * larger[n - m];
    past *= 1 + 4e-16 * static_cast<double>(n + 4);
    Interval given = Interval(at_node.largest[n]) + theta * past;
    if (by_lag != nullptr) given += Interval(step_s(j)) * by_lag->largest[n];
    // s <= given + again max(s, before)
    const double before = n == 0 ? 0 : result.back();
    result.push_back(std::max((given / left).upper, (given + Interval(again) * before).upper));
    larger.push_back(std::max(result.back(), before));
  }
  return result;
}

/// Bounds the error of linear interpolation of y_tau from node j to the next, over each cell.
std::optional<std::vector<double>> LagRangeCells::missed_onwards(std::size_t j, const KernelCells& at_node,
                                                                 const KernelCells* by_lag) const {
  const std::optional<std::vector<double>> largest = largest_onwards(j, at_node, by_lag);
  if (!largest) return std::nullopt;
  std::optional<std::vector<double>> largest_by_lag;
  if (by_lag != nullptr) {
    largest_by_lag = largest_onwards(j, *by_lag, nullptr);
    if (!largest_by_lag) return std::nullopt;
  }
  const std::vector<double>& rest = nodes_[j].rest_onwards;
  // Bound on |tau d y_tau/d tau|.
  std::vector<double> change = answered(rest, *largest);
  for (std::size_t n = 0; n < change.size(); ++n) {
    change[n] = up(change[n] + (*largest)[n]);
    if (largest_by_lag) change[n] = up(change[n] + up(nodes_[j + 1].lag_s * (*largest_by_lag)[n]));
  }
  std::vector<double> result = answered(rest, change);
  const Interval distance = Interval(step_s(j)) / nodes_[j].lag_s;
  for (std::size_t n = 0; n < result.size(); ++n)
    result[n] = (distance * distance * (Interval(result[n]) + change[n]) / Interval(4)).upper;
  return result;
}

std::optional<KernelCells> LagRangeCells::cells(const IntervalVector& fixed,
                                                const IntervalVector& per_lag) const {
  if (is_refused_) return std::nullopt;
  std::vector<KernelCells> at_nodes;
  std::vector<std::vector<double>> missed;
  for (std::size_t j = 0; j < nodes_.size(); ++j) {
    const Node& node = nodes_[j];
    const auto of_node = kernel_cells(at(fixed, per_lag, node.lag_s), node.denominator, cell_s_, count_);
    if (!of_node) return std::nullopt;
    at_nodes.push_back(*of_node);
    if (j + 1 == nodes_.size()) break;
    std::optional<KernelCells> by_lag;
    if (!per_lag.empty()) {
      by_lag = kernel_cells(per_lag, node.denominator, cell_s_, count_);
      if (!by_lag) return std::nullopt;
    }
    const auto of_step = missed_onwards(j, *of_node, by_lag ? &*by_lag : nullptr);
    if (!of_step) return std::nullopt;
    missed.push_back(*of_step);
  }
  return at_nodes.size() == 1 ? at_nodes.front() : united(at_nodes, missed);
}

KernelCells LagRangeCells::united(const std::vector<KernelCells>& at_nodes,
                                  const std::vector<std::vector<double>>& missed) const {
  KernelCells result = at_nodes.front();
  const std::size_t count = result.net.size();
  const std::size_t last = at_nodes.size() - 1;
  // The lags mapped to x in [-1, 1]; exact at the ends, and hence within the range between them.
  const Interval low(nodes_.front().lag_s), width = Interval(nodes_.back().lag_s) - low;
  std::vector<Interval> places;
  for (const Node& node : nodes_)
    places.push_back(Interval(2) * (Interval(node.lag_s) - low) / width - Interval(1));
  places.front() = -1;
  places.back() = 1;
  double distance = 0;
  for (std::size_t j = 0; j < last; ++j) distance = std::max(distance, (places[j + 1] - places[j]).upper);
  result.modes.assign(2, std::vector<double>(count));
  result.peak = 0;
  for (std::size_t n = 0; n < count; ++n) {
    // Coefficients of x and 2 x^2 - 1. Any values are valid; these leave a small remainder.
    const double from = middle(at_nodes.front().net[n]), to = middle(at_nodes.back().net[n]);
    const double line = (to - from) / 2;
    const double parabola = ((from + to) / 2 - middle(at_nodes[last / 2].net[n])) / 2;
    result.modes[0][n] = line;
    result.modes[1][n] = parabola;
    double most = 0;
    for (const std::vector<double>& of_step : missed) most = std::max(most, of_step[n]);
    for (std::size_t j = 0; j <= last; ++j) {
      const Interval x = places[j];
      const Interval left =
          at_nodes[j].net[n] - Interval(line) * x - Interval(parabola) * (Interval(2) * x * x - Interval(1));
      result.net[n] = j == 0 ? left : hull(result.net[n], left);
      result.integral[n] = std::max(result.integral[n], at_nodes[j].integral[n]);
      result.largest[n] = std::max(result.largest[n], at_nodes[j].largest[n]);
    }
    const double integral = up(up(cell_s_ * (1 + 1e-12)) * most);
    // Between the lags of the grid, 2 x^2 differs from its linear interpolation by at most distance^2/2.
    const double bent = (Interval(std::abs(parabola)) * distance * distance / Interval(2)).upper;
    result.net[n] += Interval(-integral, integral) + Interval(-bent, bent);
    result.integral[n] = up(result.integral[n] + integral);
    result.largest[n] = up(result.largest[n] + most);
    result.peak = std::max(result.peak, result.largest[n]);
  }
  return result;
}

}  // namespace swarmcert::stability
