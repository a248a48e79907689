#include "stability/tasks/hover.h"

namespace swarmcert::stability {

Hover::Hover(const TaskOptions& options) : TimedTask(options, 10) {}

Setpoint Hover::at(int vehicle, double) const {
  Setpoint setpoint;
  setpoint.p_W_m = {0.5 * vehicle, 0, 0.6};
  return setpoint;
}

}  // namespace swarmcert::stability
