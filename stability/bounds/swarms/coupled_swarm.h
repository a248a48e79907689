/// @file swarm.toml: vehicles of one kind with coupled forces, and a test whether their errors stay bounded.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "stability/bounds/swarms/small_gain.h"
#include "stability/bounds/swarms/unstable_swarm.h"
#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::files {
class Keys;
}

namespace swarmcert::stability {

struct CoupledSwarm {
  int vehicles = 0;
  std::vector<Coupling> couplings;
};

/// Describes swarm.toml.
void describe_swarm_file(files::Keys& keys);

/// Reads swarm.toml.
/// @throws files::InputError with line, key, value and hint.
CoupledSwarm read_coupled_swarm(const std::string& path);

/// Returns a class that contains no force.
Disturbance no_force();

struct CoupledVerdict {
  SmallGain small_gain;
  OwnMotion of_estimates;  ///< of every vehicle, due to errors of its estimates
  OwnMotion of_force;      ///< likewise, due to its force error beside the couplings
  /// Small gain is sufficient, not necessary: if it fails, an unstable instance of the class disproves stability.
  std::optional<UnstableSwarm> unstable;
  bool is_refuted() const { return unstable && unstable->is_declared; }
};

/// Applies the small-gain test to the z loops (continuous, command channel, effective integral gain if sampled) of
/// vehicles that all have these gains. The couplings describe how forces depend on the true motion of the vehicles. The
/// effect of wrong estimates on a network's inputs is not included, and must be added to cross_rate_N_s.
/// @param others velocity_error, position_error and bias_N of every vehicle's z axis; the other members are ignored.
/// @param force class of every vehicle's force error along z in addition to the bias and the couplings.
/// @throws std::invalid_argument if Lambda or K couples the z axis to others.
CoupledVerdict couple(const CoupledSwarm& swarm, const FlownLoop& flown, const OtherErrors& others = {},
                      const Disturbance& force = no_force());

}  // namespace swarmcert::stability
