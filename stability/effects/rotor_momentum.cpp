/// @file Angular momentum of the rotors.
#include <Eigen/Geometry>

#include "stability/effects/effect_entry.h"
#include "stability/effects/memory_effect.h"
#include "stability/effects/signal_path.h"

namespace swarmcert::stability {
namespace {

class RotorMomentumStream : public ColumnStream {
 public:
  void restart() override { has_past_ = false; }
  void advance(const Instant& now, Wrench* columns) override {
    const double step_s = now.time_s - time_s_;
    const double slope = has_past_ && step_s > 0 ? (now.rotor_spin_rad_s - spin_rad_s_) / step_s : 0;
    const Eigen::Vector3d along = Eigen::Vector3d::UnitZ();
    columns[0] = {Eigen::Vector3d::Zero(),
                  -slope * along - now.omega_B_rad_s.cross(now.rotor_spin_rad_s * along)};
    has_past_ = true;
    time_s_ = now.time_s;
    spin_rad_s_ = now.rotor_spin_rad_s;
  }

 private:
  bool has_past_ = false;
  double time_s_ = 0, spin_rad_s_ = 0;
};

/// tau = -dh/dt in the world, with h = J_r Omega e3 in the body and Omega = sum_k s_k Omega_k, where s_k is 1 for a
/// rotor that turns counterclockwise seen from above: tau = -J_r (Omega' e3 + omega x Omega e3). It acts where the
/// speeds of the rotors are measured, and not in the simulation, whose rotors have a force and no speed.
class RotorMomentum : public MemoryEffect {
 public:
  RotorMomentum()
      : MemoryEffect(
            {"rotor_momentum",
             "tau = -J_r (Omega' e3 + omega x Omega e3), Omega = sum of the speeds, counterclockwise "
             "positive",
             "propeller and bell of a motor; 5e-8 kg m^2 on a vehicle of 45 g, where it is most of the "
             "yaw torque",
             "rotor_momentum",
             "fast changes of the yaw rate, with measured rotor speeds",
             {{"inertia_kg_m2", "J_r: of one rotor about its axis", 0, 0, 1e-4, {}, Unit::kWeightArm}},
             {},
             true},
            {Family::kNone, Family::kNone, ShownBy::kTurning}) {}
  std::unique_ptr<ColumnStream> stream(const double*) const override {
    return std::make_unique<RotorMomentumStream>();
  }
  void add_to(SignalPath&, const double*, const double*) const override {}
};

}  // namespace

EffectEntry effects::rotor_momentum() { return effect_entry<RotorMomentum>(); }

}  // namespace swarmcert::stability
