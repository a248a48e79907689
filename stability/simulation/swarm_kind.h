/// @file Data that a Swarm keeps per kind of vehicle. Internal.
#pragma once

#include <vector>

#include "stability/bodies/swarm_pairs.h"
#include "stability/simulation/reach_table.h"
#include "stability/simulation/swarm.h"

namespace swarmcert::stability {

/// Value in Kind::only of an effect that acts on all vehicles of its kind.
inline constexpr int kEveryVehicle = -1;

struct Swarm::Kind {
  double mass_kg = 0, offset_m = 0, yaw_m = 0;
  double lag_rate_1_s = 0, lag_share = 0;  ///< 1 / tau and gain of the motor lag, 0 without lag
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();
  SignalPath path;
  std::vector<AppliedEffect> effects;      ///< without those in `path`
  std::vector<int> only;                   ///< by effect: the only vehicle it acts on, or kEveryVehicle
  std::vector<AppliedEffect> with_states;  ///< those that are a StateEffect
  std::vector<int> with_states_only;       ///< like `only`
  std::vector<const AppliedEffect*> wide;  ///< those that depend on neighbours
  ReachTable reach_m;                      ///< of `wide`
  std::vector<double> bends_m;             ///< of `wide`
  bool only_pairs = false;                 ///< its only effect acts on all vehicles, and takes pairs
};

/// Vehicles of one kind whose only effect takes pairs; computed together.
struct Swarm::PairBatch {
  const AppliedEffect* applied = nullptr;
  SwarmPairs pairs;
  Rows scratch;
};

inline const Swarm::Kind& Swarm::kind(int vehicle) const {
  return kinds_[static_cast<std::size_t>(kind_of(vehicle))];
}

}  // namespace swarmcert::stability
