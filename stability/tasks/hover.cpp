/// @file Vehicles hover side by side, 0.5 m apart, at a height of 0.6 m.
#include "stability/tasks/task.h"
#include "stability/tasks/task_entry.h"

namespace swarmcert::stability {
namespace {

class Hover : public TimedTask {
 public:
  static constexpr char kName[] = "hover";
  static constexpr char kSummary[] = "stay in place, 0.5 m apart";
  explicit Hover(const TaskOptions& options) : TimedTask(options, 10) {}
  Setpoint at(int vehicle, double) const override {
    Setpoint setpoint;
    setpoint.p_W_m = {0.5 * vehicle, 0, 0.6};
    return setpoint;
  }
  std::optional<SetpointRange> over(int vehicle, double from_s, double) const override {
    SetpointRange range;
    const Eigen::Vector3d p = at(vehicle, from_s).p_W_m;
    for (int axis = 0; axis < 3; ++axis) range.p_W_m[axis] = p[axis];
    return range;
  }
};

}  // namespace

TaskEntry tasks::hover() { return task_entry<Hover>(); }

}  // namespace swarmcert::stability
