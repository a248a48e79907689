/// @file The outputs of a network as affine forms.
#pragma once

#include "nn/weights/weights.h"
#include "stability/reach/affine_form.h"

namespace swarmcert::stability {

/// Returns forms that contain the outputs of the network, in real arithmetic, for all inputs in `x`; [outputs]. A
/// sigmoid or tanh becomes its tangent at the centre of its inputs, with the second derivative over all of them as an
/// error. Within the network these errors are symbols too; in the outputs they are part of the radius.
/// @param x one form per input.
/// @throws std::invalid_argument if `x` has another length, an activation is not ReLU, sigmoid or tanh, or a layer is
///   not exact.
AffineVector network_values(const files::Weights& network, AffineVector x);

}  // namespace swarmcert::stability
