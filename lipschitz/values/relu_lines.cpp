#include "lipschitz/values/relu_lines.h"

#include <cmath>

#include "lipschitz/checker/products.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// One neuron's numbers.
struct Line {
  double slope, offset, line_error, bias, layer_error;
};

SWARMCERT_WIDE void pull_back_one(const Line& line, double below, Index forms, double* __restrict v,
                                  double* __restrict constants, double* __restrict error) {
  const auto [slope, offset, line_error, bias, layer_error] = line;
  for (Index r = 0; r < forms; ++r) {
    const double positive = v[r] > 0 ? v[r] : 0, negative = v[r] > 0 ? 0 : v[r];
    const double next = positive * slope + negative * below;  // one of them is zero
    constants[r] += positive * offset + next * bias;
    error[r] += positive * line_error + std::abs(next) * layer_error;
    v[r] = next;
  }
}

/// The same with a lower slope for each form.
SWARMCERT_WIDE void pull_back_one(const Line& line, const double* __restrict below, Index forms,
                                  double* __restrict v, double* __restrict constants,
                                  double* __restrict error) {
  const auto [slope, offset, line_error, bias, layer_error] = line;
  for (Index r = 0; r < forms; ++r) {
    const double positive = v[r] > 0 ? v[r] : 0, negative = v[r] > 0 ? 0 : v[r];
    const double next = positive * slope + negative * below[r];
    constants[r] += positive * offset + next * bias;
    error[r] += positive * line_error + std::abs(next) * layer_error;
    v[r] = next;
  }
}

}  // namespace

void pull_back(const ReluLines& lines, const MatrixXd* below, MatrixXd& lambda, VectorXd& constants,
               VectorXd& error) {
  const Index forms = lambda.rows();
  for (Index n = 0; n < lambda.cols(); ++n) {
    const Line line{lines.slope(n), lines.offset(n), lines.line_error(n), lines.bias(n),
                    lines.layer_error(n)};
    double* const v = lambda.data() + n * forms;
    // Lower slopes of neurons that are on mean nothing.
    if (below != nullptr && lines.offset(n) > 0)
      pull_back_one(line, below->data() + lines.neurons[static_cast<std::size_t>(n)] * forms, forms, v,
                    constants.data(), error.data());
    else
      pull_back_one(line, lines.below(n), forms, v, constants.data(), error.data());
  }
}

}  // namespace swarmcert::lipschitz
