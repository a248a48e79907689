/// @file How far to the side a neighbour must be to do nothing, by its height.
#pragma once

#include <vector>

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// An upper bound on the largest reach_m() of some effects, which is monotone in height, from its values at heights in
/// steps of 1 cm.
class ReachTable {
 public:
  ReachTable() = default;
  explicit ReachTable(const std::vector<const AppliedEffect*>& effects);

  /// For neighbours that are from `lowest_m` to `highest_m` higher; infinite beyond 10 m.
  double over(double lowest_m, double highest_m) const;

 private:
  double at(double dz_m) const;

  std::vector<double> at_;
};

}  // namespace swarmcert::stability
