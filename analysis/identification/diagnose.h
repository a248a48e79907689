/// @file Finds the missing effects, their values and intervals, and what remains beside them.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/evidence/detectable.h"
#include "analysis/identification/explanation.h"

namespace swarmcert::identification {

/// The factor 1 + ratio, estimated beside a constant force and all effects found, by least squares and
/// by instrumental variables; the reaction of the controller to disturbances biases the former. Unknown if a log has no
/// setpoints, or if a force is left that nothing explains.
struct ThrustScale {
  bool is_known = false;
  InstrumentedValue value;
};

struct Diagnosis {
  std::string kind;
  std::string vehicle;   ///< if all flights are of a single vehicle; empty: of all vehicles of the kind
  std::string too_poor;  ///< why no answer is given; empty if there is one
  std::vector<Missing> ranking;
  /// Found, but not named, see explain().
  std::vector<std::string> suspected;
  std::vector<std::string> at_bound;  ///< of those: not identified, because a value ended at its bound
  std::vector<evidence::Detectable> detectable;
  Remainder remainder;
  Scan scan;                      ///< the variables on which the remainder depends
  std::vector<Formula> formulas;  ///< for entries of `scan`, best first
  /// The same for torques and rotors, beside the effects found in the mean torques. Empty if logs have no rates.
  Scan balance;
  std::vector<Formula> balance_formulas;
  ThrustScale thrust_scale;
  double rmse_before_N = 0, rmse_after_N = 0;  ///< cross-validated
  std::size_t records = 0, blocks = 0;
  std::size_t searched_blocks = 0;  ///< number of `blocks` in which effects were searched, see kMostSearched
  int flights = 0;
  bool has_set_points = false;        ///< in at least one log
  std::vector<std::string> problems;  ///< Coverage::problems
};

/// Number of blocks of 2 s that are searched: 17 minutes. The selection was validated on flights with 20 to 300 blocks,
/// and its smallest gain of 2 % is as significant in 500 blocks as in ten thousand.
inline constexpr std::size_t kMostSearched = 500;

/// Diagnoses the model of one kind of vehicle on the flights `which`. For flights with more than `most_searched`
/// blocks, effects, rivals, formulas and detectable sizes are determined from an excerpt of about that many blocks
/// (residuals::TrackStore); values, intervals, errors and checks of the effects are computed from all blocks.
Diagnosis diagnose(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                   int jobs, const residuals::Progress& progress, std::size_t most_searched = kMostSearched);

/// Like diagnose(), but returns only the ranking, with a weak rotor instead of the thrust_ratio that it explains
/// (rotors/lone_rotor.h).
std::vector<Missing> missing_effects(const residuals::Inputs& inputs, const std::string& kind,
                                     const std::vector<int>& which, int jobs,
                                     const residuals::Progress& progress);

/// Fits `names` jointly to the flights `which`, in this order, with refined thetas, without an acceptance test.
std::vector<Missing> fit_effects(const residuals::Inputs& inputs, const std::string& kind,
                                 const std::vector<std::string>& names, const std::vector<int>& which,
                                 int jobs, const residuals::Progress& progress);

/// Returns the indices of all flights.
std::vector<int> every_flight(const residuals::Inputs& inputs);

}  // namespace swarmcert::identification
