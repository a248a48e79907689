/// @file Boxes and certifications shared by tests of networks with activations other than ReLU on a box.
#pragma once

#include <map>
#include <stdexcept>
#include <string>

#include "lipschitz/base/box.h"
#include "lipschitz/certify.h"
#include "lipschitz/checker/values.h"
#include "nn/random_network.h"

namespace swarmcert::tests {

using lipschitz::Domain;

inline files::Weights with(files::Weights weights, files::Activation activation) {
  set_activation(weights, activation);
  return weights;
}

/// Returns a cube with half-width `radius` around a point that is not symmetric.
inline lipschitz::Box cube(int inputs, double radius) {
  lipschitz::Box box;
  for (int k = 0; k < inputs; ++k) {
    const double middle = 0.3 - 0.2 * k;
    box.lower.push_back(middle - radius);
    box.upper.push_back(middle + radius);
  }
  return box;
}

inline check::Intervals intervals(const lipschitz::Box& box) {
  return {{box.lower.begin(), box.lower.end()}, {box.upper.begin(), box.upper.end()}};
}

/// By the slopes over the whole box, unless another method is given.
inline lipschitz::CertifyOptions on_box(const Domain& domain,
                                        lipschitz::UpperMethod method = lipschitz::UpperMethod::kSdp) {
  lipschitz::CertifyOptions options;
  options.domain = domain;
  options.method = method;
  options.lower.rounds = 1;
  options.jobs = 1;
  return options;
}

/// Returns the bound of a function with respect to all inputs.
inline const lipschitz::CertifiedBound& bound_of(const lipschitz::Certification& found,
                                                 const files::FunctionId& function) {
  for (const lipschitz::CertifiedBound& bound : found.bounds)
    if (bound.function == function && bound.block == "all") return bound;
  throw std::logic_error("no bound of " + function.name());
}

}  // namespace swarmcert::tests
