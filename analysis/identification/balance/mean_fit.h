/// @file Fits to means of blocks of flight, with intervals that allow for neighbours that err alike.
#pragma once

#include <vector>

namespace swarmcert::identification {

/// A number, and half its 90 % interval.
struct MeanFit {
  double value = 0, half = 0;
};

/// Least squares of y = value x. Scores of neighbouring numbers may be correlated: the variance counts their products
/// as well (Newey and West 1987, one lag). Precondition: as many x as y, at least two, not all x zero.
MeanFit fit_through_origin(const std::vector<double>& x, const std::vector<double>& y);

/// Mean over its standard error; 0 where the values are equal.
double mean_z(const std::vector<double>& values);

/// Whether the mean of `differences` is above zero by a one-sided t-test at 1 % for `tried` tests together. Neighbours
/// may be correlated, as in fit_through_origin(). False for fewer than eight.
bool surely_positive(const std::vector<double>& differences, int tried);

}  // namespace swarmcert::identification
