/// @file Estimate of the work that would bring a branch-and-bound bound within 1 % of the attained slope.
#pragma once

#include <optional>
#include <string>

#include "lipschitz/certify.h"

namespace swarmcert::analysis {

/// Estimates from the course of a search, no bounds.
struct BranchOutlook {
  static constexpr double kRatio = 1.01;  ///< upper / lower to be reached
  double gap = 0, gap_halfway = 0;        ///< upper / lower - 1 after all of the boxes and after half of them
  std::optional<double> boxes;  ///< in all, for kRatio, if the gap goes on falling by the same power of them
  /// Share of upper - lower that is not explained by slopes seen in the part that dominates: what the relaxation of its
  /// undecided neurons costs. The rest needs a steeper witness or smaller boxes.
  double relaxation_share = 0;
};

/// Nothing where no boxes were looked at, or no slope is witnessed.
std::optional<BranchOutlook> branch_outlook(const lipschitz::CertifiedBound& bound);

/// The outlook as a sentence or two; empty where there is none.
std::string branch_outlook_words(const lipschitz::CertifiedBound& bound);

}  // namespace swarmcert::analysis
