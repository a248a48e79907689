/// @file Upper bounds on the integral of a response's absolute value, cell by cell in time. Not for users.
#pragma once

#include <optional>
#include <vector>

#include "nn/base/interval.h"
#include "stability/bounds/enclosures/interval_matrix.h"
#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::stability {

/// Upper bounds, in real arithmetic, for y(t) = L^-1[Y] at t > 0; or for every y of a family, see lag_range_cells.h.
struct KernelCells {
  std::vector<double> integral;  ///< at least int |y| over [k cell_s, (k + 1) cell_s]
  /// Contains int y over the same cell, less the sum of x_m modes[m][k].
  std::vector<Interval> net;
  /// Of a family: each y has x_m in [-1, 1] of its own, the same for all its cells.
  std::vector<std::vector<double>> modes;
  std::vector<double> largest;              ///< at least sup |y| over the same cell
  double peak = 0;                          ///< at least sup |y| over all of them
  double total() const;                     ///< at least int |y| over all of them
  Interval whole_net(std::size_t k) const;  ///< contains int y over cell k, whichever y it is
};

/// Steps of a millisecond or less in coordinates in which the system contracts (contracting_system.h), so that errors
/// of the computed state never grow; within a step |y| <= max of both ends + step^2/8 sup|y''|.
/// @param y without a delay, strictly proper.
/// @returns nothing where stability could not be verified.
std::optional<KernelCells> kernel_cells(const TransferFunction& y, double cell_s, int count);
/// The same of the transfer functions with these coefficients, in ascending powers.
std::optional<KernelCells> kernel_cells(const IntervalVector& numerator, const IntervalVector& denominator,
                                        double cell_s, int count);

/// sup |e| for e = y * w from rest, up to the end of each cell, where |w| <= sizes[k] in cell k, time in the same
/// cells:
///   |e(t)| <= sum_m integral[m] max(sizes[n - m], sizes[n - m - 1])   for t in cell n,
/// because t - u lies in one of these two cells for u in cell m. Rounded up. It is at most |y|_1 sup|w|, and near
/// |y|_oo int|w| for a short w: both bounds at once.
/// @returns one bound per cell of `sizes`. Precondition: as many cells in the kernel.
std::vector<double> convolved(const KernelCells& kernel, const std::vector<double>& sizes);

/// Contains int y(u) w(u) du over cell m for every w with values in `w`: with c + [-r, r] = w it is
///   c (net[m] + sum of x_i modes[i][m]) + [-r, r] integral[m].
Interval answer(const KernelCells& kernel, std::size_t m, Interval w);

/// Contains what cells 1, 2, ... of the kernel add to (y * w)(t) for t in cell n, where w is 0 before the start and in
/// w[k] in cell k < n: for u in cell m, t - u lies in cell n - m or n - m - 1. Each mode is summed up over the cells
/// before its x_i is taken to be any. All of (y * w)(t) is this and answer()
/// of cell 0 to the hull of w[n] and w[n - 1].
Interval answer_to_past(const KernelCells& kernel, const std::vector<Interval>& w, std::size_t n);

}  // namespace swarmcert::stability
