/// @file Builds a chain of layers and activations out of affine maps and functions, so that it is the same function.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/weights/affine_map.h"
#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Every value is an affine map of the chain's last activated layer, or of the network's input before the first. A
/// ReLU layer takes along what is still needed: x = relu(x), where x is known not to be negative, else relu(x) -
/// relu(-x).
class ReluChain {
 public:
  explicit ReluChain(int inputs) : inputs_(inputs), width_(inputs) {}

  /// Outputs of the last activated layer; the network's inputs before the first.
  int width() const { return width_; }
  bool has_layers() const { return !layers_.empty(); }

  /// Adds a ReLU layer. @return relu(rows) as a map of the new layer's outputs.
  /// @param carried values that are needed later: rewritten as maps of the new layer's outputs.
  /// @throws FoldingLimit.
  AffineMap relu(const AffineMap& rows, const std::vector<AffineMap*>& carried, const std::string& name);

  /// Adds the layer `rows` with any activation, which may act on the layer as a whole. @return its outputs as a map of
  /// the new layer's, in the same order.
  /// @param carried values that are needed later: rewritten as maps of numbers that the activation leaves as they are.
  /// @throws FoldingLimit.
  AffineMap activated(const AffineMap& rows, Activation activation, const std::vector<AffineMap*>& carried,
                      const std::string& name);
  /// Of the last layer that was added. Precondition: has_layers().
  Activation last_activation() const { return layers_.back().activation; }

  /// The chain that ends in `output`.
  /// @throws FoldingLimit.
  std::vector<Layer> finished(const AffineMap& output, const std::string& name);

 private:
  bool is_never_negative(const AffineMap::Row& row, const Enclosed& shift) const;
  void append(const AffineMap& map, Activation activation, const std::string& name);

  int inputs_;
  int width_;
  std::vector<Layer> layers_;
  std::uint64_t elements_ = 0;
};

/// float32 if every number of `layers` is one and none was rounded, else float64.
Precision least_precision(const std::vector<Layer>& layers);

}  // namespace swarmcert::files
