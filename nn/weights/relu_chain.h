/// @file Builds a chain of layers and activations that equals a composition of affine maps and activation functions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nn/weights/affine_map.h"
#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Every value is an affine map of the outputs of the last activated layer, or of the network's input before the first.
/// A new ReLU layer also carries the values that are still needed: x = relu(x) if x is known to be nonnegative, else x
/// = relu(x) - relu(-x).
class ReluChain {
 public:
  explicit ReluChain(int inputs) : inputs_(inputs), width_(inputs) {}

  /// Returns the number of outputs of the last activated layer; the network's inputs before the first.
  int width() const { return width_; }
  bool has_layers() const { return !layers_.empty(); }

  /// Adds a ReLU layer.
  /// @param carried values that are needed later: rewritten as maps of the new layer's outputs.
  /// @returns relu(rows) as a map of the new layer's outputs.
  /// @throws FoldingLimit.
  AffineMap relu(const AffineMap& rows, const std::vector<AffineMap*>& carried, const std::string& name);

  /// Adds the layer `rows` with any activation, which may act on the layer as a whole.
  /// @param carried values that are needed later: rewritten as maps of outputs to which the activation is not applied.
  /// @returns its outputs as a map of the new layer's outputs, in the same order.
  /// @throws FoldingLimit.
  AffineMap activated(const AffineMap& rows, Activation activation, const std::vector<AffineMap*>& carried,
                      const std::string& name);
  /// Returns the activation of the last added layer. Precondition: has_layers().
  Activation last_activation() const { return layers_.back().activation; }

  /// Returns the chain that ends in `output`.
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

/// Returns x -> W x + b of a layer whose numbers are exact.
AffineMap map_of(const Layer& layer);

/// Returns float32 if every number of `layers` is exactly a float32 and none was rounded, else float64.
Precision least_precision(const std::vector<Layer>& layers);

}  // namespace swarmcert::files
