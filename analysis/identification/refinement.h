/// @file Refines shape parameters off the grid, with intervals, by joint Gauss-Newton steps on coefficients and shapes.
#pragma once

#include <vector>

#include "analysis/identification/findings.h"
#include "analysis/identification/passes.h"

namespace swarmcert::identification {

/// A selected effect with its best-fitting values.
struct Refined {
  Candidate candidate;  ///< has a single theta, the best one
  std::vector<double> coefficients, theta;
  /// 90 %, from the jackknife of coefficients and free shapes together; both ends are equal for values held fixed.
  std::vector<Interval> linear_intervals, shape_intervals;
};

/// An effect with the shape at which its refinement starts.
struct Start {
  Candidate candidate;
  std::vector<double> theta;
};

/// Refines effects jointly. Derivatives with respect to shapes are finite differences of columns. Steps
/// are bounded, and a weak regularisation towards the start keeps shapes in place on which the flights carry no
/// information. Flights with more than 400 000 records get a single step.
std::vector<Refined> refine(const Passes& passes, const std::vector<Start>& starts);

/// Returns `refined` with the times of lags and delays fitted to the innovations of the residual (whitening.h), and
/// everything else fitted again beside them. Returns `refined` unchanged without a lag or delay, or if the remainder is
/// white.
std::vector<Refined> with_innovations(const Passes& passes, std::vector<Refined> refined);

/// Returns a lag or delay of the thrust with intervals wider by half the step of the log, and other effects unchanged.
/// A record does not tell when, since the last one, the command has become what it says: at once, or only now. Commands
/// that change whenever a record is written shift the time by half a step, one way or the other.
Refined widened_by_step(const Passes& passes, Refined effect);

/// Fits `found`, which was found on the excerpt `seen` of the flights of `all`, to all flights, starting from there.
/// Lags and delays are again fitted to the innovations; their intervals include the same allowance for the effect of
/// whitening as in with_innovations().
std::vector<Refined> refit(const Passes& all, const Passes& seen, const std::vector<Refined>& found);

}  // namespace swarmcert::identification
