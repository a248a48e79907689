/// @file A quadratic form that bounds rho; it separates a deep set's bound into rho and each phi.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lipschitz/checker/lipschitz_lmi.h"

namespace swarmcert::lipschitz {

/// |rho(v) - rho(w)|^2 <= (v - w)' Q (v - w) for all v and w, so whatever the other terms of the sum are: with
/// (v - w) = W dz of phi's last layer, |df|^2 <= dz' (W' Q W) dz. `factor` shows check::quadratic_lmi() >= 0.
struct RhoForm {
  Eigen::MatrixXd q;      ///< symmetric, exactly these doubles
  std::vector<double> t;  ///< one multiplier per hidden neuron of rho
  check::Factor factor;
};

/// Q = S_vz S_zz^-1 S_zv of the inequality at multipliers `t`, the least one there is for them, and a little more, so
/// that it can be proved. With the joint optimum's t, phi in front of this form has the joint bound.
/// @param stages of rho, at least two, exactly; t one nonnegative multiplier per hidden neuron.
/// @returns nothing where it cannot be proved.
std::optional<RhoForm> rho_form(const std::vector<check::Matrix>& stages, const std::vector<double>& t);

}  // namespace swarmcert::lipschitz
