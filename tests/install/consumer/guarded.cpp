#include <swarmcert/nn/mlp.h>

#include "network.h"

namespace nn = swarmcert::nn;

// Unmangled names, for the disassembler.
extern "C" {
[[gnu::noinline]] void guarded_evaluate_f32(const nn::Mlp<float>& f, const float* x, float* y,
                                            float* scratch) {
  nn::evaluate(f, x, y, scratch);
}
[[gnu::noinline]] void guarded_evaluate_f64(const nn::Mlp<double>& f, const double* x, double* y,
                                            double* scratch) {
  nn::evaluate(f, x, y, scratch);
}
}

namespace {

template <typename Scalar, typename Evaluate>
Output<Scalar> run(const FixedNetwork<Scalar>& network, Evaluate evaluate) {
  nn::DenseLayer<Scalar> layers[kLayers];
  for (int k = 0; k < kLayers; ++k)
    layers[k] = {network.weights[k], network.biases[k], kSizes[k + 1], kSizes[k]};
  Output<Scalar> output;
  Scalar scratch[2 * kWidest];
  evaluate(nn::Mlp<Scalar>{layers, kLayers}, network.input, output.y, scratch);
  return output;
}

}  // namespace

Output<float> guarded(const FixedNetwork<float>& network) { return run(network, guarded_evaluate_f32); }
Output<double> guarded(const FixedNetwork<double>& network) { return run(network, guarded_evaluate_f64); }
bool guarded_is_fused() { return nn::arithmetic_is_fused(); }
