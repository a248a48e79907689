/// @file Round-off errors of the layers of a ReLU network in float32, and their propagation to the outputs. Not for
/// users.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "lipschitz/values/affine_forms.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// Unit round-off u: the relative error of a sum or a product in float32.
inline constexpr double kFloatUnit = 0x1p-24;

/// Returns an upper bound on |fl(x) - x| for |x| <= size, where fl rounds to the nearest float32: half the distance
/// between floats just above `size`. It lies between u size / 2 and u size, u = 2^-24; 2^-150 below the normal floats.
double half_float_step(double size);

/// Returns a bound, entry by entry, on |fl(W h + b) - (W h + b)| in the order of summation of nn/dense_layer.h, for any
/// float32 h with lower <= h <= upper; infinite if it might overflow.
///
/// The sum starts from b. Each product and each sum is rounded, with an error of at most half_float_step() of its
/// magnitude. The magnitude of a partial sum is bounded by the interval of its exact value and by the errors so far. A
/// product with h_j = 0 and its addition are exact, as are a product with a power of two, apart from underflow, and the
/// first addition to a bias of 0. Fused multiply-adds round less often.
/// @param forms affine forms that also enclose h, which give tighter intervals of the partial sums; null: none.
Eigen::VectorXd layer_rounding(const ReachLayer& layer, const Eigen::VectorXd& lower,
                               const Eigen::VectorXd& upper, const AffineForms* forms = nullptr);

/// Errors of a float32 evaluation over a part of the box, entry by entry and layer by layer.
struct LayerErrors {
  std::vector<Eigen::VectorXd> made;   ///< error of y_k from the round-off of layer k alone
  std::vector<Eigen::VectorXd> total;  ///< error of y_k including the errors of previous layers
};

/// Largest number of inputs for which affine forms are used: a layer costs about this many times as much as with
/// intervals.
inline constexpr Eigen::Index kMostFormInputs = 32;

/// Returns the errors of all layers. Values are enclosed by their bounds and, for at most kMostFormInputs inputs, by
/// affine forms.
/// @param before the error of the inputs of the first layer.
LayerErrors layer_errors(const ReachNetwork& chain, const Reach& reach, const Eigen::VectorXd& before);

/// Returns for each k an upper bound on |d y_K / d y_k|, entry by entry [outputs x neurons]: by backward interval
/// arithmetic through neurons whose y is anywhere within `reach` and `errors`. A change of y_k within the errors
/// changes the output of the exact layers by at most this matrix times the change, because the derivative along the
/// segment is within these bounds.
std::vector<Eigen::MatrixXd> sensitivities(const ReachNetwork& chain, const Reach& reach,
                                           const LayerErrors& errors);

}  // namespace swarmcert::lipschitz
