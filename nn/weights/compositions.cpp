#include "nn/weights/compositions.h"

#include <algorithm>

#include "nn/weights/functions.h"

namespace swarmcert::files {

std::string composition_name(std::vector<std::string> neighbours, const std::string& own) {
  std::sort(neighbours.begin(), neighbours.end());
  std::string name;
  for (const std::string& kind : neighbours) name += (name.empty() ? "" : "+") + kind;
  return name + ">" + own;
}

std::vector<std::string> neighbour_kinds(const Network& network) {
  std::vector<std::string> kinds;
  for (const auto& [kind, weights] : network.phi) {
    if (kind != kGroundKind) kinds.push_back(kind);
  }
  return kinds;
}

std::vector<std::string> silent_compositions(const Network& network) {
  std::vector<std::string> names;
  for (const auto& [own, compositions] : network.silent)
    for (const std::vector<std::string>& neighbours : compositions)
      names.push_back(composition_name(neighbours, own));
  return names;
}

std::vector<int> silent_counts(const Network& network, const std::string& own) {
  std::vector<int> counts;
  const auto found = network.silent.find(own);
  if (found == network.silent.end()) return counts;
  for (const std::vector<std::string>& neighbours : found->second) {
    for (const std::string& kind : neighbour_kinds(network))
      counts.push_back(static_cast<int>(std::count(neighbours.begin(), neighbours.end(), kind)));
  }
  return counts;
}

bool is_ever_silent(const Network& network, const FunctionId& function) {
  return function.is_set() && network.silent.count(function.rho_kind()) == 1;
}

bool is_silent_among(const Network& network, const FunctionId& function,
                     const std::vector<FunctionId>& parts) {
  if (!function.is_set()) return false;
  const auto found = network.silent.find(function.rho_kind());
  if (found == network.silent.end()) return false;
  std::vector<std::string> kinds;
  for (const FunctionId& part : parts)
    if (!part.is_ground_phi()) kinds.push_back(part.kind());
  std::sort(kinds.begin(), kinds.end());
  return found->second.count(kinds) == 1;
}

long silent_up_to(const Network& network, const FunctionId& function, long most) {
  if (!is_ever_silent(network, function)) return 0;
  const auto& compositions = network.silent.at(function.rho_kind());
  return std::count_if(
      compositions.begin(), compositions.end(), [&](const std::vector<std::string>& neighbours) {
        return static_cast<long>(neighbours.size()) <= most &&
               std::all_of(neighbours.begin(), neighbours.end(),
                           [&](const std::string& kind) { return kind == function.phi_kind(); });
      });
}

std::set<std::vector<FunctionId>> beside_silent(const Network& network, const FunctionId& function) {
  std::set<std::vector<FunctionId>> result;
  if (!is_ever_silent(network, function)) return result;
  const FunctionId own_phi = function.input_part();
  if (own_phi.is_ground_phi()) return result;  // the ground never arrives or leaves
  for (const std::vector<std::string>& neighbours : network.silent.at(function.rho_kind())) {
    std::vector<FunctionId> parts;
    for (const std::string& kind : neighbours) parts.push_back(FunctionId::phi(kind));
    const auto add = [&](std::vector<FunctionId> beside) {
      std::sort(beside.begin(), beside.end());
      if (!is_silent_among(network, function, beside)) result.insert(std::move(beside));
    };
    const auto own = std::find(parts.begin(), parts.end(), own_phi);
    if (own != parts.end()) {
      std::vector<FunctionId> fewer = parts;
      fewer.erase(fewer.begin() + (own - parts.begin()));
      add(std::move(fewer));
    }
    parts.push_back(own_phi);
    add(std::move(parts));
  }
  return result;
}

}  // namespace swarmcert::files
