/// @file An ONNX model as stored in its file: nodes, stored tensors, the graph's input and output.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace swarmcert::files {

/// A tensor that is stored in the file, or computed from stored ones.
struct OnnxTensor {
  std::string name;
  std::vector<std::uint64_t> shape;
  std::uint64_t type = 0;  ///< TensorProto.data_type
  std::size_t offset = 0;
  std::vector<double> numbers;         ///< for float16, bfloat16, float32 and float64; row-major
  std::vector<std::int64_t> integers;  ///< for int32, int64 and bool
  bool is_read = false;                ///< false: the type is none of these
};

struct OnnxAttribute {
  std::optional<double> number;  ///< a float or an integer
  std::optional<std::string> text;
  std::vector<std::int64_t> integers;  ///< a list of integers
  std::vector<double> floats;          ///< a list of floats
  std::optional<OnnxTensor> tensor;
};

struct OnnxNode {
  std::string type, name;
  std::vector<std::string> inputs, outputs;
  std::map<std::string, OnnxAttribute> attributes;
  std::size_t offset = 0;
  mutable std::set<std::string> read;  ///< the attributes that were asked for

  /// Returns `Gemm "/fc1/Gemm"`, for messages.
  std::string label() const;
  bool has(const std::string& attribute) const {
    read.insert(attribute);
    return attributes.count(attribute) == 1;
  }
  /// Returns an attribute that was never asked for and may bear on the result; empty: there is none.
  std::string unread_attribute() const;
  double number(const std::string& attribute, double otherwise) const;
  std::vector<std::int64_t> integers(const std::string& attribute,
                                     const std::vector<std::int64_t>& otherwise) const;
  std::string text(const std::string& attribute, const std::string& otherwise) const;
};

/// The graph's input. A size of -1 is left open by the file.
struct OnnxInput {
  std::string name;
  std::optional<std::vector<std::int64_t>> shape;
};

struct OnnxModel {
  std::vector<OnnxNode> nodes;  ///< in the file's order, which is topological
  std::map<std::string, OnnxTensor> tensors;
  OnnxInput input;
  std::string output;
  std::vector<std::pair<std::string, std::string>> data_files;  ///< see Weights::data_files
  std::vector<std::string> unused;                              ///< see Weights::unused
  std::int64_t operator_set = 0;  ///< version of the operators of ONNX itself; 0: not stated
};

/// Number types in TensorProto.data_type.
inline constexpr std::uint64_t kOnnxFloat = 1, kOnnxInt32 = 6, kOnnxInt64 = 7, kOnnxBool = 9,
                               kOnnxFloat16 = 10, kOnnxDouble = 11, kOnnxBfloat16 = 16;
inline constexpr char kReexportOnnx[] =
    "export a plain chain of linear layers with ReLU between them: torch.onnx.export(model, ...)";

/// Parses the needed parts of a ModelProto. https://onnx.ai/onnx/repo-docs/IR.html
/// External data are read from the folder of `path`.
/// @throws InputError with the offset.
OnnxModel read_onnx_model(const std::string& bytes, const std::string& path);

}  // namespace swarmcert::files
