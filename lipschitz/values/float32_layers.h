/// @file What float32 arithmetic does to the layers of a ReLU network, and how much of it reaches the outputs. Not for
/// users.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/values/affine_forms.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// u: a sum or a product in float32 is off by at most this share of itself.
inline constexpr double kFloatUnit = 0x1p-24;

/// How far fl(W h + b) in the order of nn/dense_layer.h is at most from W h + b, entry by entry, for any float32 h with
/// lower <= h <= upper; infinite where it might overflow.
///
/// The sum starts from b; each product is rounded, off by at most u |w_j h_j| + 2^-150, and so is each sum, off by at
/// most u times its size, u = 2^-24. The size of a partial sum comes from the interval of its exact value and from what
/// was off before. A product with h_j = 0 is exact, and so is its addition. Fused products round less often.
/// @param forms where h lies as well, so that partial sums lie in the intervals of their own forms; null: nowhere else.
Eigen::VectorXd layer_rounding(const ReachLayer& layer, const Eigen::VectorXd& lower,
                               const Eigen::VectorXd& upper, const AffineForms* forms = nullptr);

/// Errors of a float32 evaluation over a part of the box, entry by entry and layer by layer.
struct LayerErrors {
  std::vector<Eigen::VectorXd> made;   ///< of y_k by itself: what the layer's own rounding adds
  std::vector<Eigen::VectorXd> total;  ///< of y_k: with what the layers before got wrong
};

/// With affine forms a layer costs about as much as intervals times the number of inputs: not used above this number.
inline constexpr Eigen::Index kMostFormInputs = 32;

/// Values lie in their bounds and, with at most kMostFormInputs inputs, in affine forms.
/// @param before the error of what the first layer takes in.
LayerErrors layer_errors(const ReachNetwork& chain, const Reach& reach, const Eigen::VectorXd& before);

/// At least |d y_K / d y_k|, entry by entry [outputs x neurons], for each k: by interval arithmetic backwards through
/// neurons whose y is anywhere within `reach` and `errors`. A change of y_k within the errors changes the output,
/// through exact layers, by at most this matrix times its size: its derivative along the way is within these bounds.
std::vector<Eigen::MatrixXd> sensitivities(const ReachNetwork& chain, const Reach& reach,
                                           const LayerErrors& errors);

}  // namespace swarmcert::lipschitz
