#include "stability/bounds/loops/kernel_walk.h"

#include <Eigen/Dense>

namespace swarmcert::stability {

using Eigen::MatrixXd;
using Eigen::VectorXd;

KernelWalk::KernelWalk(const SampledAdjoint& adjoint) : adjoint_(&adjoint), powers_{adjoint.map()} {
  columns_.resize(adjoint.map().rows(), kColumns);
  while (std::ldexp(1.0, static_cast<int>(powers_.size())) < static_cast<double>(adjoint.periods()))
    powers_.push_back(powers_.back() * powers_.back());
}

VectorXd KernelWalk::summed(const VectorXd& part) const {
  const MatrixXd& map = adjoint_->map();
  return (MatrixXd::Identity(map.rows(), map.cols()) - map).partialPivLu().solve(part);
}

void KernelWalk::set_kernel(const VectorXd& start, const VectorXd& end) {
  const auto step = [this](const VectorXd& c) -> VectorXd { return adjoint_->map() * c - c; };
  columns_.col(kStart) = start;
  columns_.col(kEnd) = end;
  columns_.col(kStartStep) = step(start);
  columns_.col(kEndStep) = step(end);
  columns_.col(kSecondStep) = step(columns_.col(kStartStep));
}

KernelWalk KernelWalk::of_force(const SampledAdjoint& adjoint) {
  KernelWalk walk(adjoint);
  const double h = adjoint.period_s();
  const VectorXd slope = VectorXd::Unit(adjoint.map().rows(), 0), start = VectorXd::Unit(slope.size(), 1);
  walk.set_kernel(start, start + h * slope);
  const VectorXd left = walk.summed(h * start + h * h / 2 * slope);
  walk.columns_.col(kLeft) = left;
  walk.columns_.col(kArea) = walk.summed(h * h / 2 * start + h * h * h / 6 * slope - h * left);
  return walk;
}

KernelWalk KernelWalk::of_held(const SampledAdjoint& adjoint, const VectorXd& input) {
  KernelWalk walk(adjoint);
  const double h = adjoint.period_s();
  const VectorXd kernel = adjoint.model().hold() * input / h;
  walk.set_kernel(kernel, kernel);
  const VectorXd left = walk.summed(h * kernel);
  walk.columns_.col(kLeft) = left;
  walk.columns_.col(kArea) = walk.summed(h * h / 2 * kernel - h * left);
  return walk;
}

KernelWalk KernelWalk::of_samples(const SampledAdjoint& adjoint, const VectorXd& input) {
  KernelWalk walk(adjoint);
  const VectorXd kernel = adjoint.model().hold() * input;
  walk.set_kernel(kernel, kernel);
  const VectorXd left = walk.summed(kernel);
  walk.columns_.col(kLeft) = left;
  walk.columns_.col(kArea) = walk.summed(-adjoint.period_s() * (adjoint.map() * left));
  return walk;
}

}  // namespace swarmcert::stability
