#include "analysis/commands/shared/character_plot.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "analysis/report/table.h"

namespace swarmcert::analysis {
namespace {

/// Means by region, in order of the regions.
std::map<int, const residuals::RegionErrors*> regions_by_index(const residuals::Comparison& comparison,
                                                               int variable) {
  std::map<int, const residuals::RegionErrors*> regions;
  for (const residuals::RegionErrors& region : comparison.regions)
    if (region.variable == variable) regions[region.region] = &region;
  return regions;
}

/// "####|" for a negative share of the largest mean, "|####" for a positive one.
std::string bar(double share) {
  constexpr int kLongest = 16;
  const auto length = static_cast<std::size_t>(std::lround(kLongest * std::abs(share)));
  const std::string marks(length, '#'), room(kLongest - length, ' ');
  return share < 0 ? room + marks + "|" : std::string(kLongest, ' ') + "|" + marks;
}

/// One row per range of y, the largest first; one column per range of x.
Table map_of(const std::map<int, const residuals::RegionErrors*>& regions,
             const residuals::PlaceSquares& squares,
             const std::function<double(const residuals::RegionErrors&)>& mean) {
  const auto from = [&](int axis, int k) { return squares.width_m * (squares.first[axis] + k); };
  Table table = {{"y [m] \\ x"}, {}};
  for (int i = 0; i < squares.count[0]; ++i) table.header.push_back(fmt::format("{:g} ..", from(0, i)));
  for (int j = squares.count[1] - 1; j >= 0; --j) {
    std::vector<std::string> row = {fmt::format("{:g} .. {:g}", from(1, j), from(1, j + 1))};
    for (int i = 0; i < squares.count[0]; ++i) {
      const auto found = regions.find(j * squares.count[0] + i);
      row.push_back(found == regions.end() ? "-" : fmt::format("{:.3g}", mean(*found->second)));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace

std::string character_plot(const residuals::Comparison& comparison, const residuals::FailingPlace& place,
                           const residuals::ForceUnit& unit) {
  if (place.variable < 0) return "";
  const int axis = residuals::failing_axis(comparison.overall.statistics);
  const auto mean = [&](const residuals::RegionErrors& region) {
    const residuals::Axes& bias = region.statistics.bias;
    return unit.per_newton() * (axis == 0 ? bias.x : axis == 1 ? bias.y : bias.z);
  };
  const auto regions = regions_by_index(comparison, place.variable);
  const std::string head = fmt::format("  Mean residual along {} [{}]\n", "xyz"[axis], unit.name);
  if (place.variable == residuals::kPlaceVariable)
    return head + to_text(map_of(regions, comparison.squares, mean));
  double largest = 0;
  for (const auto& [index, region] : regions) largest = std::max(largest, std::abs(mean(*region)));
  Table table;
  for (const auto& [index, region] : regions)
    table.rows.push_back(
        {region->name + ":", fmt::format("{:.3g}", mean(*region)), bar(mean(*region) / largest)});
  return head + to_text(table);
}

}  // namespace swarmcert::analysis
