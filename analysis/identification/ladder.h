/// @file Adding effects to a model, one step after the other, with errors on flights that the fit has not seen.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"

namespace swarmcert::identification {

/// Which flights are for what. By flight, never by time within one: neighbouring records are alike.
struct Split {
  std::vector<int> fit, select, test;
  bool by_flight = true;  ///< false: too few flights, and all are used for everything
};

/// Of every five flights, in order of scenarios and runs, three are for the fit, one to select, one to test; of three
/// or four flights the last is for the test and the one before to select.
Split split_flights(const residuals::Inputs& inputs);

struct Step {
  std::string effect;                                         ///< "nominal" for the first
  double fit_rmse_N = 0, select_rmse_N = 0, test_rmse_N = 0;  ///< of the vector residual
  bool accepted = true;
  std::string reason;  ///< why it was refused
};

struct Ladder {
  Split split;
  std::vector<Step> steps;
  stability::Model model;       ///< with what was accepted, or with everything where `keep` asked for it
  std::vector<Missing> fitted;  ///< what was fitted, accepted or not
  double noise_floor_N = 0;     ///< of the test flights: what no model can remove
};

struct LadderOptions {
  bool automatic = true;
  std::vector<std::string> effects;  ///< in this order, unless automatic
  bool keep_anyway = false;
};

/// Fits and accepts effects for inputs' only model: an effect is accepted if the RMSE of the select flights falls by
/// at least half a percent. Coefficients of all effects that were accepted so far are fitted anew with each step.
Ladder climb(const residuals::Inputs& inputs, const LadderOptions& options, int jobs,
             const residuals::Progress& progress);

}  // namespace swarmcert::identification
