#include "analysis/identification/scan/abscissa.h"

namespace swarmcert::identification {

std::vector<Abscissa> abscissas(const ScanSamples& samples) {
  std::vector<Abscissa> all;
  const bool has_neighbours = samples.has_neighbours();
  const int variables = has_neighbours ? kNumScanVariables : static_cast<int>(ScanVariable::kNeighbourX);
  for (int v = 0; v < variables; ++v) {
    const auto variable = static_cast<ScanVariable>(v);
    const ScanVariableInfo& info = scan_variable(variable);
    if (!info.in_world && !info.in_body) continue;
    std::vector<int> knots = {4, 8, 16};
    if (variable == ScanVariable::kTime || variable == ScanVariable::kBattery) knots = {4, 8};
    // Torques rotate the vehicle, and there are no setpoints of the heading for comparison.
    const bool is_turned = samples.quantity == ScanQuantity::kBalance && variable == ScanVariable::kRateZ;
    all.push_back(
        {info.name, {variable}, 0, info.is_answer || is_turned, info.in_world, info.in_body, knots});
  }
  all.push_back({"xy", {ScanVariable::kX, ScanVariable::kY}, 0, false, true, false, {4, 7}});
  all.push_back({"xz", {ScanVariable::kX, ScanVariable::kZ}, 0, false, true, false, {7}});
  all.push_back({"yz", {ScanVariable::kY, ScanVariable::kZ}, 0, false, true, false, {7}});
  if (has_neighbours) {
    const std::vector<ScanVariable> place = {ScanVariable::kNeighbourX, ScanVariable::kNeighbourY};
    all.push_back({"neighbour_xy", place, 0, false, true, false, {5, 9}});
    for (int lag = 0; lag < NeighbourPlaces::kLags; ++lag)
      all.push_back({"neighbour", {}, lag, false, true, false, {7}});
    for (int lag = 0; lag < NeighbourPlaces::kLags; ++lag) {
      for (const auto v :
           {ScanVariable::kNeighbourVx, ScanVariable::kNeighbourVy, ScanVariable::kNeighbourVz}) {
        // The current relative values are among the variables above.
        if (lag > 0) all.push_back({scan_variable(v).name, {v}, lag, false, true, false, {8}});
        all.push_back({scan_variable(v).name, {v}, lag, false, true, false, {8}, true});
      }
    }
  }
  return all;
}

namespace {

/// For neighbours within 0.8 m along each axis; those further away are clamped to the edge.
Knots knots_nearby(int count) {
  constexpr double kReach_m = 0.8;
  Knots knots;
  for (int k = 0; k < count; ++k) knots.push_back(kReach_m * (2.0 * k / (count - 1) - 1));
  return knots;
}

}  // namespace

Curve curve_over(const ScanSamples& samples, const Abscissa& abscissa, int knots) {
  Curve curve;
  if (abscissa.variables.empty()) {
    // Within 0.7 m laterally and 1.2 m in height; those further away are clamped to the edge.
    const auto lateral_m = samples.neighbours.lateral_m.col(abscissa.lag);
    const auto height_m = samples.neighbours.height_m.col(abscissa.lag);
    Knots lateral, height;
    for (int k = 0; k < knots; ++k) {
      lateral.push_back(0.7 * k / (knots - 1));
      height.push_back(-1.2 + 2.4 * k / (2 * knots - 2));
    }
    for (int k = knots; k < 2 * knots - 1; ++k) height.push_back(-1.2 + 2.4 * k / (2 * knots - 2));
    curve.rows = hat_rows(lateral_m, lateral, height_m, height);
    curve.columns = static_cast<int>(lateral.size() * height.size());
    curve.knots = {lateral, height};
    return curve;
  }
  if (abscissa.lag > 0 || abscissa.over_ground) {
    const ScanVariable v = abscissa.variables[0];
    Eigen::VectorXf velocity_m_s =
        samples.neighbours.velocity_m_s.col(NeighbourPlaces::velocity_column(v, abscissa.lag));
    if (abscissa.over_ground)
      velocity_m_s += samples.values.col(static_cast<int>(ScanVariable::kVx) + static_cast<int>(v) -
                                         static_cast<int>(ScanVariable::kNeighbourVx));
    curve.knots = {knots_over(velocity_m_s, knots)};
    if (curve.knots[0].empty()) return {};
    curve.columns = knots;
    curve.rows = hat_rows(velocity_m_s, curve.knots[0]);
    return curve;
  }
  const auto a = static_cast<Eigen::Index>(abscissa.variables[0]);
  const bool is_nearby = abscissa.variables[0] == ScanVariable::kNeighbourX;
  curve.knots = {is_nearby ? knots_nearby(knots) : knots_over(samples.values.col(a), knots)};
  if (curve.knots[0].empty()) return {};
  const auto asks = [&](Eigen::Index v) { return samples.commanded.col(v).allFinite(); };
  if (abscissa.variables.size() == 1) {
    curve.columns = knots;
    curve.rows = hat_rows(samples.values.col(a), curve.knots[0]);
    if (asks(a)) curve.commanded = hat_rows(samples.commanded.col(a), curve.knots[0]);
    return curve;
  }
  const auto b = static_cast<Eigen::Index>(abscissa.variables[1]);
  curve.knots.push_back(is_nearby ? knots_nearby(knots) : knots_over(samples.values.col(b), knots));
  if (curve.knots[1].empty()) return {};
  curve.columns = knots * knots;
  curve.rows = hat_rows(samples.values.col(a), curve.knots[0], samples.values.col(b), curve.knots[1]);
  if (asks(a) && asks(b))
    curve.commanded =
        hat_rows(samples.commanded.col(a), curve.knots[0], samples.commanded.col(b), curve.knots[1]);
  return curve;
}

}  // namespace swarmcert::identification
