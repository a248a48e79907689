/// @file Detection limits: the smallest injected effects that these flights show.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/identification/selection.h"

namespace swarmcert::identification {

/// The smallest effect that these data show in 90 % of injections.
struct Detectable {
  std::string effect, parameter;
  double size = 0;                      ///< infinite where no size within the physical bounds is shown
  std::string excitation;               ///< what to fly to see smaller ones
  std::map<std::string, double> shape;  ///< that was injected; empty for lags and delays, whose size it is
};

/// For each candidate that is not among `members` and each of its coefficients: the smallest size at which at least 9
/// of 10 injections are accepted beside `members`. An injection adds size x column to the residual of a resampled set
/// of blocks (open loop: the flight does not react), with the theta of the grid that is nearest to the effect's
/// default. A coefficient that is accepted without any injection has no entry: what is left looks like it. Columns
/// scaled and added change Gram matrices by known amounts, so that no flight is read again.
std::vector<Detectable> detectable(const Grams& grams, const Members& members);

}  // namespace swarmcert::identification
