/// @file Estimate of the work that would bring a branch-and-bound bound within 1 % of the attained slope.
#pragma once

#include <optional>
#include <string>

#include "lipschitz/certify.h"

namespace swarmcert::analysis {

/// Estimates extrapolated from the course of a search; these are not bounds.
struct BranchOutlook {
  static constexpr double kRatio = 1.01;  ///< target of upper / lower
  double gap = 0, gap_halfway = 0;        ///< upper / lower - 1 after all boxes and after half of them
  std::optional<double> boxes;  ///< total for kRatio, if the gap keeps falling with the same power of it
  /// Share of upper - lower that slopes observed in the dominating part do not explain, i.e. the looseness of the
  /// relaxation of its undecided neurons. The rest needs a steeper witness or smaller boxes.
  double relaxation_share = 0;
};

/// Returns nothing if no boxes were halved, nothing was estimated, or no slope has a witness.
std::optional<BranchOutlook> branch_outlook(const lipschitz::CertifiedBound& bound);

/// Describes the outlook in one or two sentences; empty if there is none.
std::string branch_outlook_words(const lipschitz::CertifiedBound& bound);

}  // namespace swarmcert::analysis
