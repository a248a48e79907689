/// @file Detection limits: the smallest injected effects that would be found in these flights.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/identification/selection.h"

namespace swarmcert::identification {

/// The smallest effect that is found in 90 % of injections into these data.
struct Detectable {
  std::string effect, parameter;
  double size = 0;                      ///< infinite if no size within the physical bounds is found
  std::string excitation;               ///< which flights would reveal smaller effects
  std::map<std::string, double> shape;  ///< of the injected effect; empty for lags and delays
};

/// Returns, for each candidate that is not among `members` and each of its coefficients, the smallest size at which at
/// least 9 of 10 injections are accepted beside `members`. An injection adds size x column to the residual of a
/// resampled set of blocks (open loop: the flight does not react), with the grid theta closest to the effect's default.
/// A coefficient that is accepted without any injection has no entry, because the remainder looks like it. Scaling and
/// adding columns changes Gram matrices by known amounts, so flights need not be read again.
std::vector<Detectable> detectable(const Grams& grams, const Members& members);

}  // namespace swarmcert::identification
