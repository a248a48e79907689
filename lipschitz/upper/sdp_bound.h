/// @file LipSDP-Neuron bounds that hold in exact arithmetic.
#pragma once

#include <optional>
#include <vector>

#include "lipschitz/base/stop.h"
#include "lipschitz/solver/lipsdp_solver.h"
#include "lipschitz/upper/lmi_proof.h"

namespace swarmcert::lipschitz {

struct SdpOptions {
  Stop stop;  ///< ends the search; the last iterate that can be proved is the bound
  /// A bound that is proved already. A search that was stopped does not prove iterates above it: the exact proof of a
  /// large program takes a second.
  std::optional<UpperBound> known;
  /// As InteriorPointOptions has it: a search that may end further from the optimum is shorter.
  double relative_gap = InteriorPointOptions().relative_gap;
};

/// What a search for an SDP bound came to.
struct SdpBound {
  std::optional<UpperProof>
      proof;            ///< nothing where no iterate could be proved, or none is below what is known
  Estimate optimum{0};  ///< of the semidefinite program, in floating point; 0 where none was solved
  LipSdpStop stop = LipSdpStop::kNothingRun;
  int iterations = 0;
};

/// The least provable LipSDP-Neuron bound of the chain M_K relu(... relu(M_1 x + b_1) ...) + b_K for all inputs.
///
/// Solves the semidefinite program in floating point and proves the solver's last iterate that can be proved in
/// exact arithmetic; within about 1e-8 relative of the optimum for the networks this was measured on. Neurons
/// without inputs or without effect are taken out of the program first. A chain without hidden layers, for which
/// the bound is the spectral norm, is proved directly.
/// @param stages M_1 .. M_K as the checker builds them, exactly.
SdpBound sdp_bound(const std::vector<check::Matrix>& stages, const SdpOptions& options = {});

}  // namespace swarmcert::lipschitz
