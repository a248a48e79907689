/// @file Drag of the body: f = -D v.
#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class DragLinear : public Effect {
 public:
  DragLinear()
      : Effect({"drag_linear",
                "f = -D v",
                "Stokes form; published Crazyflie flights give 0.012 .. 0.014 N s/m horizontally",
                "drag_linear",
                "horizontal speeds over a range of 3 to 1",
                {{"drag_N_s_m", "force per speed", 0, 0, 0.1, {}, Unit::kDrag}},
                {}},
               {Family::kDrag, Family::kNone, ShownBy::kForce, SetPoints::kNotNeeded, velocity_variables(),
                Place::kVehicle, 1}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    columns[0] = {-now.v_W_m_s, Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double*) const override { return now.v_W_m_s.norm() > 0.1; }
};

}  // namespace

EffectEntry effects::drag_linear() { return effect_entry<DragLinear>(); }

}  // namespace swarmcert::stability
