/// @file Both forces on one vehicle, as in the simulator.
#pragma once

#include <memory>
#include <vector>

#include "analysis/tracking/tube/learned_force.h"
#include "stability/effects/deep_set_force.h"
#include "stability/effects/effect.h"

namespace swarmcert::tests {

class Forces {
 public:
  Forces(const files::Network& network, const stability::Model& truth)
      : learned_(network, "small", {"small"}) {
    for (const stability::EffectSpec& spec : truth.effects) {
      if (spec.name == "motor_lag") continue;
      effects_.push_back(std::make_unique<stability::AppliedEffect>(
          spec, stability::EffectContext{truth.kind, {truth.kind}, truth.path}));
    }
  }
  /// @param x a state as in learned_force.h; the result refers to it
  stability::Instant at(const std::vector<double>& x, int neighbours) {
    others_.clear();
    for (int n = 0; n < neighbours; ++n) {
      const double* const s = x.data() + n * analysis::kPerNeighbour;
      others_.push_back({{s[0], s[1], s[2]}, {s[3], s[4], s[5]}, Eigen::Vector3d::Zero(), 0.034, 0});
    }
    const double* const own = x.data() + neighbours * analysis::kPerNeighbour;
    stability::Instant now;
    now.mass_kg = 0.034;
    now.p_W_m = {0, 0, own[0]};
    now.v_W_m_s = {own[1], own[2], own[3]};
    now.thrust_N = 0.034 * 9.81;
    now.neighbours = others_.data();
    now.num_neighbours = neighbours;
    return now;
  }
  double learned(const stability::Instant& now) { return learned_.force_z_N(now); }
  Eigen::Vector3d truth(const stability::Instant& now) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& effect : effects_) sum += effect->wrench(now).force_W_N;
    return sum;
  }

 private:
  stability::DeepSetForce learned_;
  std::vector<std::unique_ptr<stability::AppliedEffect>> effects_;
  std::vector<stability::Neighbour> others_;
};

}  // namespace swarmcert::tests
