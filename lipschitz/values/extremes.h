/// @file Largest values of a ReLU network over a box by branch and bound, in exact arithmetic.
#pragma once

#include <Eigen/Core>

#include "lipschitz/base/box.h"
#include "lipschitz/values/reach.h"

namespace swarmcert::lipschitz {

/// What a search for the largest value of direction y_K over a box found.
struct Maximum {
  double upper = 0;   ///< at least the true maximum
  double value = 0;   ///< near direction f(x): an estimate
  Eigen::VectorXd x;  ///< in the box
  int nodes = 0;
};

struct MaximiseOptions {
  int nodes = 300;    ///< boxes
  double gap = 1e-6;  ///< ends where upper - value is at most this times |value|
  int jobs = 1;       ///< threads; the result does not depend on them
};

/// Best-first branch and bound. A box is bounded by one linear form with sharpened lower slopes, and is halved where an
/// interval Jacobian times its width is largest.
Maximum maximise(const ReachNetwork& network, const Eigen::RowVectorXd& direction, const Box& box,
                 const MaximiseOptions& options);

/// All outputs over the box, as the hull over up to `nodes` parts of it; and the largest Euclidean norm of the output.
struct Hull {
  Bounds bounds;
  double norm = 0;  ///< at least |y_K|_2
};
Hull hull(const ReachNetwork& network, const Box& box, int nodes);

}  // namespace swarmcert::lipschitz
