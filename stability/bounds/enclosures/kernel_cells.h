/// @file Upper bounds on the integral of a response's absolute value, cell by cell in time. Not for users.
#pragma once

#include <optional>
#include <vector>

#include "nn/base/interval.h"
#include "stability/bounds/enclosures/interval_matrix.h"

namespace swarmcert::stability {

/// Upper bounds, in real arithmetic, for y(t) = L^-1[Y] at t > 0, or for every y of a family (see lag_range_cells.h).
struct KernelCells {
  std::vector<double> integral;  ///< upper bound on int |y| over [k cell_s, (k + 1) cell_s]
  /// Encloses int y over the same cell, less the sum of x_m modes[m][k].
  std::vector<Interval> net;
  /// For a family: each y has its own coefficients x_m in [-1, 1], the same for all its cells.
  std::vector<std::vector<double>> modes;
  std::vector<double> largest;              ///< upper bound on sup |y| over the same cell
  double peak = 0;                          ///< upper bound on sup |y| over all cells
  double total() const;                     ///< upper bound on int |y| over all cells
  Interval whole_net(std::size_t k) const;  ///< encloses int y over cell k, for every y
};

/// Computes the bounds in steps of a millisecond or less, in coordinates in which the system contracts
/// (contracting_system.h), so that errors of the computed state never grow. Within a step |y| <= max of both
/// ends + step^2/8 sup|y''|.
/// @param numerator, denominator in ascending powers, strictly proper; the bounds hold for all coefficients in them.
/// @returns nothing if stability could not be verified.
std::optional<KernelCells> kernel_cells(const IntervalVector& numerator, const IntervalVector& denominator,
                                        double cell_s, int count);

/// Bounds sup |e| for e = y * w from rest, up to the end of each cell, where |w| <= sizes[k] in cell k of the same
/// partition of time:
///   |e(t)| <= sum_m integral[m] max(sizes[n - m], sizes[n - m - 1])   for t in cell n,
/// because t - u lies in one of these two cells for u in cell m. Rounded up. The bound is at most |y|_1 sup|w|, and
/// near |y|_oo int|w| for a short w, so it combines both bounds.
/// @returns one bound per cell of `sizes`. Precondition: the kernel has as many cells.
std::vector<double> convolved(const KernelCells& kernel, const std::vector<double>& sizes);

/// Encloses int y(u) w(u) du over cell m for every function w with values in the interval `w`. With w = c + [-r, r] it
/// is
///   c (net[m] + sum of x_i modes[i][m]) + [-r, r] integral[m].
Interval answer(const KernelCells& kernel, std::size_t m, Interval w);

/// Encloses the contribution of cells 1, 2, ... of the kernel to (y * w)(t) for t in cell n, where w is 0 before the
/// start and in w[k] in cell k < n: for u in cell m, t - u lies in cell n - m or n - m - 1. Each mode is summed over
/// the cells before its x_i is replaced by [-1, 1]. Adding answer() of cell 0 to the hull of w[n] and w[n - 1] gives
/// all of (y * w)(t).
Interval answer_to_past(const KernelCells& kernel, const std::vector<Interval>& w, std::size_t n);

}  // namespace swarmcert::stability
