/// @file A Lipschitz bound layer by layer, in closed form: the answer that a network of any size gets within seconds.
#pragma once

#include <optional>
#include <vector>

#include "lipschitz/checker/dyadic.h"
#include "lipschitz/upper/lmi_proof.h"

namespace swarmcert::lipschitz {

/// ECLipsE-Fast, Xu and Sivaranjani 2024: LipSDP with one multiplier per layer in closed form; X_0 = I,
///   tau_k = 1 / |M_k X_{k-1}^{-1} M_k'|_2,  X_k = 2 tau_k I - tau_k^2 M_k X_{k-1}^{-1} M_k',
/// and rho = |M_K X_{K-1}^{-1} M_K'|_2, t_k = rho tau_k. The multipliers are then proved in exact arithmetic like those
/// of the semidefinite program, with a rho that is larger by 1e-12 or a little more.
///
/// At most the product of the layers' spectral norms, at least the LipSDP-Neuron bound, both up to that margin. Costs
/// one factorisation per layer, and the proof: a second for four layers of 320 neurons or 64 layers of 40.
/// @param stages M_1 .. M_K as the checker builds them, exactly. Neurons that no input reaches or that reach no output
///   are taken out first.
/// @returns nothing where no proof was found, as for weights whose squares leave the range of double.
std::optional<UpperProof> eclipse_fast(const std::vector<check::Matrix>& stages);

}  // namespace swarmcert::lipschitz
