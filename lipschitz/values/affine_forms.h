/// @file Affine enclosures of a ReLU network's layers over a box, from the inputs on. Not for users.
#pragma once

#include <Eigen/Core>

#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// y_i = centre_i + (slopes xi)_i + e_i at the point middle + half xi of the box, |xi_k| <= 1 and |e_i| <= radius_i, in
/// exact arithmetic. Sums of the y keep what they have in common, which intervals forget.
struct AffineForms {
  Eigen::MatrixXd slopes;  ///< [values x inputs]
  Eigen::VectorXd centre, radius;

  /// At least |y_i - centre_i|.
  Eigen::VectorXd deviation() const;
  bool all_finite() const;
};

/// Of the inputs.
AffineForms forms_of(const Box& box);
/// Of W h + b + e, |e| <= bias_radius, for h as in `inputs`.
AffineForms layer_forms(const ReachLayer& layer, const AffineForms& inputs);
/// Of relu(y), where y also lies within `bounds`: s y <= relu(y) <= s y + t for l < 0 < u, s near u / (u - l). Not
/// finite where the bounds are not.
AffineForms relu_forms(AffineForms y, const Bounds& bounds);
/// What is left of `bounds` by the forms.
Bounds within(const Bounds& bounds, const AffineForms& forms);

}  // namespace swarmcert::lipschitz
