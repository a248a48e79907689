#include "nn/files/functions.h"

#include <algorithm>
#include <stdexcept>

namespace swarmcert::files {
namespace {

bool starts_with(const std::string& text, const std::string& prefix) { return text.rfind(prefix, 0) == 0; }

bool ends_with(const std::string& text, const std::string& suffix) {
  return text.size() >= suffix.size() &&
         text.compare(text.size() - suffix.size(), suffix.size(), suffix) == 0;
}

/// The unit that the names of inputs end in: "dp_x_m" is in m, "dv_x_m_s" in m/s.
std::string input_unit(const std::vector<std::string>& order) {
  const auto all = [&order](const std::string& suffix) {
    return std::all_of(order.begin(), order.end(),
                       [&](const std::string& name) { return ends_with(name, suffix); });
  };
  if (order.empty()) return "input";
  if (all("_m_s")) return "(m/s)";
  if (all("_m")) return "m";
  return "(m, m/s)";
}

}  // namespace

std::map<std::string, const Weights*> parts(const Network& network) {
  std::map<std::string, const Weights*> result;
  if (network.plain) result["network"] = &*network.plain;
  for (const auto& [kind, weights] : network.phi) result["phi:" + kind] = &weights;
  for (const auto& [kind, weights] : network.rho) result["rho:" + kind] = &weights;
  return result;
}

std::vector<std::string> networks_of(const std::string& function) {
  if (function == "network" || starts_with(function, "phi:") || starts_with(function, "rho:"))
    return {function};
  const std::size_t colon = function.find(':', 4);
  if (!starts_with(function, "set:") || colon == std::string::npos) {
    throw std::invalid_argument("networks_of: no function is called \"" + function + "\"");
  }
  return {"phi:" + function.substr(4, colon - 4), "rho:" + function.substr(colon + 1)};
}

std::vector<std::string> functions(const Network& network) {
  std::vector<std::string> names;
  for (const auto& [name, weights] : parts(network)) names.push_back(name);
  for (const auto& [phi_kind, phi] : network.phi) {
    for (const auto& [rho_kind, rho] : network.rho) names.push_back("set:" + phi_kind + ":" + rho_kind);
  }
  return names;
}

bool is_clamped(const std::string& name) {
  return name == "network" || (starts_with(name, "phi:") && name != std::string("phi:") + kGroundKind);
}

std::string unit(const Network& network, const std::string& function) {
  const std::string output = network.output_unit.empty() ? "output" : network.output_unit;
  const std::string input = input_unit(network.input_order);
  if (starts_with(function, "phi:")) return "hidden/" + input;
  if (starts_with(function, "rho:")) return output + "/hidden";
  return output + "/" + input;
}

}  // namespace swarmcert::files
