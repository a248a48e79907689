/// @file A truth measured in flights: the force that a model leaves out, by the position of the neighbour, as a range
/// that a further flight keeps with a stated probability.
///
/// A third of the flights defines the shape: in each cell the midpoint m and the half-width w of the residual. Each
/// other flight gives a score: the largest |residual - m|/w along any axis over all its cells. The conformal threshold
/// s of the scores makes the ranges m -+ s w. If a further flight is exchangeable with these flights, all its residuals
/// stay in the ranges with at least the probability `level`. This is one statement about the whole flight and all
/// cells, so it needs no assumption on the dependence between samples. A tube that holds for every force in the ranges
/// therefore holds for that flight with at least this probability.
#pragma once

#include <string>

#include "analysis/tracking/conformal.h"
#include "analysis/tracking/tube/residual_envelope.h"

namespace swarmcert::analysis {

struct MeasuredTruth {
  ResidualEnvelope envelope;
  ConformalThreshold promise;  ///< the threshold is s
  int shape_flights = 0;
  double mean_s = 0;  ///< averaging time of the residuals
};

/// Reads flights[].residual_by_place of a result of compare. The midpoint of a cell is its own; its half-width is the
/// largest of its own, those of the adjacent cells, and a share of the largest along the axis, because few records
/// show less of the noise than many. The share is the one that makes the ranges narrowest when each shape flight is
/// left out once; no other flight influences it. Cells without a shape flight get the hull of all cells, scaled
/// likewise.
/// @param kind kind of the vehicles; other vehicles are left out.
/// @param level in (0, 1).
/// @throws files::InputError if the file is not such a result or has too few flights.
MeasuredTruth read_measured_truth(const std::string& path, const std::string& kind, double level);

}  // namespace swarmcert::analysis
