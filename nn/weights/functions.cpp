#include "nn/weights/functions.h"

#include <algorithm>
#include <stdexcept>

#include "nn/base/text.h"

namespace swarmcert::files {
namespace {

/// Returns the unit implied by the names of the inputs: "dp_x_m" is in m, "dv_x_m_s" in m/s.
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

std::vector<std::string> ground_names() {
  return {"minus_z_m", "minus_v_x_m_s", "minus_v_y_m_s", "minus_v_z_m_s"};
}

/// Returns names that show which inputs are positions and which are velocities; empty if that is unknown.
std::vector<std::string> input_names(const Network& network, const FunctionId& function, int inputs) {
  if (function.is_rho()) return {};
  const bool is_ground = function.input_part().is_ground_phi();
  if (is_ground) return ground_names();
  if (!network.input_order.empty()) return network.input_order;
  return inputs == static_cast<int>(relative_state().size()) ? relative_state() : std::vector<std::string>();
}

}  // namespace

const std::vector<std::string>& relative_state() {
  static const std::vector<std::string> kNames = {"dp_x_m",   "dp_y_m",   "dp_z_m",
                                                  "dv_x_m_s", "dv_y_m_s", "dv_z_m_s"};
  return kNames;
}

Parts parts(const Network& network) {
  Parts result;
  if (network.plain) result[FunctionId()] = &*network.plain;
  for (const auto& [kind, weights] : network.phi) result[FunctionId::phi(kind)] = &weights;
  for (const auto& [kind, weights] : network.rho) result[FunctionId::rho(kind)] = &weights;
  return result;
}

std::vector<FunctionId> functions(const Network& network) {
  std::vector<FunctionId> result;
  for (const auto& [part, weights] : parts(network)) result.push_back(part);
  for (const auto& [phi_kind, phi] : network.phi) {
    for (const auto& [rho_kind, rho] : network.rho) result.push_back(FunctionId::set(phi_kind, rho_kind));
  }
  return result;
}

int inputs(const Network& network, const FunctionId& function) {
  return parts(network).at(function.input_part())->inputs();
}

bool is_clamped(const FunctionId& part) {
  return part.is_plain() || (part.is_phi() && !part.is_ground_phi());
}

std::vector<int> block_coordinates(const Network& network, const FunctionId& function,
                                   const std::string& block) {
  const int count = inputs(network, function);
  const std::vector<std::string> names = input_names(network, function, count);
  std::vector<int> result;
  for (int k = 0; k < count; ++k) {
    const bool named = static_cast<std::size_t>(k) < names.size();
    const bool is_velocity = named && ends_with(names[k], "_m_s");
    const bool is_position = named && ends_with(names[k], "_m");
    if (block == "all" || block == "x" + std::to_string(k) || (block == "position" && is_position) ||
        (block == "velocity" && is_velocity)) {
      result.push_back(k);
    }
  }
  if (result.empty())
    throw std::invalid_argument("block_coordinates: " + function.name() + " has no block \"" + block + "\"");
  return result;
}

std::vector<std::string> blocks(const Network& network, const FunctionId& function) {
  const int count = inputs(network, function);
  if (function.is_rho() || count == 1) return {};
  std::vector<std::string> result;
  const std::vector<std::string> names = input_names(network, function, count);
  const auto has = [&names](const char* suffix) {
    return std::any_of(names.begin(), names.end(), [&](const auto& n) { return ends_with(n, suffix); });
  };
  if (has("_m") && has("_m_s")) result = {"position", "velocity"};
  for (int k = 0; k < count; ++k) result.push_back("x" + std::to_string(k));
  return result;
}

std::string unit(const Network& network, const FunctionId& function, const std::string& block) {
  const std::string output = network.output_unit.empty() ? "output" : network.output_unit;
  std::vector<std::string> moved;  // empty if NET does not name its inputs: then their units are unknown
  if (!network.input_order.empty()) moved = input_names(network, function, inputs(network, function));
  if (block != "all" && !moved.empty()) {
    std::vector<std::string> names;
    for (const int k : block_coordinates(network, function, block)) names.push_back(moved.at(k));
    moved = names;
  }
  const std::string input = input_unit(moved);
  if (function.is_phi()) return "hidden/" + input;
  if (function.is_rho()) return output + "/hidden";
  return output + "/" + input;
}

}  // namespace swarmcert::files
