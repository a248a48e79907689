#include "analysis/tracking/tube/residual_envelope.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::analysis {
namespace {

/// Returns the first and the last of `count` cells that x may meet; x may lie outside. Cells that x only touches are
/// included, and the tolerance far exceeds the rounding error of a cell edge.
std::array<int, 2> cells_of(Interval x, double lowest, double step, int count) {
  constexpr double kEdge = 1e-9;
  const double first = std::floor((x.lower - lowest) / step - kEdge);
  const double last = std::floor((x.upper - lowest) / step + kEdge);
  return {static_cast<int>(std::clamp(first, -1.0, static_cast<double>(count))),
          static_cast<int>(std::clamp(last, -1.0, static_cast<double>(count)))};
}

}  // namespace

std::vector<std::size_t> ResidualEnvelope::reached(const std::vector<Offset>& neighbours) const {
  std::vector<std::size_t> result;
  bool may_be_away = true;
  for (const Offset& offset : neighbours) {
    const Interval lateral_m = sqrt(nth_power(abs(offset[0]), 2) + nth_power(abs(offset[1]), 2));
    const auto [low, high] = cells_of(offset[2], lowest_m, height_step_m, heights);
    const auto [near, far] = cells_of(lateral_m, 0, lateral_step_m, laterals);
    if (low >= 0 && high < heights && far < laterals) may_be_away = false;
    for (int h = std::max(low, 0); h <= std::min(high, heights - 1); ++h) {
      for (int l = std::max(near, 0); l <= std::min(far, laterals - 1); ++l) result.push_back(at(h, l));
    }
  }
  if (may_be_away) result.push_back(away());
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

Interval ResidualEnvelope::over(const std::vector<Offset>& neighbours, std::size_t axis) const {
  const std::vector<std::size_t> all = reached(neighbours);
  Interval force_N = cells[all.front()].force_N[axis];
  for (const std::size_t cell : all) force_N = hull(force_N, cells[cell].force_N[axis]);
  return force_N;
}

}  // namespace swarmcert::analysis
