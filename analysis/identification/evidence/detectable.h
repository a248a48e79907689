/// @file Detection limits: the smallest effects that flights would have shown.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "analysis/identification/evidence/evidence_search.h"

namespace swarmcert::evidence {

/// The smallest effect that would have been named in 90 % of flights like these.
struct Detectable {
  std::string effect, parameter;
  double size = 0;                      ///< infinite if no size within the physical bounds would have been
  std::string excitation;               ///< which flights would reveal smaller effects
  std::map<std::string, double> shape;  ///< of the effect; empty for lags and delays
};

/// Returns, for each effect that is neither in the set `best` nor excluded and for each of its coefficients, the
/// smallest size with EvidenceSearch::size_for() = kNamed_bits, with the shape of the grid that is closest to the
/// effect's default. For lags and delays, whose gain is 1, it is the shortest time. The flight does not react to the
/// effect (open loop).
std::vector<Detectable> detectable(const Hypotheses& all, const EvidenceSearch& search, const Weighed& best);

}  // namespace swarmcert::evidence
