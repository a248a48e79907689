/// @file Fits to means of blocks of flight, with intervals that allow for correlated neighbours.
#pragma once

#include <vector>

namespace swarmcert::identification {

/// A value and half the width of its 90 % interval.
struct MeanFit {
  double value = 0, half = 0;
};

/// Fits y = value x by least squares. Scores of neighbouring blocks may be correlated: the variance includes their
/// products (Newey and West 1987, one lag). Precondition: x and y have the same size, at least two; not all x are zero.
MeanFit fit_through_origin(const std::vector<double>& x, const std::vector<double>& y);

/// Returns the mean divided by its standard error; 0 if all values are equal.
double mean_z(const std::vector<double>& values);

/// Returns whether the mean of `differences` is positive according to a one-sided t-test at 1 %, corrected for `tried`
/// tests. Neighbours may be correlated, as in fit_through_origin(). Returns false for fewer than eight values.
bool surely_positive(const std::vector<double>& differences, int tried);

}  // namespace swarmcert::identification
