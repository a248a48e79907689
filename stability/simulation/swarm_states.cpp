#include <algorithm>

#include "stability/simulation/swarm_kind.h"

namespace swarmcert::stability {

/// Places the states of effects after those of the vehicles, vehicle by vehicle.
void Swarm::place_effect_states() {
  std::size_t states = 0;
  for (int i = 0; i < size(); ++i) {
    first_use_.push_back(state_uses_.size());
    const Kind& own = kind(i);
    for (std::size_t e = 0; e < own.with_states.size(); ++e) {
      if (own.with_states_only[e] != kEveryVehicle && own.with_states_only[e] != i) continue;
      const auto& effect = dynamic_cast<const StateEffect&>(own.with_states[e].effect());
      state_uses_.push_back({&own.with_states[e], &effect, states});
      states += static_cast<std::size_t>(effect.num_states());
    }
  }
  first_use_.push_back(state_uses_.size());
  rates_.resize(states);
  effect_row_ = lines_for(kind_of_.size()) * kVehicleStateSize * kRowLength;
}

bool Swarm::has_effect_states(int vehicle) const {
  const auto i = static_cast<std::size_t>(vehicle);
  return first_use_[i] < first_use_[i + 1];
}

/// At instant_: returns `others` plus the effects with states, and stores the states' rates in rates_.
Wrench Swarm::act_with_states(int vehicle, const double* effect_states, const Wrench& others) {
  Wrench sum = others;
  const Eigen::Vector3d weight_W_N(0, 0, -instant_.mass_kg * kGravity_m_s2);
  const Eigen::Vector3d beside_W_N = weight_W_N + instant_.thrust_N * instant_.b3_W();
  const auto i = static_cast<std::size_t>(vehicle);
  for (std::size_t k = first_use_[i]; k < first_use_[i + 1]; ++k) {
    const StateUse& use = state_uses_[k];
    const Wrench wrench =
        use.effect->act(instant_, beside_W_N + sum.force_W_N, use.applied->coefficients().data(),
                        use.applied->shape().data(), effect_states + use.first, rates_.data() + use.first);
    sum.force_W_N += wrench.force_W_N;
    sum.torque_B_Nm += wrench.torque_B_Nm;
  }
  return sum;
}

/// Like RigidBodies::stage(), for the states of effects with rates rates_.
void Swarm::stage_effect_states(int which, double step_s, double* start, double* rows, double* sum) const {
  for (std::size_t k = 0; k < rates_.size(); ++k) {
    const double rate = rates_[k];
    if (which == 3) {
      start[k] += step_s / 6 * (sum[k] + rate);
      continue;
    }
    sum[k] = which == 0 ? rate : sum[k] + 2 * rate;
    rows[k] = start[k] + (which == 2 ? step_s : step_s / 2) * rate;
  }
}

void Swarm::rest_effects(int vehicle, double* effect_states) const {
  const auto i = static_cast<std::size_t>(vehicle);
  for (std::size_t k = first_use_[i]; k < first_use_[i + 1]; ++k)
    std::fill_n(effect_states + state_uses_[k].first, state_uses_[k].effect->num_states(), 0.0);
}

}  // namespace swarmcert::stability
