#include "analysis/commands/schema/file_kinds.h"

#include "analysis/commands/bound/tracking_certificate.h"
#include "analysis/gate/baseline.h"
#include "analysis/gate/checks/checks.h"
#include "analysis/gate/policy.h"
#include "analysis/logs/signals.h"
#include "analysis/residuals/flight_set.h"
#include "lipschitz/base/claims.h"
#include "lipschitz/certify.h"
#include "nn/base/file_keys.h"
#include "nn/weights/network.h"
#include "nn/weights/samples.h"
#include "stability/bounds/declared_disturbance.h"
#include "stability/bounds/swarms/coupled_swarm.h"
#include "stability/gains.h"
#include "stability/model.h"
#include "stability/sweep/grid.h"
#include "stability/sweep/shards.h"

namespace swarmcert::analysis {
namespace {

std::function<void(files::Record&)> of_keys(void (*describe_file)(files::Keys&)) {
  return [describe_file](files::Record& record) {
    files::Keys keys(record);
    describe_file(keys);
  };
}

}  // namespace

const std::vector<FileKind>& file_kinds() {
  static const std::vector<FileKind> all = {
      {"baseline", "Numbers and conditions of the last release",
       "Values and conditions of a release, written by `gate --update-baseline`.",
       gate::describe_baseline_file},
      {"box", "A box of inputs", "box.toml: bounds of each input, in the network's units.",
       of_keys(lipschitz::describe_box_file)},
      {"certificate", "Proofs about a network",
       "What `swarmcert certify -o FILE` writes and `swarmcert check` verifies. Every number that a proof "
       "rests "
       "on is a hex float.",
       lipschitz::describe_certificate_file},
      {"columns", "Meaning of the columns of a CSV", "columns.toml.", of_keys(logs::describe_columns_file)},
      {"disturbance", "A disturbance",
       "disturbance.toml. Three numbers are of x, y and z, one number of all axes.",
       of_keys(stability::describe_disturbance_file)},
      {"firmware-facts", "Memory and time on the target",
       "firmware-facts.json, which the target firmware_facts writes and `gate` reads.",
       of_keys(gate::describe_firmware_facts_file)},
      {"flights", "Vehicles and what is known of single logs",
       "flights.toml. Paths are relative to its folder.", of_keys(residuals::describe_flights_file)},
      {"gains", "Gains of a position and attitude loop",
       "gains.toml. Kp, Kd, Ki or Lambda, K, or kp_xy, kp_z, ... with mass.",
       of_keys(stability::describe_gains_file)},
      {"grid", "Axes of a sweep and what to compute", "grid.toml. Paths are relative to its folder.",
       of_keys(stability::describe_grid_file)},
      {"model", "A vehicle and the effects that act on it", "model.toml.",
       of_keys(stability::describe_model_file)},
      {"network", "A network: one kind of vehicle or several",
       "network.toml. Paths are relative to its folder.", of_keys(files::describe_network_file)},
      {"policy", "Checks of a release and their limits",
       "Policy of `gate`. Paths are relative to its folder. A check runs if its table is here.",
       of_keys(gate::describe_policy_file)},
      {"samples", "Inputs and outputs recorded from a network",
       "Recorded inputs and outputs for `certify --samples`.", of_keys(files::describe_samples_file)},
      {"swarm", "How the vehicles of a swarm disturb one another", "swarm.toml.",
       of_keys(stability::describe_swarm_file)},
      {"sweep-points", "Points of a sweep", "sweep.json of `sweep` and `merge`.",
       stability::describe_points_file},
      {"sweep-shard", "One part of a sweep", "File of one part of `sweep --shard`.",
       stability::describe_shard_file},
      {"tracking-certificate", "Proofs about the gains of position loops",
       "What `swarmcert bound --verified -o FILE` writes and `swarmcert check` verifies.",
       [](files::Record& record) { describe(record, TrackingCertificate{}); }},
  };
  return all;
}

}  // namespace swarmcert::analysis
