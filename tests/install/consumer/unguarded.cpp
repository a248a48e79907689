#include "network.h"

extern "C" [[gnu::noinline]] float unguarded_multiply_add(float a, float b, float c) { return a * b + c; }

namespace {

template <typename Scalar>
Output<Scalar> run(const FixedNetwork<Scalar>& network) {
  Scalar x[kWidest], y[kWidest];
  for (int j = 0; j < kSizes[0]; ++j) x[j] = network.input[j];
  for (int k = 0; k < kLayers; ++k) {
    for (int i = 0; i < kSizes[k + 1]; ++i) {
      y[i] = network.biases[k][i];
      for (int j = 0; j < kSizes[k]; ++j) y[i] += network.weights[k][i * kSizes[k] + j] * x[j];
      if (k + 1 < kLayers && y[i] < Scalar(0)) y[i] = Scalar(0);
    }
    for (int i = 0; i < kSizes[k + 1]; ++i) x[i] = y[i];
  }
  Output<Scalar> output;
  for (int i = 0; i < kSizes[kLayers]; ++i) output.y[i] = x[i];
  return output;
}

}  // namespace

Output<float> unguarded(const FixedNetwork<float>& network) { return run(network); }
Output<double> unguarded(const FixedNetwork<double>& network) { return run(network); }

bool has_fused_instructions() {
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
  return true;
#else
  return false;
#endif
}
