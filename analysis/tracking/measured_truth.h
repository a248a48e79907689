/// @file A truth that flights measured: what a model leaves of the force, by the place of the neighbour, as a range
/// that a further flight keeps with a stated probability.
///
/// A third of the flights gives the shape: in each cell the middle m and the half-width w of the residual. Each other
/// flight gives a score: the largest |residual - m|/w along any axis over all its cells. The conformal threshold s of
/// the scores makes the ranges m -+ s w. If a further flight is exchangeable with these flights, all its residuals stay
/// in them with at least the level's probability: one statement for the whole flight and all cells, so that nothing is
/// said of the dependence of samples. A tube that holds for every force in the ranges then holds for that flight with
/// at least this probability.
#pragma once

#include <string>

#include "analysis/tracking/conformal.h"
#include "analysis/tracking/tube/residual_envelope.h"

namespace swarmcert::analysis {

struct MeasuredTruth {
  ResidualEnvelope envelope;
  ConformalThreshold promise;  ///< its threshold is s
  int shape_flights = 0;
  double mean_s = 0;  ///< over which residuals were averaged
};

/// flights[].residual_by_place of a result of compare. The middle of a cell is its own; its width is the largest of its
/// own, of those of the cells around it and of a share of the largest along the axis, as few records show less of the
/// noise than many. The share is the one that makes the ranges narrowest when each flight for the shape is left out
/// once; no other flight has a say. Cells without a flight for the shape get the hull of all cells, scaled
/// likewise.
/// @param kind of the vehicles; others are left out. @param level in (0, 1).
/// @throws files::InputError where the file is no such result or has too few flights.
MeasuredTruth read_measured_truth(const std::string& path, const std::string& kind, double level);

}  // namespace swarmcert::analysis
