/// @file Affine enclosures of a ReLU network's layers over a box, propagated forward. Not for users.
#pragma once

#include <Eigen/Core>

#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// Returns a bound, with a wide margin, on the round-off error in double of a sum of `terms` products, relative to the
/// sum of their absolute values: gamma_(terms + 2) is below (terms + 3) 2^-53 (Higham 2002, section 3.1).
constexpr double sum_rounding(Eigen::Index terms) { return 0x1p-40 + 0x1p-50 * static_cast<double>(terms); }

/// y_i = centre_i + (slopes xi)_i + e_i at the point middle + half xi of the box, |xi_k| <= 1 and |e_i| <= radius_i, in
/// exact arithmetic. Unlike intervals, sums of the y preserve their common dependence on the inputs.
struct AffineForms {
  Eigen::MatrixXd slopes;  ///< [values x inputs]
  Eigen::VectorXd centre, radius;

  /// Returns an upper bound on |y_i - centre_i|.
  Eigen::VectorXd deviation() const;
  bool all_finite() const;
};

/// Returns the forms of the inputs.
AffineForms forms_of(const Box& box);
/// Returns the forms of W h + b + e, |e| <= bias_radius, for h as in `inputs`.
AffineForms layer_forms(const ReachLayer& layer, const AffineForms& inputs);
/// Returns the forms of relu(y) if y also lies within `bounds`: s y <= relu(y) <= s y + t for l < 0 < u, with s near
/// u / (u - l). Forms are not finite where the bounds are not.
AffineForms relu_forms(AffineForms y, const Bounds& bounds);
/// Returns the intersection of `bounds` with the intervals of the forms.
Bounds within(const Bounds& bounds, const AffineForms& forms);

}  // namespace swarmcert::lipschitz
