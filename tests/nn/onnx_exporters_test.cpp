/// ONNX models that exporters and operator sets write in different ways: training mode, casts of stored numbers,
/// constants aligned with channels, limits, parts of shapes. https://onnx.ai/onnx/operators/
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nn/weights/weights.h"
#include "onnx_writer.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using namespace tests;

/// Returns x [1, 2] -> `nodes` -> y, which may use w = [[1, 2], [3, 4]], b = [1, -2], `yes` and `no`.
OnnxModel exported(std::vector<std::string> nodes) {
  OnnxModel model;
  model.nodes = std::move(nodes);
  model.tensors = {onnx_raw("w", {2, 2}, {1, 2, 3, 4}), onnx_raw("b", {2}, {1, -2}),
                   onnx_tensor("yes", {}, 9, onnx_text(9, "\1")),
                   onnx_tensor("no", {}, 9, onnx_text(5, onnx_varint(0)))};
  model.shape = {1, 2};
  return model;
}

testing::AssertionResult export_is_refused(const OnnxModel& model, const std::vector<std::string>& pieces) {
  return refuses([&] { parse_weights(model.bytes(), "net.onnx"); }, pieces);
}

const std::string& gemm() {
  static const std::string node = onnx_node("Gemm", {"x", "w", "b"}, {"h"});
  return node;
}

TEST(OnnxExporters, LayersInTrainingModeAreRefused) {
  const std::vector<std::string> words = {"net.onnx: offset ", "is in training mode", "model.eval()"};
  for (const char* const mode : {"no", ""}) {
    const OnnxModel model = exported({gemm(), onnx_node("Dropout", {"h", "", mode}, {"y", "mask"})});
    EXPECT_EQ(parse_weights(model.bytes(), "net.onnx").layers.size(), 1u) << mode;
  }
  EXPECT_TRUE(export_is_refused(exported({gemm(), onnx_node("Dropout", {"h", "", "yes"}, {"y"})}), words));
  EXPECT_TRUE(export_is_refused(
      exported({gemm(), onnx_node("Dropout", {"h"}, {"y"}, {onnx_integer("is_test", 0)})}), words));
  const std::vector<std::string> inputs = {"h", "b", "b", "b", "positive"};
  const std::string positive = onnx_raw("positive", {2}, {1, 4});
  OnnxModel model = exported({gemm(), onnx_node("BatchNormalization", inputs, {"y"})});
  model.tensors.push_back(positive);
  EXPECT_EQ(parse_weights(model.bytes(), "net.onnx").layers.size(), 1u);
  model.nodes.back() = onnx_node("BatchNormalization", inputs, {"y", "", "", "", ""});
  EXPECT_EQ(parse_weights(model.bytes(), "net.onnx").layers.size(), 1u);
  model.nodes.back() = onnx_node("BatchNormalization", inputs, {"y", "m", "v", "sm", "sv"});
  EXPECT_TRUE(export_is_refused(model, words));  // operator set 9 to 13
  model.nodes.back() = onnx_node("BatchNormalization", inputs, {"y"}, {onnx_integer("is_test", 0)});
  EXPECT_TRUE(export_is_refused(model, words));  // before operator set 7
}

TEST(OnnxExporters, ACastThatRoundsStoredNumbersIsRefused) {
  const auto with = [](double number, std::uint64_t to) {
    OnnxModel model = exported(
        {onnx_node("Cast", {"d"}, {"c"}, {onnx_integer("to", to)}), onnx_node("MatMul", {"x", "c"}, {"y"})});
    model.shape = {1, 1};
    model.tensors = {onnx_tensor("d", {1, 1}, 11, onnx_text(9, raw_numbers(std::vector<double>{number})))};
    return model;
  };
  EXPECT_EQ(parse_weights(with(0.5, 1).bytes(), "net.onnx").layers[0].weights[0], 0.5);
  EXPECT_EQ(parse_weights(with(0.1, 11).bytes(), "net.onnx").layers[0].weights[0], 0.1);
  EXPECT_EQ(parse_weights(with(3, 7).bytes(), "net.onnx").layers[0].weights[0], 3);
  for (const auto& [number, to] : {std::pair<double, int>{0.1, 1}, {0.5, 7}, {0.1, 10}, {1e300, 1}})
    EXPECT_TRUE(export_is_refused(with(number, static_cast<std::uint64_t>(to)),
                                  {"Cast: rounds stored numbers", "do_constant_folding"}))
        << number << " to " << to;
}

TEST(OnnxExporters, ALimitThatExcludesEveryValueIsNotTakenForNoLimit) {
  const auto clip = [](const char* name, float limit) {
    return exported({gemm(), onnx_node("Clip", {"h"}, {"y"}, {onnx_float(name, limit)})});
  };
  const float most = std::numeric_limits<float>::max(), infinite = std::numeric_limits<float>::infinity();
  EXPECT_EQ(parse_weights(clip("min", -most).bytes(), "net.onnx").layers.size(), 1u);
  EXPECT_EQ(parse_weights(clip("max", infinite).bytes(), "net.onnx").layers.size(), 1u);
  for (const auto& [name, limit] :
       {std::pair<const char*, float>{"min", most}, {"min", infinite}, {"max", -infinite}, {"max", NAN}})
    EXPECT_TRUE(export_is_refused(clip(name, limit), {"Clip: ", "within 2^127"})) << name << limit;
}

/// Returns x [1, 4] as an image [1, 2, 2] or [1, 2, 2, 1], then `node` with c [2], then y. The constant c fits the
/// channels as well as, in the first case, the last axis.
OnnxModel image_with(const std::string& node) {
  OnnxModel model;
  model.nodes = {onnx_node("Reshape", {"x", "sizes"}, {"h"}), node};
  model.tensors = {
      onnx_tensor("sizes", {3}, 7, onnx_text(7, onnx_varint(1) + onnx_varint(2) + onnx_varint(2))),
      onnx_raw("c", {2}, {1, 5})};
  model.shape = {1, 4};
  return model;
}

std::string with_operator_set(const OnnxModel& model, std::uint64_t version) {
  return model.bytes() + onnx_text(8, onnx_text(1, "") + onnx_varint_field(2, version));
}

TEST(OnnxExporters, AConstantThatOldOperatorSetsAlignWithChannelsIsRefused) {
  const auto add = [](std::uint64_t axis) {
    return image_with(
        onnx_node("Add", {"h", "c"}, {"y"}, {onnx_integer("broadcast", 1), onnx_integer("axis", axis)}));
  };
  EXPECT_EQ(parse_weights(add(2).bytes(), "net.onnx").layers[0].biases, (std::vector<double>{1, 5, 1, 5}));
  EXPECT_TRUE(export_is_refused(add(1), {"Add: aligns its constant with other axes", "opset_version"}));
  const OnnxModel prelu = image_with(onnx_node("PRelu", {"h", "c"}, {"y"}));
  EXPECT_NO_THROW(parse_weights(with_operator_set(prelu, 7), "net.onnx"));
  EXPECT_TRUE(refuses([&] { parse_weights(with_operator_set(prelu, 6), "net.onnx"); },
                      {"PRelu: aligns its constant with other axes"}));
}

TEST(OnnxExporters, PaddingOfAxesInAnotherOrderIsRefused) {
  const auto pad = [](std::uint64_t first, std::uint64_t second) {
    OnnxModel model = exported({onnx_node("Pad", {"x", "pads", "", "axes"}, {"y"})});
    std::string pads;
    for (const std::uint64_t amount : {0, 1, 0, 0}) pads += onnx_varint(amount);
    model.tensors = {onnx_tensor("pads", {4}, 7, onnx_text(7, pads)),
                     onnx_tensor("axes", {2}, 7, onnx_text(7, onnx_varint(first) + onnx_varint(second)))};
    return model;
  };
  EXPECT_EQ(parse_weights(pad(0, 1).bytes(), "net.onnx").outputs(), 3);
  EXPECT_TRUE(export_is_refused(pad(1, 0), {"Pad: its axes are not all axes"}));
}

TEST(OnnxExporters, PartsOfAShapeAndConstantsWithoutATensorAreRead) {
  // As torch.onnx writes x.view(x.shape[0], -1) and h + torch.tensor([4.0, 5.0]).
  const OnnxModel model = exported(
      {onnx_node("Shape", {"x"}, {"n"}, {onnx_integer("start", 0), onnx_integer("end", 1)}),
       onnx_node("Constant", {}, {"rest"}, {onnx_integers("value_ints", {~std::uint64_t{0}})}),
       onnx_node("Concat", {"n", "rest"}, {"s"}, {onnx_integer("axis", 0)}),
       onnx_node("Reshape", {"x", "s"}, {"f"}), onnx_node("Gemm", {"f", "w"}, {"h"}),
       onnx_node("Constant", {}, {"c"},
                 {onnx_text(1, "value_floats") + onnx_text(7, raw_numbers(std::vector<float>{4, 5}))}),
       onnx_node("Constant", {}, {"two"}, {onnx_float("value_float", 2)}),
       onnx_node("Add", {"h", "c"}, {"a"}), onnx_node("Mul", {"a", "two"}, {"y"})});
  const Weights weights = parse_weights(model.bytes(), "net.onnx");
  ASSERT_EQ(weights.layers.size(), 1u);
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{2, 6, 4, 8}));
  EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{8, 10}));
}

TEST(OnnxExporters, GeluIsFoundWithConstantsWithoutATensor) {
  const auto number = [](const char* name, double x) {
    return onnx_node("Constant", {}, {name}, {onnx_float("value_float", static_cast<float>(x))});
  };
  const OnnxModel model =
      exported({gemm(), number("root", std::sqrt(2.0)), number("one", 1), number("half", 0.5),
                onnx_node("Div", {"h", "root"}, {"q"}), onnx_node("Erf", {"q"}, {"e"}),
                onnx_node("Add", {"e", "one"}, {"p"}), onnx_node("Mul", {"h", "p"}, {"g"}),
                onnx_node("Mul", {"g", "half"}, {"t"}), onnx_node("MatMul", {"t", "w"}, {"y"})});
  EXPECT_EQ(parse_weights(model.bytes(), "net.onnx").layers.size(), 2u);
}

TEST(OnnxExporters, TheShapeOfAStoredTensorIsItsOwn) {
  const OnnxModel model = exported({onnx_node("Shape", {"w"}, {"n"}), onnx_node("Reshape", {"x", "n"}, {"f"}),
                                    onnx_node("Mul", {"f", "b"}, {"y"})});
  OnnxModel square = model;
  square.shape = {1, 4};
  EXPECT_TRUE(export_is_refused(model, {"Reshape: its shape does not fit its input"}));
  const Weights weights = parse_weights(square.bytes(), "net.onnx");
  EXPECT_EQ(weights.layers[0].weights,
            (std::vector<double>{1, 0, 0, 0, 0, -2, 0, 0, 0, 0, 1, 0, 0, 0, 0, -2}));
}

TEST(OnnxExporters, ABatchOfSeveralIsRefusedWithItsMend) {
  OnnxModel model = exported({onnx_node("Gemm", {"x", "w"}, {"y"})});
  model.shape = {4, 2};
  EXPECT_TRUE(export_is_refused(model, {"Gemm: ", "[4, 2]", "a batch of several", "dynamic_axes"}));
}

}  // namespace
}  // namespace swarmcert::files
