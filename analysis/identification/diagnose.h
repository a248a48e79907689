/// @file Which effect is missing: selection, refinement of shape parameters, check against closed-loop bias, remainder.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/identification/findings.h"
#include "analysis/identification/injection.h"
#include "analysis/identification/instrument.h"
#include "analysis/identification/remainder.h"
#include "analysis/identification/scan/formulas.h"

namespace swarmcert::identification {

/// A found effect in the words of the model file.
struct Missing {
  std::string effect, equivalence_class, kind, excitation;
  Finding finding;
  std::map<std::string, double> parameters;
  std::map<std::string, Interval> intervals;  ///< 90 %, statistical
  std::vector<std::string> coefficients;      ///< names, in the order of finding.model_form and `instrument`
  std::vector<InstrumentedValue> instrument;  ///< of each coefficient; empty where there is no check
  std::vector<stability::EffectSpec> specs;   ///< for the model file
};

/// 1 + ratio, with a constant force beside it, by least squares and by instrument: the controller's answer to
/// disturbances biases the first.
struct ThrustScale {
  bool is_known = false;
  InstrumentedValue value;
};

/// Remainder::ratio from which on small effects cannot be told from parts of what no effect explains. Source: 20
/// simulated flights in gusts and foreign forces had 56 .. 320, recorded flights of two vehicles 9 .. 21.
inline constexpr double kLoudRatio = 25;

struct Diagnosis {
  std::string kind;
  std::string vehicle;   ///< of which alone the flights are; empty: of all of the kind
  std::string too_poor;  ///< why there is no answer; empty if there is one
  std::vector<Missing> ranking;
  std::vector<std::string> contradicted;  ///< selected, but only as the controller's answer to something else
  /// Selected, but no match for what is left: where the remainder stands out by more than kLoudRatio, an effect counts
  /// only if it takes a tenth of the mean square, and one of the thrust only if set points confirm its size.
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
  int flights = 0;
  std::vector<std::string> problems;  ///< Coverage::problems
};

/// Diagnoses the model of one kind of vehicle on the flights `which`.
Diagnosis diagnose(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                   int jobs, const residuals::Progress& progress);

/// As diagnose(), the ranking only.
std::vector<Missing> missing_effects(const residuals::Inputs& inputs, const std::string& kind,
                                     const std::vector<int>& which, int jobs,
                                     const residuals::Progress& progress);

/// `names` fitted jointly on the flights `which`, in this order, with refined thetas; no test of acceptance.
std::vector<Missing> fit_effects(const residuals::Inputs& inputs, const std::string& kind,
                                 const std::vector<std::string>& names, const std::vector<int>& which,
                                 int jobs, const residuals::Progress& progress);

/// The numbers of `missing` for with_effects().
std::vector<stability::EffectSpec> specs_of(const std::vector<Missing>& missing);

/// All flights.
std::vector<int> every_flight(const residuals::Inputs& inputs);

}  // namespace swarmcert::identification
