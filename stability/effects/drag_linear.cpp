#include "stability/effects/drag_linear.h"

namespace swarmcert::stability {

EffectInfo DragLinear::describe() {
  return {"drag_linear",
          "f = -D v",
          "Stokes form; published Crazyflie flights give 0.012 .. 0.014 N s/m horizontally",
          "drag_linear",
          "horizontal speeds over a range of 3 to 1",
          {{"drag_N_s_m", "force per speed", 0, 0, 0.3}},
          {}};
}

void DragLinear::columns(const Instant& now, const double*, Wrench* columns) const {
  columns[0] = {-now.v_W_m_s, Eigen::Vector3d::Zero()};
}

bool DragLinear::in_support(const Instant& now, const double*) const { return now.v_W_m_s.norm() > 0.1; }

}  // namespace swarmcert::stability
