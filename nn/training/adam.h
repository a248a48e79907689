/// @file The Adam optimizer (Kingma and Ba 2015).
#pragma once

#include <cstdint>

#include "nn/training/layout.h"

namespace swarmcert::training {

/// Performs the update m <- 0.9 m + 0.1 g, v <- 0.999 v + 0.001 g^2,
/// theta <- theta - rate m / (1 - 0.9^t) / (sqrt(v / (1 - 0.999^t)) + 1e-8).
/// A plain struct, whose members are stored in checkpoints.
struct Adam {
  Vector first_moment, second_moment;
  std::uint64_t steps = 0;

  explicit Adam(Eigen::Index size) : first_moment(Vector::Zero(size)), second_moment(Vector::Zero(size)) {}

  void step(Vector& theta, const Vector& gradient, double rate);
};

}  // namespace swarmcert::training
