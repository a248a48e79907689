#include "analysis/gate/checks/checks.h"

namespace swarmcert::gate {

const std::vector<CheckKind>& check_kinds() {
  static const std::vector<CheckKind> kinds = {
      {"hashes", "files are the approved ones", read_hashes},
      {"certificate", "accepted, of these weights, in the flown precision", read_certificate},
      {"lipschitz", "proved Lipschitz constants", read_lipschitz},
      {"spectral_norms", "of every layer, against the declared gamma", read_spectral_norms},
      {"float32_error", "the evaluation in flight against the exact function", read_float32_error},
      {"range", "values of the network over the box", read_range},
      {"theorem", "hypotheses of the tracking theorem", read_theorem},
      {"tracking", "bound on the tracking error", read_tracking},
      {"small_gain", "margin of the swarm's small gain", read_small_gain},
      {"match", "the exported source and the ELF are this network", read_match},
      {"firmware_facts", "flash, RAM, stack and times", read_firmware_facts},
      {"residual", "the model on reference flights", read_residual},
      {"regression", "against the baseline", read_regression},
  };
  return kinds;
}

}  // namespace swarmcert::gate
