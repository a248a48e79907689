/// @file Largest values of a ReLU network over a box by branch and bound, in exact arithmetic.
#pragma once

#include <Eigen/Core>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// Result of a search for the largest value of direction y_K over a box.
struct Maximum {
  double upper = 0;   ///< upper bound on the maximum
  double value = 0;   ///< estimate of direction f(x)
  Eigen::VectorXd x;  ///< point of the box
  int nodes = 0;
};

struct MaximiseOptions {
  int nodes = 300;    ///< maximum number of boxes
  double gap = 1e-6;  ///< stop when upper - value is at most this times |value|
  int jobs = 1;       ///< threads; the result does not depend on them
};

/// Maximises direction y_K by best-first branch and bound. A box is bounded by one linear form with sharpened lower
/// slopes and is halved along the coordinate with the largest interval Jacobian times width.
Maximum maximise(const ReachNetwork& network, const Eigen::RowVectorXd& direction, const Box& box,
                 const MaximiseOptions& options);

/// Bounds on all outputs over a box and on the Euclidean norm of the output.
struct Hull {
  Bounds bounds;
  double norm = 0;  ///< upper bound on |y_K|_2
};
/// Returns the hull over up to `nodes` parts of the box.
Hull hull(const ReachNetwork& network, const Box& box, int nodes);

}  // namespace swarmcert::lipschitz
