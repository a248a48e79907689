/// Calls parse_network() with arbitrary text: InputError, or a network that satisfies the invariant of Network.
#include <cstdint>
#include <cstdlib>

#include "nn/base/input_error.h"
#include "nn/weights/network.h"

namespace {

using namespace swarmcert::files;

/// A one-layer network whose file name states its size: "6x20" has 6 inputs and 20 outputs.
Weights sized(const std::string& path, const LayerChoice&) {
  Weights weights;
  weights.path = path;
  const std::size_t slash = path.rfind('/');
  const std::string name = slash == std::string::npos ? path : path.substr(slash + 1);
  Layer layer;
  layer.inputs = name.substr(0, 1) == "4" ? 4 : name.substr(0, 1) == "6" ? 6 : 20;
  layer.outputs = name.find("x20") != std::string::npos ? 20 : 1;
  weights.layers.push_back(layer);
  return weights;
}

void demand(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const Network network = parse_network(text, "folder/network.toml", sized);
    demand(!network.phi.empty() && !network.rho.empty());
    for (const auto& [kind, phi] : network.phi) {
      for (const auto& [other, rho] : network.rho) demand(phi.outputs() == rho.inputs());
      const auto inputs = static_cast<std::size_t>(phi.inputs());
      if (kind == "ground") continue;
      if (!network.input_order.empty()) demand(network.input_order.size() == inputs);
      if (network.clamp)
        demand(network.clamp->lower.size() == inputs && network.clamp->upper.size() == inputs);
    }
  } catch (const InputError&) {
  }
  return 0;
}
