/// @file kernel_cells() for all responses of a loop whose lag lies in an interval. Not for users.
#pragma once

#include <optional>
#include <vector>

#include "stability/bounds/enclosures/kernel_cells.h"

namespace swarmcert::stability {

/// Cells whose bounds hold for y_tau(t) = L^-1[Y_tau], Y_tau = (n + tau n')/(d + tau d'), for every constant tau of an
/// interval.
///
/// Between two neighbouring lags of a grid, the error of linear interpolation of y_tau in tau is at most (distance^2/8)
/// sup |d^2 y_tau/d tau^2|. With D = d + tau d' and R = d/D, which is strictly proper, tau d'/D is 1 - R, so that
///   d^2 Y/d tau^2 = (2/tau^2) (1 - R) ((1 - R) Y - tau n'/D).
/// Y, R and n'/D themselves are bounded between a lag tau_j and the next, tau = (1 + theta) tau_j, cell by cell from
///   (1 + theta) y_tau = y_j + theta tau_j L^-1[n'/D_j] + theta r_j * y_tau.
/// The dependence of the nets on tau goes into KernelCells::modes, as a line and a parabola.
class LagRangeCells {
 public:
  /// @param fixed, per_lag  d and d', in ascending powers; d' has the higher degree, or is empty for no lag.
  /// @param lag_s  tau; positive unless d' is empty. For a point interval the result is kernel_cells().
  LagRangeCells(const IntervalVector& fixed, const IntervalVector& per_lag, Interval lag_s, double cell_s,
                int count);

  /// @param fixed, per_lag  n and n'; Y_tau and n'/(d + tau d') are strictly proper.
  /// @returns nothing if stability at a lag of the grid could not be verified, or the interval is too wide.
  std::optional<KernelCells> cells(const IntervalVector& fixed, const IntervalVector& per_lag = {}) const;

 private:
  /// One lag of the grid.
  struct Node {
    double lag_s = 0;
    IntervalVector denominator;
    std::optional<KernelCells> rest;   ///< r_j; missing if there is only one lag
    std::vector<double> rest_onwards;  ///< at least int |r_tau| over each cell, tau from here to the next lag
  };
  /// Returns the distance from node j to the next, rounded up.
  double step_s(std::size_t j) const { return up(nodes_[j + 1].lag_s - nodes_[j].lag_s); }
  std::optional<std::vector<double>> largest_onwards(std::size_t j, const KernelCells& at_node,
                                                     const KernelCells* by_lag) const;
  std::optional<std::vector<double>> missed_onwards(std::size_t j, const KernelCells& at_node,
                                                    const KernelCells* by_lag) const;
  KernelCells united(const std::vector<KernelCells>& at_nodes,
                     const std::vector<std::vector<double>>& missed) const;

  std::vector<Node> nodes_;
  double cell_s_;
  int count_;
  bool is_refused_ = false;
};

}  // namespace swarmcert::stability
