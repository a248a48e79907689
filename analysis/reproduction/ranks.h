/// @file Rank correlation.
#pragma once

#include <vector>

namespace swarmcert::reproduction {

/// Spearman's rank correlation, with ties at their mean rank. NaN for fewer than three values, or if one side is
/// constant.
double rank_correlation(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace swarmcert::reproduction
