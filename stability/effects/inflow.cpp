/// @file Thrust lost to the axial inflow of the rotors in climb: f = -k T (b3' v) b3.
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

class Inflow : public Effect {
 public:
  Inflow()
      : Effect(
            {"inflow",
             "f = -k T (b3' v) b3",
             "momentum theory of a rotor in axial flow, to first order in the climb speed",
             "inflow",
             "climbs and descents of more than 0.5 m/s",
             {{"loss_s_m", "relative thrust lost per climb speed", 0, 0, 0.3}},
             {}},
            {Family::kNone, Family::kNone, ShownBy::kForce, SetPoints::kBesideRemainder, {"vz", "climb"}}) {}
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    const Eigen::Vector3d b3 = now.b3_W();
    columns[0] = {-now.thrust_N * b3.dot(now.v_W_m_s) * b3, Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double*) const override {
    return std::abs(now.b3_W().dot(now.v_W_m_s)) > 0.1;
  }
};

}  // namespace

EffectEntry effects::inflow() { return effect_entry<Inflow>(); }

}  // namespace swarmcert::stability
