/// Calls parse_weights() with arbitrary bytes: InputError, or a network that satisfies the invariant of Weights.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "nn/base/input_error.h"
#include "nn/weights/safetensors.h"
#include "nn/weights/weights.h"

namespace {

using namespace swarmcert::files;

void demand(bool holds) {
  if (!holds) std::abort();
}

void check_invariant(const Weights& weights) {
  demand(!weights.layers.empty());
  int width = weights.inputs();
  for (const Layer& layer : weights.layers) {
    demand(layer.inputs == width && layer.outputs > 0 && layer.inputs > 0);
    demand(layer.weights.size() ==
           static_cast<std::size_t>(layer.outputs) * static_cast<std::size_t>(layer.inputs));
    demand(layer.biases.size() == static_cast<std::size_t>(layer.outputs));
    for (const double number : layer.weights) demand(std::isfinite(number));
    for (const double number : layer.biases) demand(std::isfinite(number));
    width = layer.outputs;
  }
}

void check_round_trip(const Weights& weights) {
  std::string bytes;
  try {
    bytes = safetensors_bytes(weights);
  } catch (const InputError&) {
    return;  // a name that is not UTF-8
  }
  const Weights again = parse_weights(bytes, "again");
  demand(again.layers.size() == weights.layers.size() && again.precision == weights.precision);
  for (std::size_t k = 0; k < weights.layers.size(); ++k) {
    demand(again.layers[k].name == weights.layers[k].name);
    demand(again.layers[k].weights == weights.layers[k].weights);
    demand(again.layers[k].biases == weights.layers[k].biases);
  }
}

}  // namespace

/// The first byte selects --key, so that nested checkpoints are reached as well.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const char* const kKeys[] = {"", "model", "model.net"};
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    const Weights weights = parse_weights(bytes, "fuzz", kKeys[data[0] % 3]);
    check_invariant(weights);
    check_round_trip(weights);
  } catch (const InputError&) {
  }
  return 0;
}
