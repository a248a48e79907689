/// @file Fits a model's effects by the error of its multi-step prediction, torques included.
///
/// Least squares of omega' on a closed loop's torques is biased: the attitude loop answers the very rates that are to be
/// explained, and the difference quotient of the rates is noise. The error of the prediction over half a second has
/// neither fault: inputs before the start are predetermined, and noise of the rates enters once, through the start.
///
/// Coefficients c of all effects minimise
///   sum over flights and quantities of  mean over starts and steps |error(c)| / mean over starts and steps |held|
/// (residuals/prediction.h), within their physical bounds: Gauss-Newton on squared errors weighted by 1 / |error|
/// (iteratively reweighted least squares; Weiszfeld 1937), each step a bounded least squares with a trust region.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "analysis/residuals/inputs.h"
#include "analysis/residuals/prediction.h"
#include "stability/model.h"

namespace swarmcert::identification {

/// One effect tried on top of those accepted before it.
struct PredictionStep {
  std::string effect;  ///< "model" for the first: the model itself
  bool accepted = false;
  double held_out = 1;  ///< error of flights that the fit did not use, over that of the given model
  double worst = 1;     ///< the largest such ratio of one group of flights
};

struct PredictionFit {
  std::string refused;  ///< why there is none; otherwise empty
  stability::Model model;
  std::vector<PredictionStep> ladder;
  std::vector<std::string> groups;  ///< of flights; each is left out once
  bool changed = false;             ///< something was accepted
};

/// Returns the group of a log, whose flights resemble each other: its name without trailing words that count or date
/// ("square_20251017_run1" is of "square").
std::string flight_group(const std::string& path);

/// Fits the effects of the only model of `inputs` and adds effects of torque. First the coefficients that the model
/// already has, then each effect of torque: a step is accepted if flights of every group, left out of the fit in turn,
/// are predicted at least 1 % better together, and none of the groups more than 1 % worse.
/// @param flights indices of inputs.found.flights that may be used
/// @throws std::invalid_argument unless `inputs` has exactly one model.
PredictionFit fit_prediction(const residuals::Inputs& inputs, const std::vector<int>& flights,
                             double horizon_s, int jobs);

}  // namespace swarmcert::identification
