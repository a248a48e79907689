/// @file The user's statement of which layers of a weight file make up the network.
#pragma once

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace swarmcert::files {

/// Tensors of other layers are unused. At most one of the two is stated.
struct LayerChoice {
  std::vector<std::string> order;   ///< names of the layers in order of evaluation
  std::vector<std::string> select;  ///< prefixes of names (has_prefix()); several: one follows the other

  LayerChoice() = default;
  LayerChoice(std::vector<std::string> layers) : order(std::move(layers)) {}  // NOLINT
  LayerChoice(std::initializer_list<std::string> layers) : order(layers) {}   // NOLINT

  bool is_stated() const { return !order.empty() || !select.empty(); }
};

}  // namespace swarmcert::files
