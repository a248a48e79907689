/// @file Lateral reach of a neighbour's effects, tabulated over the relative height.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// Upper bound on the largest reach_m() of several effects. Since reach_m() is monotone in height, the bound follows
/// from its values at heights in steps of 1 cm.
class ReachTable {
 public:
  ReachTable() = default;
  explicit ReachTable(const std::vector<const AppliedEffect*>& effects);

  /// Returns the bound for neighbours that are between `lowest_m` and `highest_m` higher; infinite beyond 10 m.
  double over(double lowest_m, double highest_m) const { return std::max(at(lowest_m), at(highest_m)); }

 private:
  static constexpr double kHighest_m = 10, kCellsPerMetre = 100;
  static constexpr int kCells = static_cast<int>(2 * kHighest_m * kCellsPerMetre);

  double at(double dz_m) const {
    const double cell = (dz_m + kHighest_m) * kCellsPerMetre;
    const bool is_inside = cell >= 0 && cell < kCells;
    return is_inside ? at_[static_cast<std::size_t>(cell)] : std::numeric_limits<double>::infinity();
  }

  std::vector<double> at_;
};

}  // namespace swarmcert::stability
