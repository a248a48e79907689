/// @file The residual of a track with a model other than the one with which it was loaded.
#pragma once

#include <vector>

#include "analysis/residuals/force_residual.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::residuals {

/// Returns r in newton in W, one per record of `track` including cut ones; see force_residual().
inline std::vector<Eigen::Vector3d> residual_under(const stability::Model& model, const Inputs& inputs,
                                                   Track track) {
  apply_model(model, inputs.kinds, inputs.rules, track);
  return force_residual(model, inputs.kinds, inputs.rules, track);
}

}  // namespace swarmcert::residuals
