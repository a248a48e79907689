/// @file A payload that is dropped or picked up: f = -g (m_before or m_after) e_z.
#include <algorithm>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"
#include "stability/effects/hint.h"

namespace swarmcert::stability {
namespace {

class PayloadStep : public Effect {
 public:
  PayloadStep()
      : Effect(
            {"payload_step",
             "f = -g m_before e_z until the time t_0 of the log, -g m_after e_z from then on",
             "the weight of a load that is dropped or picked up; its inertia is neglected, which is exact at "
             "constant velocity",
             "payload_step",
             "half a minute with the load and half a minute without, the same motion in both",
             {{"mass_before_kg", "of the load before the step", 0, -1, 5, {}, Unit::kMass},
              {"mass_after_kg", "of the load after the step", 0, -1, 5, {}, Unit::kMass}},
             {{"time_s", "t_0, on the log's clock", 10, 0, 1e5}}},
            {Family::kNone, Family::kNone, ShownBy::kCurve, SetPoints::kNotNeeded, {"time"}}) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const Eigen::Vector3d weight(0, 0, -kGravity_m_s2);
    const bool is_after = now.time_s >= shape[0];
    columns[0] = {is_after ? Eigen::Vector3d::Zero().eval() : weight, Eigen::Vector3d::Zero()};
    columns[1] = {is_after ? weight : Eigen::Vector3d::Zero().eval(), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant&, const double*) const override { return true; }
  bool start_at(const Hint& hint, Start& start) const override {
    const auto at_s = hint.first_of({"at", "middle"});
    if (!hint.is_vertical() || !at_s) return false;
    start.thetas.clear();
    for (const double off_s : {-0.4, -0.2, -0.1, 0.0, 0.1, 0.2, 0.4})
      start.thetas.push_back({std::max(*at_s + off_s, 0.0)});
    // A jump has no derivative with respect to its time, so the best of these times is kept.
    start.info.shape[0].lower = start.info.shape[0].upper = *at_s;
    return true;
  }
};

}  // namespace

EffectEntry effects::payload_step() { return effect_entry<PayloadStep>(); }

}  // namespace swarmcert::stability
