#include "analysis/gate/checks/checks.h"

namespace swarmcert::gate {

const std::vector<CheckKind>& check_kinds() {
  static const std::vector<CheckKind> kinds = {
      {"hashes", "files are the approved ones", "", nullptr, read_hashes},
      {"certificate", "accepted, of these weights, in the flown precision", "network,certificate",
       describe_certificate_keys, read_certificate},
      {"lipschitz", "proved Lipschitz constants", "network", describe_lipschitz_keys, read_lipschitz},
      {"spectral_norms", "of every layer, against the declared gamma", "network",
       describe_spectral_norms_keys, read_spectral_norms},
      {"float32_error", "the evaluation in flight against the exact function", "network",
       describe_float32_error_keys, read_float32_error},
      {"range", "values of the network over the box", "network", describe_range_keys, read_range},
      {"theorem", "hypotheses of the tracking theorem", "gains,model", describe_theorem_keys, read_theorem},
      {"tracking", "bound on the tracking error", "gains,model", describe_tracking_keys, read_tracking},
      {"small_gain", "margin of the swarm's small gain", "gains,model,swarm", describe_small_gain_keys,
       read_small_gain},
      {"match", "the exported source and the ELF are this network", "network", describe_match_keys,
       read_match},
      {"firmware_facts", "flash, RAM, stack and times", "network,facts", describe_firmware_facts_keys,
       read_firmware_facts},
      {"residual", "the model on reference flights", "model,flights", describe_residual_keys, read_residual},
      {"regression", "against the baseline", "", describe_regression_keys, read_regression},
  };
  return kinds;
}

}  // namespace swarmcert::gate
