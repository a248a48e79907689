/// @file Converts the named tensors of a weight file to the layers of a network; shared by the readers.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nn/weights/layer_choice.h"
#include "nn/weights/layer_order.h"
#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Maximum count of numbers per file: 2^25, a quarter gigabyte in double and ten thousand times the paper's networks.
inline constexpr std::uint64_t kMostElements = std::uint64_t{1} << 25;

/// A tensor as declared in a file; its numbers have not been read.
struct DeclaredTensor {
  std::string name;                    ///< "fc1.weight"
  std::optional<Precision> precision;  ///< empty if the type is not supported
  std::string type;                    ///< name of the type in the file: "FloatStorage", "F16"
  std::vector<std::uint64_t> shape;
};

/// Reads the numbers of the i-th declared tensor in row-major order. Called only for tensors with a valid shape.
using TensorReader = std::function<std::vector<double>(std::size_t)>;

/// Groups `tensors` into layers in the order of evaluation; `listing` and `choice` are passed to decide_layer_order().
/// Tensors of layers that `choice` leaves out, and the deviation of a random policy, are named as unused.
/// @throws InputError if another tensor is not a layer's weight or bias, if the precisions differ or are neither
///   float32 nor float64, if a number is not finite, or as decide_layer_order().
Weights assemble(const std::vector<DeclaredTensor>& tensors, const TensorReader& read,
                 const std::string& path, Listing listing, const LayerChoice& choice);

/// Returns "fc1.weight", or "weight" if the layer has no name.
std::string tensor_name(const Layer& layer, const char* part);

/// Appends `count` little-endian numbers of `precision` from `bytes`, which may be unaligned, `stride` elements apart.
void append_numbers(const char* bytes, std::uint64_t count, std::uint64_t stride, Precision precision,
                    std::vector<double>& numbers);

/// Return the exact value of these bits.
double from_float16(std::uint16_t bits);
double from_bfloat16(std::uint16_t bits);

/// Returns the number of bytes per number: 2, 4 or 8.
std::size_t width(Precision precision);

/// Returns a shape as text: "[40, 25]".
std::string shape_text(const std::vector<std::uint64_t>& shape);

/// Returns the product of `factors`, or nothing if it exceeds kMostElements.
std::optional<std::uint64_t> element_count(const std::vector<std::uint64_t>& factors);

}  // namespace swarmcert::files
