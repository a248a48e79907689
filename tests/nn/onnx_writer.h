/// @file Writes valid and damaged ONNX models field by field.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "pth_writer.h"

namespace swarmcert::tests {

inline std::string onnx_varint(std::uint64_t value) {
  std::string bytes;
  for (; value >= 0x80; value >>= 7) bytes += static_cast<char>(value | 0x80);
  return bytes + static_cast<char>(value);
}
inline std::string onnx_varint_field(int number, std::uint64_t value) {
  return onnx_varint(static_cast<std::uint64_t>(number) << 3) + onnx_varint(value);
}
/// Returns a length-delimited field: text, message or packed numbers.
inline std::string onnx_text(int number, const std::string& bytes) {
  return onnx_varint(static_cast<std::uint64_t>(number) << 3 | 2) + onnx_varint(bytes.size()) + bytes;
}

/// Returns a TensorProto; `data` are its fields that hold numbers.
inline std::string onnx_tensor(const std::string& name, const std::vector<std::uint64_t>& shape,
                               std::uint64_t type, const std::string& data) {
  std::string dims;
  for (const std::uint64_t size : shape) dims += onnx_varint(size);
  return onnx_text(1, dims) + onnx_varint_field(2, type) + onnx_text(8, name) + data;
}
inline std::string onnx_raw(const std::string& name, const std::vector<std::uint64_t>& shape,
                            const std::vector<float>& numbers) {
  return onnx_tensor(name, shape, 1, onnx_text(9, raw_numbers(numbers)));
}
inline std::string onnx_floats(const std::string& name, const std::vector<std::uint64_t>& shape,
                               const std::vector<float>& numbers) {
  return onnx_tensor(name, shape, 1, onnx_text(4, raw_numbers(numbers)));
}

inline std::string onnx_integer(const std::string& name, std::uint64_t value) {
  return onnx_text(1, name) + onnx_varint_field(3, value);
}
inline std::string onnx_float(const std::string& name, float value) {
  return onnx_text(1, name) + "\x15" + raw_numbers(std::vector<float>{value});
}
inline std::string onnx_integers(const std::string& name, const std::vector<std::uint64_t>& values) {
  std::string packed;
  for (const std::uint64_t value : values) packed += onnx_varint(value);
  return onnx_text(1, name) + onnx_text(8, packed);
}
inline std::string onnx_node(const std::string& type, const std::vector<std::string>& inputs,
                             const std::vector<std::string>& outputs,
                             const std::vector<std::string>& attributes = {},
                             const std::string& domain = "") {
  std::string node;
  for (const std::string& input : inputs) node += onnx_text(1, input);
  for (const std::string& output : outputs) node += onnx_text(2, output);
  node += onnx_text(4, type);
  for (const std::string& attribute : attributes) node += onnx_text(5, attribute);
  return domain.empty() ? node : node + onnx_text(7, domain);
}
inline std::string constant_node(const std::string& output, const std::string& tensor) {
  return onnx_node("Constant", {}, {output}, {onnx_text(1, "value") + onnx_text(5, tensor)});
}

/// Returns the type of a float32 value of this shape.
inline std::string onnx_shape(const std::vector<std::uint64_t>& shape) {
  std::string dimensions;
  for (const std::uint64_t size : shape) dimensions += onnx_text(1, onnx_varint_field(1, size));
  return onnx_text(2, onnx_text(1, onnx_varint_field(1, 1) + onnx_text(2, dimensions)));
}

struct OnnxModel {
  std::vector<std::string> nodes, tensors;
  std::vector<std::string> inputs = {"x"}, outputs = {"y"};
  std::vector<std::uint64_t> shape;  ///< of the inputs; empty: not stated
  std::string graph_extra;

  std::string bytes() const {
    std::string graph;
    for (const std::string& node : nodes) graph += onnx_text(1, node);
    for (const std::string& tensor : tensors) graph += onnx_text(5, tensor);
    for (const std::string& input : inputs)
      graph += onnx_text(11, onnx_text(1, input) + (shape.empty() ? "" : onnx_shape(shape)));
    for (const std::string& output : outputs) graph += onnx_text(12, onnx_text(1, output));
    return onnx_varint_field(1, 8) + onnx_text(2, "test") + onnx_text(7, graph + graph_extra);
  }
};

}  // namespace swarmcert::tests
