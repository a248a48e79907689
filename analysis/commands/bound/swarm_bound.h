/// @file `bound --swarm`: vehicles that disturb one another.
#pragma once

#include <string>

#include "analysis/commands/shared/tracking_input.h"
#include "stability/bounds/swarms/coupled_swarm.h"

namespace swarmcert::analysis {

struct SwarmBound {
  stability::CoupledSwarm swarm;
  stability::CoupledVerdict found;
  /// "proved", "refuted" or "inconclusive".
  const char* verdict() const;
};
void describe(files::Record& record, const SwarmBound& bound);

/// Reads FILE (schema swarmcert/swarm/1), see read_coupled_swarm(). Every vehicle has the given gains and model; its z
/// loop is analysed. The verdict is refuted if the forces as stated, with their directions, make errors grow in a
/// simulation. The bounds contain the estimation errors that `source` states.
/// @throws UsageError if neither the size nor the rate of the force error or of the estimation errors is known.
SwarmBound swarm_bound(const Tracking& input, const std::string& path,
                       const stability::DisturbanceSource& source);
void print(const SwarmBound& bound);

}  // namespace swarmcert::analysis
