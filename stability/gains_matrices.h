/// @file Conversion of gains to Eigen matrices, for decompositions.
#pragma once

#include <Eigen/Core>

#include "stability/gains.h"

namespace swarmcert::stability {

inline Eigen::Vector3d to_eigen(const controller::Vector3<double>& v) { return {v.x, v.y, v.z}; }

inline Eigen::Matrix3d to_eigen(const Matrix3& m) {
  Eigen::Matrix3d result;
  for (int i = 0; i < 3; ++i) result.row(i) = to_eigen(m[static_cast<std::size_t>(i)]).transpose();
  return result;
}

}  // namespace swarmcert::stability
