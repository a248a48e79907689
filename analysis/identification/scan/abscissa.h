/// @file The variables and pairs of variables that the scan lays curves over.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/scan/curve_fit.h"

namespace swarmcert::identification {

/// Everything that a curve can be laid over.
struct Abscissa {
  std::string name;
  std::vector<ScanVariable> variables;  ///< one or two; empty: places of neighbours
  int lag = 0;                          ///< of neighbours, in steps of NeighbourPlaces::kLag_s
  bool is_answer = false;
  bool in_world = true, in_body = true;
  std::vector<int> knots;    ///< how many to try, for each variable
  bool over_ground = false;  ///< velocity of a neighbour, not minus the vehicle's
};

/// A curve over an abscissa with so many knots.
struct Curve {
  std::vector<Knots> knots;
  std::vector<SparseRow> rows, commanded;  ///< commanded: empty where set points say nothing
  int columns = 0;
};

/// All that the scan tries; places of neighbours only where there are any.
std::vector<Abscissa> abscissas(const ScanSamples& samples);

/// @param knots of each variable. Without columns where the variable is unknown or does not vary.
Curve curve_over(const ScanSamples& samples, const Abscissa& abscissa, int knots);

}  // namespace swarmcert::identification
