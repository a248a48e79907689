/// @file Data that a Swarm keeps per kind of vehicle. Internal.
#pragma once

#include <vector>

#include "stability/bodies/swarm_pairs.h"
#include "stability/simulation/reach_table.h"
#include "stability/simulation/swarm.h"

namespace swarmcert::stability {

/// Stands for an effect that acts on all vehicles of its kind, in Kind::only.
inline constexpr int kEveryVehicle = -1;

struct Swarm::Kind {
  double mass_kg = 0, offset_m = 0, yaw_m = 0;
  double lag_rate_1_s = 0, lag_share = 0;  ///< 1 / tau and gain of the motor lag, 0 without
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();
  SignalPath path;
  std::vector<AppliedEffect> effects;      ///< without those that live in `path`
  std::vector<int> only;                   ///< by effect: the one vehicle that it acts on; kEveryVehicle: all
  std::vector<AppliedEffect> with_states;  ///< whose effect is a StateEffect
  std::vector<int> with_states_only;       ///< as `only`
  std::vector<const AppliedEffect*> wide;  ///< that look at neighbours
  ReachTable reach_m;                      ///< of those
  std::vector<double> bends_m;             ///< of those
  bool only_pairs = false;                 ///< its one effect acts on all vehicles, and takes pairs
};

/// Vehicles of one kind on which a single effect acts that takes pairs: computed together.
struct Swarm::PairBatch {
  const AppliedEffect* applied = nullptr;
  SwarmPairs pairs;
  Rows scratch;
};

inline const Swarm::Kind& Swarm::kind(int vehicle) const {
  return kinds_[static_cast<std::size_t>(kind_of(vehicle))];
}

}  // namespace swarmcert::stability
