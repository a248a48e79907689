// The parts of the stock firmware that call the app, as it links them: the stabilizer calls the controller, and a
// task of its own runs appMain(), which does not return.
#include "stub.h"

extern "C" int program() {
  control_t control{};
  setpoint_t setpoint{};
  sensorData_t sensors{};
  state_t state{};
  state.attitudeQuaternion.w = 1;
  controllerOutOfTreeInit();
  if (!controllerOutOfTreeTest()) return 1;
  for (stabilizerStep_t step = 0; step < 1000; ++step)
    controllerOutOfTree(&control, &setpoint, &sensors, &state, step);
  appMain();
  return 0;
}
