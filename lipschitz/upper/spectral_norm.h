/// @file Upper and lower bounds on spectral norms, with proofs.
#pragma once

#include <optional>
#include <vector>

#include "lipschitz/checker/bounds.h"
#include "lipschitz/upper/lmi_proof.h"
#include "nn/weights/network.h"

namespace swarmcert::lipschitz {

/// |W|_2 of one layer: lower <= |W|_2 <= upper in exact arithmetic for the weights as stored.
struct SpectralNorm {
  Enclosure norm{LowerBound(0), UpperBound(0)};
  std::vector<double> lower_vector;  ///< v with |W v| >= lower |v|, [inputs]
  UpperProof upper_proof;            ///< rho I - W W' >= 0 or rho I - W' W >= 0
};

/// Encloses the largest singular value of `layer.weights`.
///
/// A symmetric eigenvalue decomposition of the smaller Gram matrix gives an estimate. The lower bound is the exact
/// Rayleigh quotient of the eigenvector, rounded down. The upper bound is an exact proof that rho I minus the Gram
/// matrix is positive semidefinite, with rho a few units in the last place above the estimate. The relative width of
/// the enclosure is about 1e-13 for 40 x 40.
/// @param limit a value of interest to the caller, such as gamma. If the norm is closer to it than the width of the
///   enclosure, proofs with exactly this bound are tried first.
/// @throws std::invalid_argument if an entry is not finite.
SpectralNorm spectral_norm(const files::Layer& layer, std::optional<double> limit = std::nullopt);

/// Requires moderate weights.
/// @throws files::InputError if weights, biases or a bound on a network's slope exceed 1e150, because no bound can then
///   be computed in double.
void require_moderate(const files::Network& network);

/// Returns the product of the upper bounds `factors`, rounded up: an upper bound on the product of the true values.
UpperBound product_up(const std::vector<UpperBound>& factors);

}  // namespace swarmcert::lipschitz
