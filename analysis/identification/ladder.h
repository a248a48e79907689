/// @file Adding effects to a model, one step after the other, with errors on flights that the fit has not seen.
#pragma once

#include <optional>
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

struct Ladder {
  Split split;
  std::vector<stability::LadderRow> earlier;  ///< of the model that was given
  std::vector<stability::LadderRow> rows;     ///< "nominal": the model that was given; then what was tried
  stability::Model model;                     ///< with what was accepted, and with all rows
  std::vector<Missing> fitted;                ///< what was fitted and accepted, as of the last row
  bool any_accepted = false;
  std::string too_poor;   ///< why nothing was fitted; empty if something was. The rest is then empty as well.
  bool is_tested = true;  ///< false: the flights to test have no usable record, and test_rmse_N is 0
  int test_looks = 0;     ///< including this ladder
  std::vector<std::string> problems;  ///< Coverage::problems
};

struct LadderOptions {
  bool automatic = true;
  std::vector<std::string>
      effects;  ///< in this order, unless automatic; also formulas and shapes, see is_proposal()
  bool keep_anyway = false;
  std::optional<Split> split;  ///< split_flights() if not given
};

/// Fits and accepts effects for inputs' only model, where the flights suffice: an effect is accepted if the RMSE of the
/// select flights falls by at least half a percent. Coefficients of all effects that were accepted so far are fitted
/// anew with each step. The test flights are scored once, after the last step: their errors decide nothing.
Ladder climb(const residuals::Inputs& inputs, const LadderOptions& options, int jobs,
             const residuals::Progress& progress);

/// `model` one accepted row back: the effect of that row is gone, the others have the values they had before it.
/// @throws files::InputError if the model has no row to go back to.
stability::Model undone(const stability::Model& model);

}  // namespace swarmcert::identification
