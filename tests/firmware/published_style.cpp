#include "published_style.h"

namespace swarmcert::tests {
namespace {

/// Accumulates the sum in memory; the weights of one output are `outputs` apart. Returns the start of the next layer.
[[gnu::noinline]] const float* apply(int inputs, int outputs, const float* weights, const float* x, float* y,
                                     bool has_relu) {
  const float* const biases = weights + inputs * outputs;
  for (int i = 0; i < outputs; ++i) {
    y[i] = 0;
    for (int j = 0; j < inputs; ++j) y[i] += x[j] * weights[j * outputs + i];
    y[i] += biases[i];
    if (has_relu && y[i] < 0) y[i] = 0;
  }
  return biases + outputs;
}

}  // namespace

void published_phi(const float* values, const float* input, float* buffers) {
  float *const a = buffers, *const b = buffers + 40;
  values = apply(6, 25, values, input, a, true);
  values = apply(25, 40, values, a, b, true);
  values = apply(40, 40, values, b, a, true);
  apply(40, 40, values, a, b, false);
}

void published_rho(const float* values, const float* input, float* buffers) {
  float *const a = buffers, *const b = buffers + 40;
  values = apply(40, 40, values, input, a, true);
  values = apply(40, 40, values, a, b, true);
  values = apply(40, 40, values, b, a, true);
  apply(40, 1, values, a, b, false);
}

}  // namespace swarmcert::tests
