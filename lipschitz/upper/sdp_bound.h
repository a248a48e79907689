/// @file LipSDP-Neuron bounds, proved in exact arithmetic.
#pragma once

#include <optional>
#include <vector>

#include "lipschitz/base/stop.h"
#include "lipschitz/solver/lipsdp_solver.h"
#include "lipschitz/upper/lmi_proof.h"

namespace swarmcert::lipschitz {

struct SdpOptions {
  Stop stop;  ///< ends the search; the last iterate that can be proved is the bound
  /// A bound that is already proved. After a stop, iterates above it are not proved, because the exact proof of a large
  /// program takes a second.
  std::optional<UpperBound> known;
  /// See InteriorPointOptions. A larger gap makes the search shorter.
  double relative_gap = InteriorPointOptions().relative_gap;
};

/// Result of a search for an SDP bound.
struct SdpBound {
  std::optional<UpperProof>
      proof;            ///< nothing if no iterate could be proved or none is below the known bound
  Estimate optimum{0};  ///< optimum of the semidefinite program, in floating point; 0 if none was solved
  LipSdpStop stop = LipSdpStop::kNothingRun;
  int iterations = 0;
};

/// Returns the least provable LipSDP-Neuron bound of the chain M_K relu(... relu(M_1 x + b_1) ...) + b_K for all
/// inputs.
///
/// Solves the semidefinite program in floating point and proves the last iterate of the solver that can be proved in
/// exact arithmetic. For the networks measured, the bound is within a relative 1e-8 or so of the optimum. Neurons
/// without inputs or without effect are removed from the program first. For a chain without hidden layers, the bound is
/// the spectral norm and is proved directly.
/// @param stages M_1 .. M_K exactly as the checker builds them.
SdpBound sdp_bound(const std::vector<check::Matrix>& stages, const SdpOptions& options = {});

}  // namespace swarmcert::lipschitz
