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
  std::vector<std::string> assumed;  ///< see Weights::assumed
};

/// Determines the order of evaluation. If neither the file nor `choice` gives it, it is decided by the numbers in the
/// names ("fc1", "fc2"; "0", "2"), if they agree with the order of registration, where there is one, or by the shapes,
/// if only one order makes the sizes of consecutive layers match. An order by shapes, or by numbers with a gap, is
/// assumed. Layers of several modules (layer_names.h) are never put into one chain unless `choice` does so. Anything
/// else is refused: a certificate for the wrong order would be a certificate for another function.
/// @param choice its order may leave out layers.
/// @throws InputError if no order fits the shapes, if several remain (the message lists them), if there are several
///   modules, or if `choice` does not fit.
LayerOrder decide_layer_order(const std::vector<LayerShape>& layers, Listing listing,
                              const LayerChoice& choice, const std::string& path);

/// Returns the source of the order of `layers` from a file that lists them in the order of evaluation.
/// @throws InputError if `choice` contradicts the file or selects.
OrderSource stated_order(const std::vector<Layer>& layers, const LayerChoice& choice,
                         const std::string& path);

}  // namespace swarmcert::files
