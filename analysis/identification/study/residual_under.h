/// @file The residual of a track under another model than the one that it was loaded with.
#pragma once

#include <vector>

#include "analysis/residuals/force_residual.h"
#include "analysis/residuals/inputs.h"

namespace swarmcert::identification {

/// r in newton in W, one per record of `track`, also of records that are cut; see force_residual().
inline std::vector<Eigen::Vector3d> residual_under(const stability::Model& model,
                                                   const residuals::Inputs& inputs, residuals::Track track) {
  residuals::apply_model(model, inputs.kinds, inputs.rules, track);
  return residuals::force_residual(model, inputs.kinds, inputs.rules, track);
}

}  // namespace swarmcert::identification
