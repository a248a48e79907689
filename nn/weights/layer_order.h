/// @file In which order the layers of a weight file are evaluated: a state dict does not say.
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

/// What a reader knows of the order of the layers that it lists.
enum class Listing {
  kEvaluation,  ///< the file states the order of evaluation, and ReLU between the layers: ONNX, our safetensors
  kRegistration,  ///< the order in which a program created them, which need not be that of evaluation
  kUnordered,     ///< any
};

struct LayerOrder {
  std::vector<std::size_t> indices;  ///< of the layers, first evaluated first
  OrderSource source = OrderSource::kFile;
};

/// The order of evaluation. Where the file does not state it and `stated` is empty, one of these decides:
/// the only order in which each layer takes what the one before gives; or the numbers in the names ("fc1", "fc2";
/// "0", "2"), where they leave one such order and the order of registration, if there is one, is the same.
/// Anything else is refused: a certificate of the wrong order would be a certificate of another function.
/// @param stated every layer once, in the order of evaluation; empty: not stated.
/// @throws InputError if no order fits the shapes, several are left, or `stated` does not fit; several: it lists them.
LayerOrder decide_layer_order(const std::vector<LayerShape>& layers, Listing listing,
                              const std::vector<std::string>& stated, const std::string& path);

/// Where the order of `layers` comes from, which their file lists in the order of evaluation.
/// @param stated as for decide_layer_order(), which throws where it contradicts the file.
OrderSource stated_order(const std::vector<Layer>& layers, const std::vector<std::string>& stated,
                         const std::string& path);

/// Compares runs of digits by value, so that fc2 comes before fc10.
bool naturally_before(const std::string& a, const std::string& b);

/// Whether a number decides that `a` comes before `b`: where the names first differ, both have a number.
bool numbered_before(const std::string& a, const std::string& b);

}  // namespace swarmcert::files
