#include "stability/simulation/reach_table.h"

#include <algorithm>

namespace swarmcert::stability {
namespace {

double largest_reach_m(const std::vector<const AppliedEffect*>& effects, double dz_m) {
  double reach = 0;
  for (const AppliedEffect* applied : effects) {
    reach = std::max(reach, applied->effect().reach_m(dz_m, applied->shape().data()));
  }
  return reach;
}

}  // namespace

ReachTable::ReachTable(const std::vector<const AppliedEffect*>& effects) {
  double last = largest_reach_m(effects, -kHighest_m);
  for (int k = 0; k < kCells; ++k) {
    const double next = largest_reach_m(effects, (k + 1) / kCellsPerMetre - kHighest_m);
    at_.push_back(std::max(last, next));
    last = next;
  }
}

}  // namespace swarmcert::stability
