/// @file Affine enclosures of a ReLU network's layers over a box, from the inputs on. Not for users.
#pragma once

#include <Eigen/Core>

#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// A bound, with a wide margin, on the rounding in double of a sum of `terms` products, relative to the sum of their
/// absolute values: gamma_(terms + 2) is below (terms + 3) 2^-53 (Higham 2002, section 3.1).
constexpr double sum_rounding(Eigen::Index terms) { return 0x1p-40 + 0x1p-50 * static_cast<double>(terms); }

/// y_i = centre_i + (slopes xi)_i + e_i at the point middle + half xi of the box, |xi_k| <= 1 and |e_i| <= radius_i, in
/// exact arithmetic. Sums of the y keep what they have in common, which intervals forget.
struct AffineForms {
  Eigen::MatrixXd slopes;  ///< [values x inputs]
  Eigen::VectorXd centre, radius;

  /// At least |y_i - centre_i|.
  Eigen::VectorXd deviation() const;
  bool all_finite() const;
};

/// The forms of the inputs.
AffineForms forms_of(const Box& box);
/// The forms of W h + b + e, |e| <= bias_radius, for h as in `inputs`.
AffineForms layer_forms(const ReachLayer& layer, const AffineForms& inputs);
/// The forms of relu(y), where y also lies within `bounds`: s y <= relu(y) <= s y + t for l < 0 < u, s near
/// u / (u - l). Not finite where the bounds are not.
AffineForms relu_forms(AffineForms y, const Bounds& bounds);
/// The intersection of `bounds` with the intervals of the forms.
Bounds within(const Bounds& bounds, const AffineForms& forms);

}  // namespace swarmcert::lipschitz
