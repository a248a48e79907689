/// @file Findings about each selected effect, and its rivals.
#pragma once

#include <string>
#include <vector>

#include "analysis/identification/selection.h"
#include "nn/base/interval.h"

namespace swarmcert::identification {

/// A candidate that these data cannot distinguish from a selected effect.
struct Rival {
  std::string effect;
  std::string excitation;  ///< flight that would tell them apart
};

/// All results for a selected effect.
struct Finding {
  Member member;
  double rmse_before_N = 0, rmse_after_N = 0;  ///< cross-validated, of the vector
  Interval drop_interval;  ///< 90 % interval of the relative fall of the RMSE, by resampling blocks
  double paired_z = 0, wald_z = 0;
  Support support;
  std::vector<Rival> rivals;
  /// Range of each coefficient over fits without a fold, and with a rival added.
  std::vector<Interval> model_form;

  std::vector<std::string> confounded_with() const;
};

/// Returns the findings.
/// @param members in ranking order
std::vector<Finding> findings(const Selection& selection, const Members& members);

}  // namespace swarmcert::identification
