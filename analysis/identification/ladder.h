/// @file Adds effects to a model step by step, with errors on flights that were not used for the fit.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/flight_split.h"

namespace swarmcert::identification {

struct Ladder {
  Split split;
  std::vector<std::string> flights;  ///< names of the flights, or of their parts, that `split` refers to
  std::vector<stability::LadderRow> earlier;  ///< of the given model
  std::vector<stability::LadderRow> rows;     ///< "nominal" is the given model; then the trials
  stability::Model model;                     ///< with the accepted effects, and with all rows
  bool any_accepted = false;
  std::string too_poor;   ///< why nothing was fitted; empty if something was. If set, the rest is empty.
  bool is_tested = true;  ///< false: the test flights have no usable record, and test_rmse_N is 0
  int test_looks = 0;     ///< including this ladder
  std::string stopped;    ///< why an automatic ladder tried nothing further
  std::vector<std::string> problems;  ///< Coverage::problems
};

struct LadderOptions {
  /// Tries what diagnose() finds, then formulas and shapes for what is left, see climb().
  bool automatic = true;
  /// Effects to try, in this order unless automatic; may include formulas and shapes, see is_proposal().
  std::vector<std::string> effects;
  bool keep_anyway = false;
  std::optional<Split> split;  ///< split_flights() if not given
};

/// Fits and accepts effects for the only model of `inputs`, if the flights are sufficient. An effect is accepted if the
/// RMSE on the select flights falls by at least half a percent. An automatic ladder goes on while what is left on the
/// flights to fit stands out of the noise, with the best formula for it, or else the best shape; these have no name and
/// must lower the RMSE by 1 %, and raise that of no flight to fit or to select by half a percent. Then effects that
/// turn the vehicle are added as long as one lowers the error of predicted body rates by 5 % (turning.h). Named effects
/// keep their values beside forms; otherwise the coefficients of all effects accepted so far are fitted again in each
/// step. The test flights are scored once, after the last step, so their errors decide nothing.
Ladder climb(residuals::Inputs inputs, const LadderOptions& options, int jobs,
             const residuals::Progress& progress);

/// Returns why a step is refused, in no unit: "the error of the select flights falls by 0.3 %, and should fall by 1 %".
/// @param least that a step has to lower it by, as a share
std::string too_small_fall(const std::string& what, double before, double after, double least);

/// Returns the key of `parameter` in LadderRow::values.
std::string ladder_key(const stability::EffectSpec& effect, const std::string& parameter);

/// Returns LadderRow::values of `model`.
std::map<std::string, double> ladder_values(const stability::Model& model);

/// Returns `model` with the last accepted row undone: the effect of that row is removed, the others get back their
/// previous values.
/// @throws files::InputError if the model has no row to undo.
stability::Model undone(const stability::Model& model);

}  // namespace swarmcert::identification
