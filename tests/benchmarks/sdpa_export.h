/// @file Export of LipSDP-Neuron in the sparse SDPA format, for comparison with other solvers.
#pragma once

#include <ostream>

#include "lipschitz/solver/lipsdp_solver.h"

namespace swarmcert::benchmarks {

/// Writes   min rho   s.t.   rho diag(I, 0) - sum_i t_i (a_i e_i' + e_i a_i') - blockdiag(0, M_K' M_K) >= 0
/// as SDPA's   min c'x   s.t.   sum_i x_i F_i - F_0 >= 0   with x = (rho, t); see lipsdp_solver.h for a_i.
void write_sdpa(const lipschitz::ReluChain& chain, std::ostream& out);

}  // namespace swarmcert::benchmarks
