/// @file Shape parameters off the grid with intervals: Gauss-Newton steps on coefficients and shapes jointly.
#pragma once

#include <vector>

#include "analysis/identification/findings.h"
#include "analysis/identification/passes.h"

namespace swarmcert::identification {

/// A selected effect with the numbers that fit best.
struct Refined {
  Candidate candidate;  ///< its only theta is the best one
  std::vector<double> coefficients, theta;
  /// 90 %, from the jackknife of coefficients and free shapes together; equal ends where a number was held.
  std::vector<Interval> linear_intervals, shape_intervals;
};

/// Refines `members` of `grams` jointly. Derivatives with respect to shapes are differences of columns; steps are
/// bounded, and a weak pull towards the start keeps shapes in place about which the flights say nothing. Flights of
/// more than 400 000 records get one step.
std::vector<Refined> refine(const Passes& passes, const Grams& grams, const Members& members);

/// `refined` with the times of lags and delays as the innovations of the residual show them (whitening.h), and
/// everything else fitted anew beside them; as it is where none is refined, or what is left is white.
std::vector<Refined> with_innovations(const Passes& passes, std::vector<Refined> refined);

/// `found`, as `seen`, an excerpt of the flights of `all`, gave it, fitted to all of them from there: lags and delays
/// to the innovations again, with intervals that allow for as much of what whitening removes as with_innovations().
std::vector<Refined> refit(const Passes& all, const Passes& seen, const std::vector<Refined>& found);

}  // namespace swarmcert::identification
