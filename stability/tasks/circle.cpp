/// @file Vehicles follow one another on a circle of radius 0.5 m at a height of 0.6 m, one turn in 6 s.
#include <cmath>

#include "stability/tasks/polynomial.h"
#include "stability/tasks/task.h"
#include "stability/tasks/task_entry.h"

namespace swarmcert::stability {
namespace {

constexpr double kTurn_s = 6;
constexpr double kRadius_m = 0.5;
constexpr double kCircleHeight_m = 0.6;
/// The speed rises from zero over this time; the angle is the integral of a rest-to-rest ramp.
constexpr double kRamp_s = 2;
constexpr double kFullTurn = 6.28318530717958647692;

/// Integral of s(x) from RestToRest over [0, x].
double ramp_integral(double x) {
  const double x5 = x * x * x * x * x;
  return x5 * (7 + x * (-14 + x * (10 - 2.5 * x)));
}

class Circle : public TimedTask {
 public:
  static constexpr char kName[] = "circle";
  static constexpr char kSummary[] = "follow one another on a circle, one turn in 6 s";
  explicit Circle(const TaskOptions& options) : TimedTask(options, 20) {}
  Setpoint at(int vehicle, double time_s) const override {
    const double full_rad_s = kFullTurn / kTurn_s;
    const RestToRest ramp(time_s / kRamp_s);
    const double progress_s = time_s < kRamp_s ? kRamp_s * ramp_integral(time_s / kRamp_s)
                                               : kRamp_s * ramp_integral(1) + time_s - kRamp_s;
    const double angle_rad = kFullTurn * vehicle / vehicles_ + full_rad_s * progress_s;
    const double rate_rad_s = full_rad_s * ramp.s;
    const double acceleration_rad_s2 = full_rad_s * ramp.ds / kRamp_s;
    const Eigen::Vector3d outward(std::cos(angle_rad), std::sin(angle_rad), 0);
    const Eigen::Vector3d along(-outward.y(), outward.x(), 0);
    Setpoint setpoint;
    setpoint.p_W_m = kRadius_m * outward;
    setpoint.p_W_m.z() = kCircleHeight_m;
    setpoint.v_W_m_s = kRadius_m * rate_rad_s * along;
    setpoint.a_W_m_s2 = kRadius_m * (acceleration_rad_s2 * along - rate_rad_s * rate_rad_s * outward);
    return setpoint;
  }
  std::vector<double> knots_s() const override { return {kRamp_s}; }
};

}  // namespace

TaskEntry tasks::circle() { return task_entry<Circle>(); }

}  // namespace swarmcert::stability
