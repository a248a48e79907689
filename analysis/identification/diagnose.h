/// @file Which effect is missing: selection, refinement of shape parameters, check against closed-loop bias, remainder.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/explanation.h"
#include "analysis/identification/injection.h"

namespace swarmcert::identification {

/// 1 + ratio, with a constant force beside it, by least squares and by instrument: the controller's answer to
/// disturbances biases the first.
struct ThrustScale {
  bool is_known = false;
  InstrumentedValue value;
};

struct Diagnosis {
  std::string kind;
  std::string vehicle;   ///< of which alone the flights are; empty: of all of the kind
  std::string too_poor;  ///< why there is no answer; empty if there is one
  std::vector<Missing> ranking;
  std::vector<std::string> contradicted;  ///< selected, but only as the controller's answer to something else
  /// Selected, but no match for what is left, see explain().
  std::vector<std::string> suspected;
  std::vector<Detectable> detectable;
  Remainder remainder;
  Scan scan;                      ///< what the remainder depends on
  std::vector<Formula> formulas;  ///< for entries of `scan`, best first
  /// The same of torques and rotors, beside what the means of the torques name. Empty where logs have no rates.
  Scan balance;
  std::vector<Formula> balance_formulas;
  ThrustScale thrust_scale;
  double rmse_before_N = 0, rmse_after_N = 0;  ///< cross-validated
  std::size_t records = 0, blocks = 0;
  std::size_t searched_blocks = 0;  ///< of `blocks`: where effects were looked for, see kMostSearched
  int flights = 0;
  std::vector<std::string> problems;  ///< Coverage::problems
};

/// Blocks of 2 s that are searched: 17 minutes. Selection was measured on flights of 20 to 300 blocks, and its least
/// gain of 2 % stands out of 500 as out of ten thousand.
inline constexpr std::size_t kMostSearched = 500;

/// Diagnoses the model of one kind of vehicle on the flights `which`. Of flights of more than `most_searched` blocks,
/// names, rivals, formulas and detectable sizes come from an excerpt of about as many, stretches of the flights
/// (residuals::TrackStore); the numbers of the names, their intervals, errors and checks from all of them.
Diagnosis diagnose(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                   int jobs, const residuals::Progress& progress, std::size_t most_searched = kMostSearched);

/// As diagnose(), the ranking only.
std::vector<Missing> missing_effects(const residuals::Inputs& inputs, const std::string& kind,
                                     const std::vector<int>& which, int jobs,
                                     const residuals::Progress& progress);

/// `names` fitted jointly on the flights `which`, in this order, with refined thetas; no test of acceptance.
std::vector<Missing> fit_effects(const residuals::Inputs& inputs, const std::string& kind,
                                 const std::vector<std::string>& names, const std::vector<int>& which,
                                 int jobs, const residuals::Progress& progress);

/// All flights.
std::vector<int> every_flight(const residuals::Inputs& inputs);

}  // namespace swarmcert::identification
