#include "nn/training/adam.h"

#include <cmath>

namespace swarmcert::training {

void Adam::step(Vector& theta, const Vector& gradient, double rate) {
  ++steps;
  first_moment = 0.9f * first_moment + 0.1f * gradient;
  second_moment = 0.999f * second_moment + 0.001f * gradient.cwiseAbs2();
  const double t = static_cast<double>(steps);
  const float first_scale = static_cast<float>(rate / (1 - std::pow(0.9, t)));
  const float second_scale = static_cast<float>(1 / (1 - std::pow(0.999, t)));
  // Eigen's square root of float arrays uses an approximate instruction whose result depends on the processor.
  const auto root = [](float x) { return std::sqrt(x); };
  theta.array() -=
      first_scale * first_moment.array() / ((second_scale * second_moment.array()).unaryExpr(root) + 1e-8f);
}

}  // namespace swarmcert::training
