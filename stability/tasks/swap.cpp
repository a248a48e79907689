/// @file The published swap: vehicles at different heights change places on a circle, passing over the centre.
#include <algorithm>
#include <cmath>

#include "nn/base/pi.h"
#include "stability/tasks/polynomial.h"
#include "stability/tasks/polynomial_range.h"
#include "stability/tasks/task.h"
#include "stability/tasks/task_entry.h"

namespace swarmcert::stability {
namespace {

// Published experiment: a swap takes 3 s and starts every 4.5 s; in between the vehicles wait.
constexpr double kPeriod_s = 4.5;
constexpr double kSwap_s = 3;

struct Geometry {
  double lowest_m, step_m, radius_m;
};

/// The geometry as flown with two to five vehicles; larger swarms continue the pattern of five.
Geometry geometry(int vehicles) {
  if (vehicles <= 2) return {0.6, 0.3, 0.3};
  if (vehicles == 3) return {0.6, 0.25, 0.35};
  if (vehicles == 4) return {0.35, 0.25, 0.4};
  return {0.3, 0.2, 0.4};
}

class Swap : public TimedTask {
 public:
  static constexpr char kName[] = "swap";
  static constexpr char kSummary[] = "cross over the centre of a circle at different heights, as published";
  explicit Swap(const TaskOptions& options) : TimedTask(options, 6 * kPeriod_s) {
    const Geometry place = geometry(vehicles_);
    for (int vehicle = 0; vehicle < vehicles_; ++vehicle) {
      const double angle_rad = kPi * vehicle / vehicles_;
      sides_m_.push_back(place.radius_m * Eigen::Vector3d(std::cos(angle_rad), std::sin(angle_rad), 0));
      sides_m_.back().z() = place.lowest_m + vehicle * place.step_m;
    }
  }
  Setpoint at(int vehicle, double time_s) const override {
    const double start_s = kPeriod_s - kSwap_s;
    const int swaps = static_cast<int>(std::floor(time_s / kPeriod_s));
    const RestToRest path((time_s - swaps * kPeriod_s - start_s) / kSwap_s);
    // From side +1 to side -1 in even swaps, back in odd ones.
    const double side = swaps % 2 == 0 ? 1 : -1;
    Eigen::Vector3d radius_m = sides_m_[static_cast<std::size_t>(vehicle)];
    const double height_m = radius_m.z();
    radius_m.z() = 0;
    Setpoint setpoint;
    setpoint.p_W_m = side * (1 - 2 * path.s) * radius_m;
    setpoint.p_W_m.z() = height_m;
    setpoint.v_W_m_s = -2 * side * path.ds / kSwap_s * radius_m;
    setpoint.a_W_m_s2 = -2 * side * path.dds / (kSwap_s * kSwap_s) * radius_m;
    return setpoint;
  }
  std::optional<SetpointRange> over(int vehicle, double from_s, double to_s) const override {
    const Setpoint lowest = at(vehicle, 0);  // in the first period of the swap, at rest
    const double start_s = kPeriod_s - kSwap_s;
    std::optional<SetpointRange> result;
    for (int swap = static_cast<int>(std::floor(from_s / kPeriod_s)); swap * kPeriod_s <= to_s; ++swap) {
      const double begin_s = std::max(from_s, swap * kPeriod_s) - swap * kPeriod_s;
      const double end_s = std::min(to_s, (swap + 1) * kPeriod_s) - swap * kPeriod_s;
      const RestToRestRange path((Interval(begin_s, end_s) + Interval(-1e-12, 1e-12) - Interval(start_s)) /
                                 Interval(kSwap_s));
      const Interval side(swap % 2 == 0 ? 1 : -1);
      const Interval rate = Interval(1) / Interval(kSwap_s);
      SetpointRange range;
      for (int axis = 0; axis < 2; ++axis) {
        const Interval radius_m = side * Interval(lowest.p_W_m[axis]);
        range.p_W_m[axis] = (Interval(1) - Interval(2) * path.s) * radius_m;
        range.v_W_m_s[axis] = Interval(-2) * path.ds * rate * radius_m;
        range.a_W_m_s2[axis] = Interval(-2) * path.dds * rate * rate * radius_m;
        range.jerk_W_m_s3[axis] = Interval(-2) * path.ddds * rate * rate * rate * radius_m;
      }
      range.p_W_m[2] = lowest.p_W_m[2];
      if (!result) {
        result = range;
        continue;
      }
      for (int axis = 0; axis < 3; ++axis) {
        result->p_W_m[axis] = hull(result->p_W_m[axis], range.p_W_m[axis]);
        result->v_W_m_s[axis] = hull(result->v_W_m_s[axis], range.v_W_m_s[axis]);
        result->a_W_m_s2[axis] = hull(result->a_W_m_s2[axis], range.a_W_m_s2[axis]);
        result->jerk_W_m_s3[axis] = hull(result->jerk_W_m_s3[axis], range.jerk_W_m_s3[axis]);
      }
    }
    return result;
  }
  std::vector<double> knots_s() const override {
    std::vector<double> knots;
    for (int k = 0; k * kPeriod_s < duration_s_; ++k) {
      knots.push_back((k + 1) * kPeriod_s - kSwap_s);
      knots.push_back((k + 1) * kPeriod_s);
    }
    return knots;
  }

 private:
  std::vector<Eigen::Vector3d> sides_m_;  ///< by vehicle: starting point, including its height
};

}  // namespace

TaskEntry tasks::swap() { return task_entry<Swap>(); }

}  // namespace swarmcert::stability
