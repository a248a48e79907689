// Prints the bits of the guarded evaluation. Exits with 1 if they differ from an evaluation in which each product and
// sum goes through memory; with --expect-fused, also if the unguarded loop gives the same bits, because then this
// program could not detect a difference.
#include <cstdio>
#include <cstring>

#include "network.h"

namespace {

bool failed = false;

void expect(bool holds, const char* claim) {
  if (!holds) std::fprintf(stderr, "FAILED: %s\n", claim);
  failed = failed || !holds;
}

/// Evaluates f(network.input) in the documented order; values that pass through `volatile` cannot be fused.
template <typename Scalar>
Output<Scalar> through_memory(const FixedNetwork<Scalar>& network) {
  Scalar x[kWidest], y[kWidest];
  for (int j = 0; j < kSizes[0]; ++j) x[j] = network.input[j];
  for (int k = 0; k < kLayers; ++k) {
    for (int i = 0; i < kSizes[k + 1]; ++i) {
      volatile Scalar sum = network.biases[k][i];
      for (int j = 0; j < kSizes[k]; ++j) {
        volatile Scalar product = network.weights[k][i * kSizes[k] + j] * x[j];
        sum = sum + product;
      }
      y[i] = k + 1 < kLayers && sum < Scalar(0) ? Scalar(0) : sum;
    }
    for (int i = 0; i < kSizes[k + 1]; ++i) x[i] = y[i];
  }
  Output<Scalar> output;
  for (int i = 0; i < kSizes[kLayers]; ++i) output.y[i] = x[i];
  return output;
}

/// One neuron: a*a + c with a = 1 + u, c = -(1 + 2u), where u is the spacing of numbers above 1. Exactly,
/// a*a = 1 + 2u + u^2; u^2 is less than half the spacing u, so the rounded product is 1 + 2u and the sum is 0. With
/// fusion, the sum is u^2; the two following layers multiply by 1/u each, which makes it 1.
template <typename Scalar>
FixedNetwork<Scalar> cancelling(Scalar u) {
  FixedNetwork<Scalar> network;
  for (int k = 0; k < kLayers; ++k) {
    for (Scalar& w : network.weights[k]) w = 0;
    for (Scalar& b : network.biases[k]) b = 0;
  }
  network.input[0] = 1 + u;
  network.weights[0][0] = 1 + u;
  network.biases[0][0] = -(1 + 2 * u);
  network.weights[1][0] = 1 / u;
  network.weights[2][0] = 1 / u;
  return network;
}

template <typename Scalar>
bool same_bits(const Output<Scalar>& a, const Output<Scalar>& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

template <typename Scalar>
void check(Scalar u, bool expect_fused) {
  const FixedNetwork<Scalar> network;
  const Output<Scalar> output = guarded(network);
  for (const Scalar y : output.y) std::printf("%a ", static_cast<double>(y));
  std::printf("\n");
  expect(same_bits(output, through_memory(network)), "the evaluator rounds each product before the sum");
  expect(guarded(cancelling(u)).y[0] == 0, "the rounded product cancels the bias exactly");
  if (expect_fused) {
    expect(!same_bits(unguarded(network), output), "the unguarded loop gives other bits");
    expect(unguarded(cancelling(u)).y[0] == 1, "the unguarded loop keeps what rounding would drop");
  }
}

}  // namespace

int main(int argc, char** argv) {
  const bool asked = argc > 1 && std::strcmp(argv[1], "--expect-fused") == 0;
  if (asked && !has_fused_instructions()) {
    std::printf("NOTICE: no fused multiply-add on this machine; that unguarded code differs is not shown\n");
  }
  check(1.1920928955078125e-07f, asked && has_fused_instructions());
  check(2.220446049250313e-16, asked && has_fused_instructions());
  expect(!guarded_is_fused(), "arithmetic_is_fused() is false");
  return failed ? 1 : 0;
}
