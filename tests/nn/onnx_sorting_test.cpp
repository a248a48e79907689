/// MaxMin and GroupSort in ONNX models: the groups of nodes that PyTorch exports, and rejected models.
#include <gtest/gtest.h>

#include <algorithm>

#include "nn/weights/weights.h"
#include "onnx_writer.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using namespace tests;

constexpr std::uint64_t kMinusOne = ~std::uint64_t{0};

std::vector<std::string> sorting_tensors() {
  const auto integers = [](const std::string& name, const std::vector<std::int64_t>& values) {
    return onnx_tensor(name, {values.size()}, 7, onnx_text(9, raw_numbers(values)));
  };
  return {onnx_raw("w", {2, 4}, {1, -2, 0.5F, 3, 2, 1, -1, 4}),
          onnx_raw("b", {4}, {0.25F, -1, 2, 0.5F}),
          onnx_raw("v", {4, 1}, {1, 10, 100, 1000}),
          integers("pairs", {1, 2, 2}),
          integers("flat", {1, 4}),
          integers("halves", {2, 2}),
          integers("unequal", {1, 3}),
          integers("two", {2}),
          integers("four", {4}),
          integers("one", {1})};
}

/// Gemm 2-4, `nodes` from "h" to "a", Gemm 4-1 with weights 1, 10, 100, 1000.
std::string sorting_model(const std::vector<std::string>& nodes) {
  OnnxModel model;
  model.nodes = {onnx_node("Gemm", {"x", "w", "b"}, {"h"})};
  model.nodes.insert(model.nodes.end(), nodes.begin(), nodes.end());
  model.nodes.push_back(onnx_node("Gemm", {"a", "v"}, {"y"}));
  model.tensors = sorting_tensors();
  model.shape = {1, 2};
  return model.bytes();
}

Weights sorting_weights(const std::vector<std::string>& nodes) {
  return parse_weights(sorting_model(nodes), "net.onnx");
}

std::vector<std::string> halves_nodes(const std::string& sizes = "halves", std::uint64_t axis = 1) {
  return {onnx_node("Split", {"h", sizes}, {"p", "q"}, {onnx_integer("axis", 1)}),
          onnx_node("Max", {"p", "q"}, {"c"}), onnx_node("Min", {"p", "q"}, {"d"}),
          onnx_node("Concat", {"c", "d"}, {"a"}, {onnx_integer("axis", axis)})};
}

std::vector<std::string> pairs_nodes(std::uint64_t keepdims = 0) {
  const std::vector<std::string> attributes = {onnx_integers("axes", {kMinusOne}),
                                               onnx_integer("keepdims", keepdims)};
  return {onnx_node("Reshape", {"h", "pairs"}, {"r"}), onnx_node("ReduceMax", {"r"}, {"c"}, attributes),
          onnx_node("ReduceMin", {"r"}, {"d"}, attributes),
          onnx_node("Concat", {"c", "d"}, {"a"}, {onnx_integer("axis", 1)})};
}

std::vector<std::string> sort_nodes(std::uint64_t largest, const std::string& count = "two") {
  return {onnx_node("Reshape", {"h", "pairs"}, {"r"}),
          onnx_node("TopK", {"r", count}, {"s", "indices"}, {onnx_integer("largest", largest)}),
          onnx_node("Reshape", {"s", "flat"}, {"a"})};
}

TEST(OnnxSorting, EveryGroupOfNodesIsItsFunction) {
  // With x = (0.75, -0.5): h = (0, -3, 2.875, 0.75).
  const std::vector<double> x = {0.75, -0.5};
  const auto expect = [&x](const std::vector<std::string>& nodes, Activation activation, double y) {
    const Weights weights = sorting_weights(nodes);
    EXPECT_EQ(weights.activation_names(), function_of(activation).op);
    ASSERT_EQ(weights.layers.size(), 2u);
    EXPECT_TRUE(weights.states_activation());
    EXPECT_EQ(weights.layers[0].weight_rounding + weights.layers[1].weight_rounding, 0);
    EXPECT_EQ(Evaluator<double>(weights)(x)[0], y);
  };
  expect(halves_nodes(), Activation::kMaxMinHalves, 2.875 + 7.5 + 0 - 3000);
  expect(halves_nodes("", kMinusOne), Activation::kMaxMinHalves, 2.875 + 7.5 + 0 - 3000);
  expect(pairs_nodes(), Activation::kMaxMinPairs, 0 + 28.75 - 300 + 750);
  expect(sort_nodes(0), group_sort(2), -3 + 0 + 75 + 2875);
  expect(sort_nodes(1), group_sort(2), 0 - 30 + 287.5 + 750);  // the largest first
  expect({onnx_node("TopK", {"h", "four"}, {"a", "i"}, {onnx_integer("largest", 0)})}, group_sort(4),
         -3 + 0 + 75 + 2875);
}

TEST(OnnxSorting, OtherGroupsOfNodesAreRefusedByName) {
  const auto refused = [](const std::vector<std::string>& nodes, const std::vector<std::string>& pieces) {
    return refuses([&] { sorting_weights(nodes); }, pieces);
  };
  EXPECT_TRUE(refused(halves_nodes("unequal"), {"Concat", "not halves", "--activation maxmin:halves"}));
  EXPECT_TRUE(refused(halves_nodes("halves", 0), {"Concat", "does not join the halves"}));
  std::vector<std::string> other = halves_nodes();
  other[3] = onnx_node("Concat", {"d", "c"}, {"a"}, {onnx_integer("axis", 1)});
  EXPECT_TRUE(refused(other, {"Split", "not one of the supported operators", "--activation maxmin:halves"}));
  EXPECT_TRUE(refused(pairs_nodes(1), {"Concat", "joins other maxima", "GroupSort as TopK"}));
  EXPECT_TRUE(refused(sort_nodes(0, "one"), {"TopK", "does not sort the whole last axis"}));
  std::vector<std::string> indices = sort_nodes(0);
  indices[2] = onnx_node("Reshape", {"indices", "flat"}, {"a"});
  EXPECT_TRUE(refused(indices, {"Reshape", "\"indices\""}));
  std::vector<std::string> mixed = sort_nodes(0);
  mixed[2] = onnx_node("Reshape", {"s", "flat"}, {"t"});
  mixed.push_back(onnx_node("Relu", {"t"}, {"a"}));
  EXPECT_EQ(sorting_weights(mixed).activation_names(), "groupsort:2, relu");
}

TEST(OnnxSorting, BesideASkipConnectionItIsTheSameFunctionWithRelu) {
  // Every number is a small multiple of 1/16, so there is no round-off.
  const auto beside_skip = [](std::vector<std::string> nodes, double x0, double x1) {
    nodes.push_back(onnx_node("Add", {"a", "h"}, {"sum"}));
    OnnxModel model;
    model.nodes = {onnx_node("Gemm", {"x", "w", "b"}, {"h"})};
    model.nodes.insert(model.nodes.end(), nodes.begin(), nodes.end());
    model.nodes.push_back(onnx_node("Identity", {"sum"}, {"y"}));
    model.tensors = sorting_tensors();
    model.shape = {1, 2};
    const Weights weights = parse_weights(model.bytes(), "net.onnx");
    EXPECT_TRUE(weights.is_relu());
    EXPECT_FALSE(weights.notes.empty());
    return Evaluator<double>(weights)({x0, x1});
  };
  const std::vector<std::string> four = {
      onnx_node("TopK", {"h", "four"}, {"a", "i"}, {onnx_integer("largest", 0)})};
  for (const double x0 : {-2.0, -0.5, 0.0, 0.75, 3.0}) {
    for (const double x1 : {-1.0, -0.5, 0.0, 0.25, 2.0}) {
      const std::vector<double> h = {x0 + 2 * x1 + 0.25, -2 * x0 + x1 - 1, 0.5 * x0 - x1 + 2,
                                     3 * x0 + 4 * x1 + 0.5};
      const auto plus_h = [&h](std::vector<double> sorted) {
        for (std::size_t k = 0; k < 4; ++k) sorted[k] += h[k];
        return sorted;
      };
      const auto [low, high] = std::minmax(h[0], h[1]);
      const auto [low2, high2] = std::minmax(h[2], h[3]);
      std::vector<double> all = h;
      std::sort(all.begin(), all.end());
      EXPECT_EQ(beside_skip(halves_nodes(), x0, x1), plus_h({std::max(h[0], h[2]), std::max(h[1], h[3]),
                                                             std::min(h[0], h[2]), std::min(h[1], h[3])}));
      EXPECT_EQ(beside_skip(pairs_nodes(), x0, x1), plus_h({high, high2, low, low2}));
      EXPECT_EQ(beside_skip(sort_nodes(0), x0, x1), plus_h({low, high, low2, high2}));
      EXPECT_EQ(beside_skip(sort_nodes(1), x0, x1), plus_h({high, low, high2, low2}));
      EXPECT_EQ(beside_skip(four, x0, x1), plus_h(all));
    }
  }
}

TEST(OnnxSorting, LargeGroupsBesideASkipConnectionAreRefused) {
  OnnxModel model;
  model.nodes = {onnx_node("TopK", {"x", "nine"}, {"s", "i"}), onnx_node("Add", {"s", "x"}, {"y"})};
  model.tensors = {onnx_tensor("nine", {1}, 7, onnx_text(9, raw_numbers(std::vector<std::int64_t>{9})))};
  model.shape = {1, 9};
  EXPECT_TRUE(
      refuses([&] { parse_weights(model.bytes(), "net.onnx"); },
              {"TopK", "more than 8 numbers beside a skip connection", "leave the skip connection out"}));
}

}  // namespace
}  // namespace swarmcert::files
