/// @file Rotors whose thrust differs from the model's map: a weak, worn or cut propeller, a tired motor.
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

constexpr int kNumFactors = 4;
/// Signs of a rotor's thrust in the torques about body x, y and z.
constexpr double kTorqueSigns[kNumFactors][3] = {{-1, -1, -1}, {-1, 1, 1}, {1, 1, -1}, {1, -1, 1}};

/// f = sum_k (rotor_k - 1) f_k b3 with the torques of these forces, where f_k is the modelled thrust of rotor k: front
/// right, back right, back left, front left. The coefficient `model` subtracts the model's own thrust, so that the
/// others are factors.
class RotorThrust : public Effect {
 public:
  RotorThrust() : Effect(describe()) {}
  static EffectInfo describe() {
    EffectInfo info;
    info.name = "rotor_thrust";
    info.equation = "f = sum (rotor_k - 1) f_k b3, tau = sum (rotor_k - 1) (r_k x f_k e3 + s_k kappa f_k e3)";
    info.source =
        "the torques of a hovering vehicle cancel, so a weaker rotor gets a larger command; 9 % less thrust "
        "for propellers 3 mm shorter (of 47 mm), 23 % for 7 mm";
    info.equivalence_class = "weak rotor / load near a rotor";
    info.excitation =
        "half a minute of slow flight, and the same with the healthy vehicle; land, turn the load by 180 "
        "degrees and fly again to distinguish a load from a weak rotor";
    const char* const kRotorPlaces[kNumFactors] = {"front right", "back right", "back left", "front left"};
    for (int k = 0; k < kNumFactors; ++k) {
      info.linear.push_back(
          {"rotor_" + std::to_string(k + 1),
           std::string("thrust of the rotor ") + kRotorPlaces[k] + " relative to the map; 1 is nominal", 1, 0,
           2});
    }
    info.linear.push_back({"model", "the model's own thrust, which the factors replace", -1, -1, -1});
    info.shape = {{"arm_m", "from the centre to a rotor, as in the vehicle", kCrazyflieArm_m, 0.005, 2},
                  {"torque_per_thrust_m", "as in the vehicle", 0.006, 0.0001, 1}};
    info.traits.shown_by = ShownBy::kRotors;
    return info;
  }
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const double offset_m = shape[0] * std::sqrt(0.5);
    const Eigen::Vector3d levers_m(offset_m, offset_m, shape[1]);
    Wrench& all = columns[kNumFactors];
    all = {};
    for (int k = 0; k < kNumFactors; ++k) {
      const Eigen::Vector3d signs(kTorqueSigns[k]);
      const double thrust_N =
          (now.thrust_N + signs.dot(now.torque_B_Nm.cwiseQuotient(levers_m))) / kNumFactors;
      columns[k] = {thrust_N * now.b3_W(), thrust_N * signs.cwiseProduct(levers_m)};
      all.force_W_N += columns[k].force_W_N;
      all.torque_B_Nm += columns[k].torque_B_Nm;
    }
  }
};

}  // namespace

EffectEntry effects::rotor_thrust() { return effect_entry<RotorThrust>(); }

}  // namespace swarmcert::stability
