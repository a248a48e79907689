/// @file Traverses an ONNX graph from its input to its output and builds an equivalent chain of layers.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "nn/weights/onnx/model.h"
#include "nn/weights/onnx/operators.h"
#include "nn/weights/relu_chain.h"

namespace swarmcert::files {

inline constexpr char kReadSorting[] =
    "MaxMin is recognized as Split into two halves, their Max and Min, and Concat, or as ReduceMax and "
    "ReduceMin of pairs along the last axis and Concat; GroupSort as TopK of the whole last axis; otherwise "
    "save the state dict and certify it with --activation maxmin:halves, maxmin:pairs or groupsort:SIZE";

class OnnxGraph {
 public:
  OnnxGraph(OnnxModel model, const std::string& path);

  /// Returns layers, precision and notes; the caller sets order and hash.
  /// @throws InputError with the node, its offset and a hint.
  Weights run();

 private:
  using Node = OnnxNode;

  [[noreturn]] void refuse(std::size_t offset, const std::string& field, const std::string& what,
                           const std::string& hint = kReexportOnnx) const;

  OnnxShape input_shape() const;
  std::int64_t inputs_by_first_node() const;
  const OnnxTensor* stored_anywhere(const std::string& name) const;
  void count_uses();
  void follow(const Node& node);
  bool follow_constant(const Node& node);
  void compute_constant(const Node& node);
  OnnxValue computed(const Node& node);
  OnnxValue computed_affine(const Node& node);
  OnnxValue computed_layout(const Node& node);
  OnnxValue computed_activation(const Node& node);
  OnnxValue computed_smooth(const Node& node);

  const OnnxTensor* constant(const Node& node, std::size_t k) const;
  const OnnxTensor& needed_constant(const Node& node, std::size_t k) const;
  const OnnxValue& value(const Node& node, std::size_t k) const;
  bool is_value(const Node& node, std::size_t k) const;
  std::vector<std::int64_t> integers(const Node& node, std::size_t k, const char* attribute) const;

  OnnxValue applied(const Node& node, const AffineMap& map, const OnnxShape& shape, const OnnxTensor* weight);
  OnnxValue padded(const Node& node, const OnnxValue& x) const;
  OnnxValue concatenated(const Node& node) const;
  OnnxValue elementwise(const Node& node);
  void require_inference(const Node& node) const;
  void require_trailing_axes(const Node& node, const OnnxTensor& tensor, const OnnxShape& shape) const;
  OnnxValue largest(const Node& node, OnnxValue from, std::vector<std::vector<int>> windows, OnnxShape shape);
  OnnxValue largest_of_inputs(const Node& node);
  OnnxValue clipped(const Node& node, const OnnxValue& x, const OnnxTensor* least, const OnnxTensor* most);
  OnnxValue sum_of_relus(const Node& node, const OnnxValue& x, const std::vector<AffineMap>& terms,
                         const std::vector<std::vector<Enclosed>>& factors,
                         const std::vector<Enclosed>& shift);
  AffineMap relu(const Node& node, const AffineMap& rows, const std::string& name,
                 const std::vector<AffineMap*>& also_carried);
  OnnxNode* only_user(const std::string& name);
  bool holds(const std::string& name, double wanted, double error) const;
  void join_smooth_activations();
  std::vector<OnnxNode*> users_of(const std::string& name);
  OnnxNode* joined_by_concat(const std::vector<OnnxNode*>& pair);
  void join_sorting();
  AffineMap ordered(const Node& node, const AffineMap& map, const std::string& name,
                    const std::vector<std::pair<int, int>>& pairs);
  AffineMap sorted_with_relu(const Node& node, const OnnxValue& x, Activation activation);
  OnnxValue sorted(const Node& node, const OnnxValue& x, Activation activation);
  OnnxValue sorted_by_concat(const Node& node);
  OnnxValue sorted_by_top(const Node& node);
  std::vector<AffineMap*> needed_after(const Node& node);
  std::string layer_name(const std::string& weight);
  static void require_all_read(const Node& node);
  void require_finite(const Node& node, const AffineMap& map) const;

  OnnxModel model_;
  const std::string& path_;
  ReluChain chain_;
  std::map<std::string, OnnxValue> values_;  ///< values that later nodes use
  std::map<std::string, int> uses_;          ///< number of uses by later nodes
  std::set<std::string> names_;
  int layers_ = 0;
  std::set<std::string> notes_;
  /// For each Concat that implements MaxMin, keyed by its output: the preceding Split, or ReduceMax and ReduceMin.
  std::map<std::string, std::vector<OnnxNode>> joined_;
};

}  // namespace swarmcert::files
