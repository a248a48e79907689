#include "stability/tasks/swap.h"

#include <cmath>

#include "stability/tasks/polynomial.h"

namespace swarmcert::stability {
namespace {

// Published experiment: 3 s per swap, one every 4.5 s; between swaps the vehicles wait.
constexpr double kPeriod_s = 4.5;
constexpr double kSwap_s = 3;
constexpr double kPi = 3.14159265358979323846;

struct Geometry {
  double lowest_m, step_m, radius_m;
};

/// As flown with two to five vehicles; more go on in the pattern of five.
Geometry geometry(int vehicles) {
  if (vehicles <= 2) return {0.6, 0.3, 0.3};
  if (vehicles == 3) return {0.6, 0.25, 0.35};
  if (vehicles == 4) return {0.35, 0.25, 0.4};
  return {0.3, 0.2, 0.4};
}

}  // namespace

Swap::Swap(const TaskOptions& options) : TimedTask(options, 6 * kPeriod_s) {}

Setpoint Swap::at(int vehicle, double time_s) const {
  const Geometry place = geometry(vehicles_);
  const double angle_rad = kPi * vehicle / vehicles_;
  const double start_s = kPeriod_s - kSwap_s;
  const int swaps = static_cast<int>(std::floor(time_s / kPeriod_s));
  const RestToRest path((time_s - swaps * kPeriod_s - start_s) / kSwap_s);
  // From side +1 to side -1 in even swaps, back in odd ones.
  const double side = swaps % 2 == 0 ? 1 : -1;
  const Eigen::Vector3d radius_m =
      place.radius_m * Eigen::Vector3d(std::cos(angle_rad), std::sin(angle_rad), 0);
  Setpoint setpoint;
  setpoint.p_W_m = side * (1 - 2 * path.s) * radius_m;
  setpoint.p_W_m.z() = place.lowest_m + vehicle * place.step_m;
  setpoint.v_W_m_s = -2 * side * path.ds / kSwap_s * radius_m;
  setpoint.a_W_m_s2 = -2 * side * path.dds / (kSwap_s * kSwap_s) * radius_m;
  return setpoint;
}

std::vector<double> Swap::knots_s() const {
  std::vector<double> knots;
  for (int k = 0; k * kPeriod_s < duration_s_; ++k) {
    knots.push_back((k + 1) * kPeriod_s - kSwap_s);
    knots.push_back((k + 1) * kPeriod_s);
  }
  return knots;
}

}  // namespace swarmcert::stability
