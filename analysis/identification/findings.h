/// @file Findings about each selected effect.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "analysis/identification/cross_validation.h"
#include "nn/base/interval.h"

namespace swarmcert::identification {

/// A candidate that these data cannot distinguish from a selected effect.
struct Rival {
  std::string effect;
  std::string excitation;  ///< flight that would tell them apart
  /// Over the selected effect, see Finding::evidence_bits; NaN: not known.
  double odds = std::numeric_limits<double>::quiet_NaN();
};

/// Returns n/2 ln(1 + W/n), see Finding::evidence_bits.
double log_likelihood_ratio(double squared_wald, std::size_t blocks);

/// All results for a selected effect.
struct Finding {
  Member member;
  double rmse_before_N = 0, rmse_after_N = 0;  ///< cross-validated, of the vector
  Interval drop_interval;  ///< 90 % interval of the relative fall of the RMSE, by resampling blocks
  double paired_z = 0, wald_z = 0;
  /// Logarithm of the odds over the best explanation without the effect, from evidence::explanations(). Of effects that
  /// were chosen by hand: n/2 ln(1 + W/n) nats, with the squared Wald statistic W, which is robust to errors correlated
  /// within blocks, and n blocks from which their variance is estimated, less k/2 ln(n) for k coefficients (Schwarz
  /// 1978).
  double evidence_bits = 0;
  Support support;
  std::vector<Rival> rivals;
  /// Range of each coefficient over fits without a fold.
  std::vector<Interval> model_form;

  std::vector<std::string> confounded_with() const;
};

/// Returns the findings.
/// @param members in ranking order
std::vector<Finding> findings(const CrossValidation& fits, const Members& members);

}  // namespace swarmcert::identification
