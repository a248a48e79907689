/// @file The variables and pairs of variables over which the scan fits curves.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/scan/curve_fit.h"

namespace swarmcert::identification {

/// One or two variables over which a curve or map is fitted.
struct Abscissa {
  std::string name;
  std::vector<ScanVariable> variables;  ///< one or two; empty: relative positions of neighbours
  int lag = 0;                          ///< of neighbours, in steps of NeighbourPlaces::kLag_s
  bool is_answer = false;
  bool in_world = true, in_body = true;
  std::vector<int> knots;    ///< numbers of knots to try, for each variable
  bool over_ground = false;  ///< absolute velocity of a neighbour, not relative to the vehicle
};

/// A curve over an abscissa with a given number of knots.
struct Curve {
  std::vector<Knots> knots;
  std::vector<SparseRow> rows, commanded;  ///< commanded: empty if setpoints give no values
  int columns = 0;
};

/// Returns all abscissas that the scan tries; relative positions of neighbours only if there are any.
std::vector<Abscissa> abscissas(const ScanSamples& samples);

/// Returns the curve; it has no columns if the variable is unknown or constant.
/// @param knots number for each variable
Curve curve_over(const ScanSamples& samples, const Abscissa& abscissa, int knots);

}  // namespace swarmcert::identification
