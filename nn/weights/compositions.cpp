#include "nn/weights/compositions.h"

#include <algorithm>

#include "nn/base/input_error.h"
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

bool is_ever_silent(const Network& network, const std::string& function) {
  return is_set(function) && network.silent.count(kind_of(networks_of(function).back())) == 1;
}

void require_never_silent(const Network& network, const std::string& what) {
  if (network.silent.empty()) return;
  throw InputError({network.path, "", "silent", in_quotes(silent_compositions(network).front()),
                    "but " + what, "certify without --domain, compare, simulate, export and match take it"});
}

}  // namespace swarmcert::files
