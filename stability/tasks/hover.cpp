#include "stability/tasks/hover.h"

namespace swarmcert::stability {

Hover::Hover(const TaskOptions& options) : TimedTask(options, 10) {}

Setpoint Hover::at(int vehicle, double) const {
  Setpoint setpoint;
  setpoint.p_W_m = {0.5 * vehicle, 0, 0.6};
  return setpoint;
}

std::optional<SetpointRange> Hover::over(int vehicle, double from_s, double) const {
  SetpointRange range;
  const Eigen::Vector3d p = at(vehicle, from_s).p_W_m;
  for (int axis = 0; axis < 3; ++axis) range.p_W_m[axis] = p[axis];
  return range;
}

}  // namespace swarmcert::stability
