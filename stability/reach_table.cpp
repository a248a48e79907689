#include "stability/reach_table.h"

#include <algorithm>

#include "nn/files/doubles.h"

namespace swarmcert::stability {
namespace {

constexpr double kHighest_m = 10, kCellsPerMetre = 100;
constexpr int kCells = static_cast<int>(2 * kHighest_m * kCellsPerMetre);

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

double ReachTable::over(double lowest_m, double highest_m) const {
  return std::max(at(lowest_m), at(highest_m));
}

double ReachTable::at(double dz_m) const {
  const double cell = (dz_m + kHighest_m) * kCellsPerMetre;
  return cell >= 0 && cell < kCells ? at_[static_cast<std::size_t>(cell)] : kInfinity;
}

}  // namespace swarmcert::stability
