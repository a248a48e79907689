/// @file Determines in which order the layers of a weight file are evaluated, which a state dict does not state.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "nn/weights/weights.h"

namespace swarmcert::files {

struct LayerShape {
  std::string name;
  std::uint64_t inputs = 0, outputs = 0;
};

/// What the order in which a file lists its layers means.
enum class Listing {
  kEvaluation,  ///< the file states the order of evaluation, with ReLU between layers: ONNX, our safetensors
  kRegistration,  ///< the order in which a program created them, possibly not that of evaluation
  kUnordered,     ///< arbitrary
};

struct LayerOrder {
  std::vector<std::size_t> indices;  ///< of the layers, in order of evaluation
  OrderSource source = OrderSource::kFile;
};

/// Determines the order of evaluation. If neither the file nor `stated` gives it, it is decided by the shapes, if only
/// one order makes the sizes of consecutive layers match, or by the numbers in the names ("fc1", "fc2"; "0", "2"), if
/// they leave exactly one such order and it agrees with the order of registration, where there is one. Anything else is
/// refused: a certificate for the wrong order would be a certificate for another function.
/// @param stated every layer once, in the order of evaluation; empty: not stated.
/// @throws InputError if no order fits the shapes, if several remain (the message lists them), or if `stated` does not
///   fit.
LayerOrder decide_layer_order(const std::vector<LayerShape>& layers, Listing listing,
                              const std::vector<std::string>& stated, const std::string& path);

/// Returns the source of the order of `layers` from a file that lists them in the order of evaluation.
/// @param stated as for decide_layer_order().
/// @throws InputError if `stated` contradicts the file.
OrderSource stated_order(const std::vector<Layer>& layers, const std::vector<std::string>& stated,
                         const std::string& path);

/// Natural sort order: compares runs of digits by value, so that fc2 comes before fc10.
bool naturally_before(const std::string& a, const std::string& b);

/// Returns whether a number puts `a` before `b`: both names have a number where they first differ.
bool numbered_before(const std::string& a, const std::string& b);

}  // namespace swarmcert::files
