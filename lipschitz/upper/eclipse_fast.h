/// @file A layer-by-layer Lipschitz bound in closed form, within seconds for networks of any size.
#pragma once

#include <optional>
#include <vector>

#include "lipschitz/checker/dyadic.h"
#include "lipschitz/upper/lmi_proof.h"

namespace swarmcert::lipschitz {

/// ECLipsE-Fast, Xu and Sivaranjani 2024: LipSDP with one multiplier per layer in closed form; X_0 = I,
///   tau_k = 1 / |M_k X_{k-1}^{-1} M_k'|_2,  X_k = 2 tau_k I - tau_k^2 M_k X_{k-1}^{-1} M_k',
/// and rho = |M_K X_{K-1}^{-1} M_K'|_2, t_k = rho tau_k. The multipliers are then proved in exact arithmetic like those
/// of the semidefinite program, with rho increased by a relative 1e-12 or slightly more.
///
/// Up to that margin, the bound is at most the product of the layers' spectral norms and at least the LipSDP-Neuron
/// bound. Cost: one factorisation per layer and the proof; a second for four layers of 320 neurons or 64 layers of 40.
/// @param stages M_1 .. M_K exactly as the checker builds them. Neurons that no input reaches or that reach no output
///   are removed first.
/// @returns nothing if no proof was found, for example if squares of weights leave the range of double.
std::optional<UpperProof> eclipse_fast(const std::vector<check::Matrix>& stages);

}  // namespace swarmcert::lipschitz
