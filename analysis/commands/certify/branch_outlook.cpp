#include "analysis/commands/certify/branch_outlook.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace swarmcert::analysis {
namespace {

/// Larger numbers of boxes are only reported as more than this.
constexpr double kMostBoxes = 1e15;

}  // namespace

std::optional<BranchOutlook> branch_outlook(const lipschitz::CertifiedBound& bound) {
  const double lower = bound.lower.witness ? bound.lower.witness->slope.value() : 0;
  const bool is_estimated = bound.outlook.bound > 0 && std::isfinite(bound.outlook.bound_halfway);
  if (!is_estimated || !(lower > 0)) return std::nullopt;
  const double upper = bound.upper.value();
  BranchOutlook outlook;
  outlook.gap = upper / lower - 1;
  outlook.gap_halfway = std::max(bound.outlook.bound_halfway / lower - 1, outlook.gap);
  const double wanted = BranchOutlook::kRatio - 1;
  const double power = std::log2(outlook.gap_halfway / outlook.gap);
  if (outlook.gap <= wanted) {
    outlook.boxes = bound.nodes;
  } else if (power > 0) {
    const double boxes = bound.nodes * std::pow(outlook.gap / wanted, 1 / power);
    if (boxes <= kMostBoxes) outlook.boxes = boxes;
  }
  if (upper > lower) {
    const double seen = std::clamp(bound.outlook.slope_in_part, lower, upper);
    outlook.relaxation_share = (upper - seen) / (upper - lower);
  }
  return outlook;
}

std::string branch_outlook_words(const lipschitz::CertifiedBound& bound) {
  const std::optional<BranchOutlook> outlook = branch_outlook(bound);
  if (!outlook || outlook->gap <= BranchOutlook::kRatio - 1) return {};
  std::string words = fmt::format("for a ratio of {}: ", BranchOutlook::kRatio);
  if (outlook->boxes) {
    words += fmt::format(
        "about {:.2g} boxes (estimate: the second half of {} took the gap from {:.2g} % to {:.2g} %)",
        *outlook->boxes, bound.nodes, 100 * outlook->gap_halfway, 100 * outlook->gap);
  } else {
    words += fmt::format(
        "too early to estimate, or too many (the second half of {} boxes took the gap from {:.3g} % to "
        "{:.3g} %)",
        bound.nodes, 100 * outlook->gap_halfway, 100 * outlook->gap);
  }
  return words + fmt::format(
                     "; in the part with the largest bound, {} of {} neurons are undecided and the largest "
                     "slope found is {:.6g}: their relaxation is about {:.0f} % of the gap",
                     bound.outlook.undecided, bound.outlook.neurons, bound.outlook.slope_in_part,
                     100 * outlook->relaxation_share);
}

}  // namespace swarmcert::analysis
