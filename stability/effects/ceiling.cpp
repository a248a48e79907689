/// @file Ceiling effect: f = a T exp(-(h - z) / b) b3, or with a power-law tail.
#include <algorithm>
#include <cmath>

#include "stability/effects/effect.h"
#include "stability/effects/effect_entry.h"

namespace swarmcert::stability {
namespace {

enum CeilingShape { kCeilingDecay, kCeilingHeight, kCeilingTail };

EffectTraits ceiling_traits() {
  EffectTraits traits;
  traits.variables = {"z"};
  traits.within_flights = true;
  return traits;
}

class Ceiling : public Effect {
 public:
  Ceiling()
      : Effect({"ceiling",
                "f = a T (1 + q x)^(-1/q) b3, x = (h - z) / b; exp(-x) for q = 0",
                "rotors below a surface: Sanchez-Cuevas, Heredia and Ollero 2017; their rational form "
                "decays like an inverse square, q = 0.5",
                "ceiling",
                "a fifth of the time within two rotor radii of the ceiling",
                {{"amplitude", "relative thrust gained at the height h", 0, 0, 1}},
                {{"decay_m", "b", 0.05, 0.1, 11, {0.03, 0.05, 0.08, 0.12, 0.2}, Unit::kArm},
                 {"height_m", "h: height of the ceiling; for q = 0, a and h enter only as a exp(-h / b)", 2.5,
                  0, 20},
                 {"tail", "q: 0 is exponential, 0.5 an inverse square", 0, 0, 1, {0, 0.5}}}},
               ceiling_traits()) {}
  void columns(const Instant& now, const double* shape, Wrench* columns) const override {
    const double gap_m = std::max(shape[kCeilingHeight] - now.p_W_m.z(), 0.0);
    const double x = gap_m / shape[kCeilingDecay], tail = shape[kCeilingTail];
    const double gain = tail == 0 ? std::exp(-x) : std::exp(-std::log1p(tail * x) / tail);
    columns[0] = {now.thrust_N * gain * now.b3_W(), Eigen::Vector3d::Zero()};
  }
  bool in_support(const Instant& now, const double* shape) const override {
    return now.p_W_m.z() > shape[kCeilingHeight] - 2 * shape[kCeilingDecay];
  }
  std::vector<std::vector<double>> grid(const FlightRange& range) const override {
    // Flights cannot distinguish the ceiling's height from the amplitude, so the height is set just above the highest
    // point.
    std::vector<std::vector<double>> thetas;
    for (const double tail : info().shape[kCeilingTail].grid) {
      for (const double decay_m : info().shape[kCeilingDecay].grid)
        thetas.push_back({decay_m, range.z_max_m + 0.05, tail});
    }
    return thetas;
  }
};

}  // namespace

EffectEntry effects::ceiling() { return effect_entry<Ceiling>(); }

}  // namespace swarmcert::stability
