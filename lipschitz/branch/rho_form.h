/// @file A quadratic form that bounds rho, so that rho and each phi of a deep set can be bounded separately.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lipschitz/checker/lipschitz_lmi.h"

namespace swarmcert::lipschitz {

/// |rho(v) - rho(w)|^2 <= (v - w)' Q (v - w) for all v and w, hence for any other terms of the sum. With v - w = W dz
/// for the last layer of phi, |df|^2 <= dz' (W' Q W) dz. `factor` proves check::quadratic_lmi() >= 0.
struct RhoForm {
  Eigen::MatrixXd q;      ///< symmetric, exactly these doubles
  std::vector<double> t;  ///< one multiplier per hidden neuron of rho
  check::Factor factor;
};

/// Returns Q = S_vz S_zz^-1 S_zv of the inequality at multipliers `t`, the least Q for them, with a small margin that
/// makes it provable. With the multipliers of the joint optimum, phi in front of this form has the joint bound.
/// @param stages exact stages of rho, at least two.
/// @param t      one nonnegative multiplier per hidden neuron.
/// @returns nothing if Q cannot be proved.
std::optional<RhoForm> rho_form(const std::vector<check::Matrix>& stages, const std::vector<double>& t);

}  // namespace swarmcert::lipschitz
