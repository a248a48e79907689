/// @file From the ground to 0.5 m, wait, and land: vehicles side by side, 0.5 m apart.
#include <algorithm>

#include "stability/tasks/polynomial.h"
#include "stability/tasks/task.h"
#include "stability/tasks/task_entry.h"

namespace swarmcert::stability {
namespace {

constexpr double kGround_m = 0.05;  ///< height of the marker frame of a Crazyflie that stands on the floor
constexpr double kTop_m = 0.5;
constexpr double kWait_s = 1;
constexpr double kMove_s = 2.5;

class Takeoff : public Task {
 public:
  static constexpr char kName[] = "takeoff";
  static constexpr char kSummary[] = "rise from the ground, wait, land";
  explicit Takeoff(const TaskOptions& options)
      : duration_s_(std::max(options.duration_s > 0 ? options.duration_s : 12, 2 * (kWait_s + kMove_s))) {}
  Setpoint at(int vehicle, double time_s) const override {
    const double landing_s = duration_s_ - kWait_s - kMove_s;
    const RestToRest up((time_s - kWait_s) / kMove_s);
    const RestToRest down((time_s - landing_s) / kMove_s);
    const double way_m = kTop_m - kGround_m;
    Setpoint setpoint;
    setpoint.p_W_m = {0.5 * vehicle, 0, kGround_m + way_m * (up.s - down.s)};
    setpoint.v_W_m_s.z() = way_m * (up.ds - down.ds) / kMove_s;
    setpoint.a_W_m_s2.z() = way_m * (up.dds - down.dds) / (kMove_s * kMove_s);
    return setpoint;
  }
  double duration_s() const override { return duration_s_; }
  std::vector<double> knots_s() const override {
    const double landing_s = duration_s_ - kWait_s - kMove_s;
    return {kWait_s, kWait_s + kMove_s, landing_s, landing_s + kMove_s};
  }
  bool starts_on_ground() const override { return true; }

 private:
  double duration_s_;
};

}  // namespace

TaskEntry tasks::takeoff() { return task_entry<Takeoff>(); }

}  // namespace swarmcert::stability
