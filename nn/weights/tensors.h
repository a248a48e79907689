/// @file From the named tensors of a weight file to the layers of a network; shared by the readers.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nn/weights/layer_order.h"
#include "nn/weights/weights.h"

namespace swarmcert::files {

/// Numbers that one file may hold: 2^25, a quarter gigabyte in double and ten thousand times the paper's networks.
inline constexpr std::uint64_t kMostElements = std::uint64_t{1} << 25;

/// A tensor as a file declares it; its numbers have not been read.
struct DeclaredTensor {
  std::string name;                    ///< "fc1.weight"
  std::optional<Precision> precision;  ///< empty where the type is one that we refuse
  std::string type;                    ///< as the file calls it: "FloatStorage", "F16"
  std::vector<std::uint64_t> shape;
};

/// Reads the numbers of the i-th declared tensor in row-major order. Called only for tensors whose shape fits.
using TensorReader = std::function<std::vector<double>(std::size_t)>;

/// Groups `tensors` into layers, in the order of evaluation: see decide_layer_order(), to which `listing` and `order`
/// go.
/// @throws InputError if a tensor is not a layer's weight or bias, as decide_layer_order(), or if the precisions differ
/// or are neither float32 nor float64, or a number is not finite.
Weights assemble(const std::vector<DeclaredTensor>& tensors, const TensorReader& read,
                 const std::string& path, Listing listing, const std::vector<std::string>& order);

/// "fc1.weight", or "weight" where the layer has no name.
std::string tensor_name(const Layer& layer, const char* part);

/// `count` little-endian numbers of `precision` at `bytes`, which need not be aligned, `stride` elements apart.
void append_numbers(const char* bytes, std::uint64_t count, std::uint64_t stride, Precision precision,
                    std::vector<double>& numbers);

/// The number that these bits are, exactly.
double from_float16(std::uint16_t bits);
double from_bfloat16(std::uint16_t bits);

/// Bytes of one number: 2, 4 or 8.
std::size_t width(Precision precision);

/// "[40, 25]".
std::string shape_text(const std::vector<std::uint64_t>& shape);

/// Product of `factors`, or empty if it exceeds kMostElements.
std::optional<std::uint64_t> element_count(const std::vector<std::uint64_t>& factors);

}  // namespace swarmcert::files
