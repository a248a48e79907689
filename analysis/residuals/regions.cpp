#include "analysis/residuals/regions.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "nn/base/pi.h"

namespace swarmcert::residuals {
namespace {

struct Variable {
  const char* name;
  const char* unit;
  std::vector<double> edges;
};

/// Bins for the most relevant neighbour: the laterally closest one among those within a height difference of 1 m.
const std::vector<double> kLateral_m = {0, 0.05, 0.1, 0.2, 0.4};
const std::vector<double> kVertical_m = {0.05, 0.2, 0.3, 0.4, 0.6, 1.0};

enum Index { kHeight, kSpeed, kThrust, kBattery, kTime, kTilt, kClimb, kBelow, kAbove };

const std::vector<Variable>& variables() {
  static const std::vector<Variable> all = {
      {"height", "m", {0, 0.08, 0.1, 0.12, 0.15, 0.2, 0.3, 0.5, 0.8, 1.2, 2, 100}},
      {"speed", "m/s", {0, 0.1, 0.2, 0.4, 0.7, 1, 1.5, 2.5, 100}},
      {"thrust over weight", "", {0, 0.6, 0.8, 0.9, 1, 1.1, 1.2, 1.4, 10}},
      {"battery", "V", {2.6, 3.0, 3.2, 3.4, 3.6, 3.8, 4.0, 5}},
      {"time", "s", {0, 5, 10, 20, 40, 80, 160, 1e6}},
      {"tilt", "degrees", {0, 2, 5, 10, 20, 90}},
      {"vertical velocity", "m/s", {-100, -1.5, -0.8, -0.4, -0.2, 0, 0.2, 0.4, 0.8, 1.5, 100}},
      {"below a vehicle", "m", {}},
      {"above a vehicle", "m", {}},
  };
  return all;
}

std::int16_t find(const std::vector<double>& edges, double value) {
  const auto after = std::upper_bound(edges.begin(), edges.end(), value);
  if (after == edges.begin() || after == edges.end()) return -1;
  return static_cast<std::int16_t>(after - edges.begin() - 1);
}

std::int16_t neighbour_region(const stability::Instant& now, double sign) {
  double nearest = INFINITY;
  std::int16_t region = -1;
  for (int j = 0; j < now.num_neighbours; ++j) {
    const Eigen::Vector3d& dp = now.neighbours[j].dp_W_m;
    const double lateral = dp.head<2>().norm();
    const std::int16_t row = find(kVertical_m, sign * dp.z());
    const std::int16_t column = find(kLateral_m, lateral);
    if (row < 0 || column < 0 || lateral >= nearest) continue;
    nearest = lateral;
    region = static_cast<std::int16_t>(row * static_cast<int>(kLateral_m.size() - 1) + column);
  }
  return region;
}

}  // namespace

const char* variable_name(int variable) {
  return variable == kPlaceVariable ? "place" : variables()[static_cast<std::size_t>(variable)].name;
}

void regions_of(const stability::Instant& now, double time_in_log_s, RegionIndices indices) {
  constexpr double kDegree = 180 / kPi;
  const auto& v = variables();
  indices[kHeight] = find(v[kHeight].edges, std::max(0.0, now.p_W_m.z()));
  indices[kSpeed] = find(v[kSpeed].edges, now.v_W_m_s.norm());
  indices[kThrust] = find(v[kThrust].edges, now.thrust_N / (now.mass_kg * stability::kGravity_m_s2));
  indices[kBattery] = find(v[kBattery].edges, now.battery_V);
  indices[kTime] = find(v[kTime].edges, time_in_log_s);
  indices[kTilt] = find(v[kTilt].edges, kDegree * std::acos(std::clamp(now.R_WB(2, 2), -1.0, 1.0)));
  indices[kClimb] = find(v[kClimb].edges, now.v_W_m_s.z());
  indices[kBelow] = neighbour_region(now, 1);
  indices[kAbove] = neighbour_region(now, -1);
}

bool is_reaction(int variable) { return variable == kThrust || variable == kTilt; }

int num_regions(int variable) {
  if (variable >= kBelow) return static_cast<int>((kLateral_m.size() - 1) * (kVertical_m.size() - 1));
  return static_cast<int>(variables()[static_cast<std::size_t>(variable)].edges.size()) - 1;
}

std::string region_name(int variable, int region) {
  if (variable >= kBelow) {
    const auto columns = static_cast<int>(kLateral_m.size() - 1);
    const auto row = static_cast<std::size_t>(region / columns),
               column = static_cast<std::size_t>(region % columns);
    return fmt::format("{} .. {} m {}, {} .. {} m beside its axis", kVertical_m[row], kVertical_m[row + 1],
                       variables()[static_cast<std::size_t>(variable)].name, kLateral_m[column],
                       kLateral_m[column + 1]);
  }
  const Variable& v = variables()[static_cast<std::size_t>(variable)];
  const auto k = static_cast<std::size_t>(region);
  const std::string unit = v.unit[0] == 0 ? "" : std::string(" ") + v.unit;
  if (region == 0) return fmt::format("{} below {}{}", v.name, v.edges[1], unit);
  if (k + 2 == v.edges.size()) return fmt::format("{} above {}{}", v.name, v.edges[k], unit);
  return fmt::format("{} {} .. {}{}", v.name, v.edges[k], v.edges[k + 1], unit);
}

double region_middle(int variable, int region) {
  const auto k = static_cast<std::size_t>(region);
  if (variable >= kBelow) {
    const std::size_t column = k % (kLateral_m.size() - 1);
    return (kLateral_m[column] + kLateral_m[column + 1]) / 2;
  }
  const auto& edges = variables()[static_cast<std::size_t>(variable)].edges;
  if (k + 2 == edges.size()) return edges[k];
  return k == 0 && edges[0] < 0 ? edges[1] : (edges[k] + edges[k + 1]) / 2;
}

}  // namespace swarmcert::residuals
