/// @file Drag of the body at speed: f = -c |v| v.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class DragQuadratic : public Effect {
 public:
  DragQuadratic()
      : Effect({"drag_quadratic",
                "f = -c |v| v",
                "dynamic pressure; c = density x drag area / 2",
                "drag_quadratic",
                "horizontal speeds over a range of 3 to 1, the larger the better",
                {{"drag_N_s2_m2", "force per squared speed", 0, 0, 0.01, {}, Unit::kSquaredDrag}},
                {}},
               {Family::kDrag, Family::kDrag, ShownBy::kForce, SetPoints::kNotNeeded, velocity_variables(),
                Place::kVehicle, 2}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    columns[0] = {-now.v_W_m_s.norm() * now.v_W_m_s, Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double*) const override { return now.v_W_m_s.norm() > 0.3; }
};

}  // namespace

EffectEntry effects::drag_quadratic() { return effect_entry<DragQuadratic>(); }

}  // namespace swarmcert::stability
