/// @file Which effect is missing: selection, refinement of thetas, and what is left.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/identification/selection.h"
#include "analysis/residuals/comparison.h"

namespace swarmcert::identification {

/// A found effect in the words of the model file.
struct Missing {
  std::string effect, equivalence_class, kind, excitation;
  Finding finding;
  stability::EffectSpec spec;  ///< with values and 90 % intervals
  int flights = 0;             ///< in which it was in support
};

/// What no effect of the library explains.
struct Remainder {
  bool flag = false;
  double ratio = 0;  ///< largest over the axes of Spectrum::low_band_to_floor(); 0 where there is no spectrum
  std::vector<std::string> depends_on;  ///< variables over which its mean varies most
};

struct Diagnosis {
  std::string kind;
  bool inconclusive = false;  ///< fewer than ten blocks of 2 s: no answer
  std::vector<Missing> ranking;
  std::vector<Detectable> detectable;
  Remainder remainder;
  double rmse_before_N = 0, rmse_after_N = 0;  ///< cross-validated
  std::size_t records = 0, blocks = 0;
};

/// Diagnoses the model of one kind of vehicle on the flights `which`.
Diagnosis diagnose(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                   int jobs, const residuals::Progress& progress);

/// `names` fitted jointly on the flights `which`, in this order, with refined thetas; no test of acceptance.
std::vector<Missing> fit_effects(const residuals::Inputs& inputs, const std::string& kind,
                                 const std::vector<std::string>& names, const std::vector<int>& which,
                                 int jobs, const residuals::Progress& progress);

/// `model` with `specs`; an effect that the model has already is increased instead.
stability::Model with_effects(const stability::Model& model, const std::vector<stability::EffectSpec>& specs);

/// All flights.
std::vector<int> every_flight(const residuals::Inputs& inputs);

}  // namespace swarmcert::identification
