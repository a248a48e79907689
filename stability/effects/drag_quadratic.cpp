#include "stability/effects/drag_quadratic.h"

namespace swarmcert::stability {

EffectInfo DragQuadratic::describe() {
  return {"drag_quadratic",
          "f = -c |v| v",
          "dynamic pressure; c = density x drag area / 2",
          "drag_quadratic",
          "horizontal speeds over a range of 3 to 1, the larger the better",
          {{"drag_N_s2_m2", "force per squared speed", 0, 0, 0.3}},
          {}};
}

void DragQuadratic::columns(const Instant& now, const double*, Wrench* columns) const {
  columns[0] = {-now.v_W_m_s.norm() * now.v_W_m_s, Eigen::Vector3d::Zero()};
}

bool DragQuadratic::in_support(const Instant& now, const double*) const { return now.v_W_m_s.norm() > 0.3; }

}  // namespace swarmcert::stability
