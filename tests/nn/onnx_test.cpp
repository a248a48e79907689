/// ONNX models: two written by the onnx package (1.12, opset 13), with outputs computed by NumPy from the same arrays;
/// and damaged or unsuitable ones, built field by field.
#include "nn/weights/onnx/onnx.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "onnx_writer.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using namespace tests;

/// x -> Gemm(transB) -> Relu -> MatMul -> Add -> Relu -> Gemm -> y, 2-3-3-1, with initialisers in raw_data.
const char kFloat32Model[] =
    "08081201743af0030a5d0a01780a0a6663312e7765696768740a086663312e626961731201611a092f6663312f47656d"
    "6d220447656d6d2a0f0a05616c706861150000803fa001012a0e0a0462657461150000803fa001012a0d0a067472616e"
    "73421801a001020a0c0a0161120162220452656c750a2b0a01620a0e6f6e6e783a3a4d61744d756c5f391201631a0b2f"
    "6663322f4d61744d756c22064d61744d756c0a150a086663322e626961730a016312016422034164640a0c0a01641201"
    "65220452656c750a220a01650a0a6663332e7765696768740a086663332e62696173120179220447656d6d1201672a2c"
    "080308021001420a6663312e7765696768744a180000e03d0000d83e0000d8be0000803c0000483f00004c3f2a1c0803"
    "100142086663312e626961734a0c0000403f0000143f0000643f2a3c080308031001420e6f6e6e783a3a4d61744d756c"
    "5f394a24000000be0000983e0000403e000070bf0000e0be000074bf0000c0bd0000b83e0000003e2a1c080310014208"
    "6663322e626961734a0c0000f83e0000303e0000e03e2a20080308011001420a6663332e7765696768744a0c0000c83e"
    "000000be000030bf2a140801100142086663332e626961734a040000c03d5a130a0178120e0a0c080112080a0208010a"
    "02080262130a0179120e0a0c080112080a0208010a02080142040a00100d";
const char kFloat64Model[] =
    "08081201743ad4040a5d0a01780a0a6663312e7765696768740a086663312e626961731201611a092f6663312f47656d"
    "6d220447656d6d2a0f0a05616c706861150000803fa001012a0e0a0462657461150000803fa001012a0d0a067472616e"
    "73421801a001020a0c0a0161120162220452656c750a2b0a01620a0e6f6e6e783a3a4d61744d756c5f391201631a0b2f"
    "6663322f4d61744d756c22064d61744d756c0a150a086663322e626961730a016312016422034164640a0c0a01641201"
    "65220452656c750a220a01650a0a6663332e7765696768740a086663332e62696173120179220447656d6d1201672a44"
    "08030802100b420a6663312e7765696768744a30000000000000bc3f000000000000db3f000000000000dbbf00000000"
    "0000903f000000000000e93f000000000080e93f2a280803100b42086663312e626961734a18000000000000e83f0000"
    "00000080e23f000000000080ec3f2a6008030803100b420e6f6e6e783a3a4d61744d756c5f394a48000000000000c0bf"
    "000000000000d33f000000000000c83f000000000000eebf000000000000dcbf000000000080eebf000000000000b8bf"
    "000000000000d73f000000000000c03f2a280803100b42086663322e626961734a18000000000000df3f000000000000"
    "c63f000000000000dc3f2a2c08030801100b420a6663332e7765696768744a18000000000000d93f000000000000c0bf"
    "000000000000e6bf2a180801100b42086663332e626961734a08000000000000b83f5a130a0178120e0a0c080b12080a"
    "0208010a02080262130a0179120e0a0c080b12080a0208010a02080142040a00100d";

std::string bytes_of(const std::string& hex) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return bytes;
}

testing::AssertionResult onnx_is_refused(const std::string& bytes, const std::vector<std::string>& pieces) {
  return refuses([&] { parse_weights(bytes, "net.onnx"); }, pieces);
}

TEST(Onnx, ModelsOfTheOnnxPackageGiveTheValuesThatNumPyComputes) {
  struct Case {
    std::vector<double> x;
    double y;
  };
  const std::vector<Case> cases = {{{0.5, -0.25}, -0x1.d382000000000p-3},
                                   {{1.0, 1.0}, -0x1.48d6000000000p-1},
                                   {{-1.0, 0.75}, 0x1.ee20000000000p-5},
                                   {{0.0, 0.0}, -0x1.e460000000000p-5},
                                   {{-0.5, -1.0}, 0x1.8000000000000p-4}};
  for (const bool narrow : {true, false}) {
    const Weights weights = parse_weights(bytes_of(narrow ? kFloat32Model : kFloat64Model), "net.onnx");
    EXPECT_EQ(weights.precision, narrow ? Precision::kFloat32 : Precision::kFloat64);
    ASSERT_EQ(weights.layers.size(), 3u);
    EXPECT_EQ(weights.layers[0].name, "fc1");
    EXPECT_EQ(weights.layers[1].name, "onnx::MatMul_9");  // the exporter's name
    EXPECT_EQ(weights.layers[2].name, "fc3");
    const Evaluator<double> f(weights);
    for (const Case& one : cases)
      EXPECT_EQ(f(one.x)[0], one.y);  // every number is a multiple of 2^-18, so there is no round-off
  }
}

TEST(Onnx, ConstantsIdentitiesAndTypedDataAreRead) {
  OnnxModel model;
  model.tensors = {};
  model.nodes = {constant_node("W", onnx_floats("", {2, 2}, {1, 2, 3, 4})),
                 onnx_node("Identity", {"b"}, {"bias"}),
                 onnx_node("Gemm", {"x", "W", "bias"}, {"y"}, {onnx_integer("transB", 1)})};
  model.tensors.push_back(onnx_floats("b", {1, 2}, {5, 6}));
  const Weights weights = parse_weights(model.bytes(), "net.onnx");
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{5, 6}));
  EXPECT_EQ(weights.layers[0].name, "W");
}

TEST(Onnx, AMatrixStoredForMatMulIsTransposed) {
  OnnxModel model;
  model.nodes = {onnx_node("MatMul", {"x", "w.weight"}, {"y"})};
  model.tensors = {onnx_raw("w.weight", {2, 3}, {1, 2, 3, 4, 5, 6})};
  const Weights weights = parse_weights(model.bytes(), "net.onnx");
  EXPECT_EQ(weights.layers[0].outputs, 3);
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{1, 4, 2, 5, 3, 6}));
  EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{0, 0, 0}));
  EXPECT_EQ(weights.layers[0].name, "w");
}

TEST(Onnx, GraphsThatAreNoChainOfLinearLayersAreRefusedByNode) {
  const auto w = onnx_raw("w", {2, 2}, {1, 2, 3, 4});
  const auto b = onnx_raw("b", {2}, {1, 2});
  const auto with = [&](std::vector<std::string> nodes) {
    OnnxModel model;
    model.nodes = std::move(nodes);
    model.tensors = {w, b};
    model.shape = {1, 2};
    return model.bytes();
  };
  const std::string gemm = onnx_node("Gemm", {"x", "w", "b"}, {"h"});
  const auto expect = [&](const std::vector<std::string>& nodes, const std::string& piece) {
    EXPECT_TRUE(onnx_is_refused(with(nodes), {"net.onnx: offset ", piece}));
  };
  expect({onnx_node("Mish", {"x"}, {"y"})}, "Mish: is not one of the supported operators");
  expect({gemm, onnx_node("Mish", {"h"}, {"y"})}, "train with ReLU, LeakyReLU, Hardtanh");
  expect({gemm, onnx_node("Mul", {"h", "h"}, {"y"})}, "Mul: is not an affine function");
  expect({gemm, onnx_node("Div", {"w", "h"}, {"y"})}, "Div: divides a constant by a value");
  expect({onnx_node("Gemm", {"x", "w", "b"}, {"y"}, {onnx_integer("transA", 1)})}, "transposes its input");
  expect({onnx_node("Gemm", {"w", "x", "b"}, {"y"})}, "is not the input times weights");
  expect({onnx_node("Gemm", {"x", "x", "b"}, {"y"})}, "\"x\" as an input that must be stored");
  expect({onnx_node("Gemm", {"x", "other"}, {"y"})}, "neither stored nor computed before it");
  expect({onnx_node("MatMul", {"x", ""}, {"y"})}, "lacks its weights");
  expect({gemm, onnx_node("Relu", {"w"}, {"y"})}, "does not use the output of the preceding node");
  expect({gemm, onnx_node("Conv", {"h", "w"}, {"y"})}, "Conv: its weights of shape [2, 2] are not a kernel");
  expect({gemm, onnx_node("MaxPool", {"h"}, {"y"})}, "MaxPool: its input must have the shape [1, channels");
  expect({gemm, onnx_node("Reshape", {"h"}, {"y"}, {onnx_integers("shape", {3})})},
         "Reshape: its shape does not fit");
  expect({gemm, onnx_node("Cast", {"h"}, {"y"}, {onnx_integer("to", 7)})}, "Cast: casts to a type");
  expect({gemm}, "is not where its chain of nodes ends");
  expect({onnx_node("Identity", {"x"}, {"y"})}, "has no linear layer");
  expect({onnx_node("Constant", {}, {"c"})}, "holds no tensor");
  expect({onnx_node("Gemm", {"x", "w"}, {"y", "z"})}, "has not exactly one output");
  expect({onnx_node("Gemm", {"x", "w"}, {"y"}, {}, "com.microsoft")}, "operator set");
}

TEST(Onnx, TensorsThatCannotBeWeightsAreRefused) {
  const auto with = [&](std::vector<std::string> tensors) {
    OnnxModel model;
    model.nodes = {onnx_node("MatMul", {"x", "w"}, {"y"})};
    model.tensors = std::move(tensors);
    model.shape = {1, 2};
    return model.bytes();
  };
  const std::string data = raw_numbers(std::vector<float>{1, 2, 3, 4});
  const std::string good = onnx_raw("w", {2, 2}, {1, 2, 3, 4});
  EXPECT_TRUE(onnx_is_refused(with({good, good}), {"\"w\"", "appears twice"}));
  EXPECT_TRUE(onnx_is_refused(with({onnx_tensor("w", {2, 2}, 9, onnx_text(9, "\1\1\1\1"))}),
                              {"data type 9", "float32 or float64"}));
  EXPECT_TRUE(onnx_is_refused(with({onnx_raw("w", {2, 3}, {1, 2, 3, 4})}),
                              {"16 bytes of numbers for the shape [2, 3]"}));
  EXPECT_TRUE(
      onnx_is_refused(with({onnx_raw("w", {1u << 31, 1u << 31}, {1})}), {"bytes of numbers for the shape"}));
  EXPECT_TRUE(onnx_is_refused(with({onnx_tensor("w", {2, ~std::uint64_t{0}}, 1, onnx_text(9, data))}),
                              {"negative dimension"}));
  EXPECT_TRUE(onnx_is_refused(with({onnx_raw("w", {4}, {1, 2, 3, 4})}), {"two dimensions"}));
  EXPECT_TRUE(onnx_is_refused(
      with({good.substr(0, 0) + onnx_tensor("w", {2, 2}, 1, onnx_text(4, data) + onnx_text(9, data))}),
      {"bytes of numbers"}));
  EXPECT_TRUE(onnx_is_refused(with({onnx_tensor("w", {2, 2}, 1, onnx_text(9, data) + onnx_text(9, data))}),
                              {"not in one piece"}));
  EXPECT_TRUE(
      onnx_is_refused(with({onnx_tensor("w", {2, 2}, 1, onnx_text(9, data) + onnx_varint_field(14, 1))}),
                      {"outside the folder"}));
  EXPECT_TRUE(onnx_is_refused(with({onnx_raw("w", {2, 2}, {1, 2, 3, NAN})}), {"not finite"}));
}

/// Returns the layers of a model of `nodes` with two inputs, w = [[1, 2], [3, 4]] and b = [1, -2].
Weights of_nodes(std::vector<std::string> nodes) {
  OnnxModel model;
  model.nodes = std::move(nodes);
  model.tensors = {onnx_raw("w", {2, 2}, {1, 2, 3, 4}), onnx_raw("b", {2}, {1, -2})};
  model.shape = {1, 2};
  return parse_weights(model.bytes(), "net.onnx");
}

TEST(Onnx, TwoLinearLayersInARowAreTheirExactProduct) {
  const Weights weights = of_nodes({onnx_node("Gemm", {"x", "w", "b"}, {"h"}, {onnx_float("alpha", 2)}),
                                    onnx_node("Gemm", {"h", "w", "b"}, {"y"}, {onnx_integer("transB", 1)})});
  ASSERT_EQ(weights.layers.size(), 1u);
  // y = w (2 w' x + b) + b
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{10, 22, 22, 50}));
  EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{-2, -7}));
  EXPECT_EQ(weights.layers[0].weight_rounding, 0);
  EXPECT_EQ(weights.precision, Precision::kFloat32);
  EXPECT_EQ(rounding_of_slope(weights), 0);
}

TEST(Onnx, AQuotientThatIsNoDoubleIsEnclosed) {
  OnnxModel model;
  model.nodes = {onnx_node("Div", {"x", "c"}, {"h"}), onnx_node("MatMul", {"h", "w"}, {"y"})};
  model.tensors = {onnx_raw("w", {1, 1}, {1}), onnx_raw("c", {1}, {3})};
  const Weights weights = parse_weights(model.bytes(), "net.onnx");
  const Layer& layer = weights.layers[0];
  const double missed =
      std::fabs(std::fma(3, layer.weights[0], -1.0)) / 3;  // of 1/3; exact up to the division
  EXPECT_GT(missed, 0);
  EXPECT_GE(layer.weight_rounding, missed);
  EXPECT_LT(layer.weight_rounding, 4 * missed);
  EXPECT_GE(rounding_of_slope(weights), layer.weight_rounding);
  EXPECT_EQ(weights.precision, Precision::kFloat64);
}

TEST(Onnx, AnActivationAtTheEndIsFollowedByAnIdentityLayer) {
  const Weights weights = of_nodes({onnx_node("Gemm", {"x", "w", "b"}, {"h"}),
                                    onnx_node("Relu", {"h"}, {"r"}), onnx_node("Relu", {"r"}, {"y"})});
  ASSERT_EQ(weights.layers.size(), 3u);
  EXPECT_EQ(weights.layers.back().weights, (std::vector<double>{1, 0, 0, 1}));
  EXPECT_FALSE(weights.notes.empty());
}

TEST(Onnx, PiecewiseLinearFunctionsAreTheSameFunctionWithRelu) {
  struct Case {
    std::vector<std::string> nodes;
    std::function<double(double)> function;
  };
  const std::vector<Case> cases = {
      {{onnx_node("LeakyRelu", {"x"}, {"y"}, {onnx_float("alpha", 0.25F)})},
       [](double x) { return x < 0 ? 0.25 * x : x; }},
      {{onnx_node("PRelu", {"x", "b"}, {"y"})}, [](double x) { return x; }},  // slopes 1 and -2: see below
      {{onnx_node("Abs", {"x"}, {"y"})}, [](double x) { return std::fabs(x); }},
      {{onnx_node("Clip", {"x"}, {"y"}, {onnx_float("min", -0.5F), onnx_float("max", 1.5F)})},
       [](double x) { return std::min(std::max(x, -0.5), 1.5); }},
      {{onnx_node("Clip", {"x"}, {"y"}, {onnx_float("max", 1.5F)})},
       [](double x) { return std::min(x, 1.5); }},
      {{onnx_node("HardSigmoid", {"x"}, {"y"}, {onnx_float("alpha", 0.25F)})},
       [](double x) { return std::min(std::max(0.25 * x + 0.5, 0.0), 1.0); }},
      {{onnx_node("Relu", {"x"}, {"r"}), onnx_node("Sub", {"x", "r"}, {"y"})},
       [](double x) { return std::min(x, 0.0); }},
      {{onnx_node("Neg", {"x"}, {"n"}), onnx_node("Max", {"x", "n"}, {"y"})},
       [](double x) { return std::fabs(x); }},
  };
  for (const Case& one : cases) {
    const Evaluator<double> f(of_nodes(one.nodes));
    for (const double x : {-4.0, -0.75, 0.0, 0.5, 1.0, 3.0})
      EXPECT_EQ(f({x, 1.0})[0], one.function(x)) << x;  // every number is a small multiple of 1/16
  }
  const Evaluator<double> prelu(of_nodes(cases[1].nodes));
  EXPECT_EQ(prelu({-1.0, -3.0}), (std::vector<double>{-1, 6}));
}

TEST(Onnx, ASumAddsEveryInputOnceWhereverItsConstantStands) {
  for (const std::vector<std::string>& inputs :
       {std::vector<std::string>{"b", "x", "d"}, {"x", "b", "d"}, {"d", "x", "b"}, {"x", "d", "b"}}) {
    const Weights weights = of_nodes({onnx_node("Gemm", {"x", "w"}, {"d"}), onnx_node("Sum", inputs, {"y"})});
    ASSERT_EQ(weights.layers.size(), 1u);
    EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{2, 3, 2, 5}));  // 1 + w'
    EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{1, -2}));
  }
}

TEST(Onnx, NodesWithoutInputsAreRefused) {
  for (const char* const type :
       {"Dropout", "BatchNormalization", "Relu", "Add", "Sum", "Concat", "Gemm", "Shape"})
    EXPECT_TRUE(refuses([&] { of_nodes({onnx_node(type, {}, {"y"})}); }, {"net.onnx: offset ", type}));
}

TEST(Onnx, ASmallKernelOnALargeImageIsRefusedByItsNode) {
  OnnxModel model;
  model.nodes = {onnx_node("Conv", {"x", "k"}, {"y"}, {onnx_integers("pads", {1, 1, 1, 1})})};
  model.tensors = {onnx_raw("k", {1, 1, 3, 3}, {1, 1, 1, 1, 1, 1, 1, 1, 1})};
  model.shape = {1, 1, 4, 4};
  EXPECT_EQ(parse_weights(model.bytes(), "net.onnx").outputs(), 16);
  model.shape = {1, 1, 1000, 1000};
  EXPECT_TRUE(onnx_is_refused(model.bytes(), {"Conv", "dense layer", "too many numbers"}));
  model.shape = {1, 1, 100, 100};
  EXPECT_TRUE(onnx_is_refused(model.bytes(), {"dense layers has more than 2^25 numbers"}));
}

TEST(Onnx, HalfPrecisionIsExact) {
  for (const bool brain : {false, true}) {
    OnnxModel model;
    model.nodes = {onnx_node("MatMul", {"x", "w"}, {"y"})};
    const std::string data = brain ? std::string("\xc0\x3f", 2) : std::string("\x01\xbe", 2);
    model.tensors = {onnx_tensor("w", {1, 1}, brain ? 16 : 10, onnx_text(9, data))};
    const Weights weights = parse_weights(model.bytes(), "net.onnx");
    EXPECT_EQ(weights.layers[0].weights[0], brain ? 1.5 : -1.5009765625);  // 0x3fc0; 0xbe01
    EXPECT_EQ(weights.precision, Precision::kFloat32);
  }
}

TEST(Onnx, ModelsWithoutOneGraphInputAndOutputAreRefused) {
  OnnxModel model;
  model.nodes = {onnx_node("MatMul", {"x", "w"}, {"y"})};
  model.tensors = {onnx_raw("w", {2, 2}, {1, 2, 3, 4})};
  OnnxModel other = model;
  other.inputs = {"x", "z"};
  EXPECT_TRUE(onnx_is_refused(other.bytes(), {"has 2 inputs, not one"}));
  other = model;
  other.inputs = {};
  EXPECT_TRUE(onnx_is_refused(other.bytes(), {"has 0 inputs"}));
  other = model;
  other.inputs = {"x", "w"};  // old exporters also list the weights
  EXPECT_EQ(parse_weights(other.bytes(), "net.onnx").layers.size(), 1u);
  other = model;
  other.outputs = {"y", "z"};
  EXPECT_TRUE(onnx_is_refused(other.bytes(), {"graph", "two outputs, \"y\" and \"z\""}));
  other = model;
  other.graph_extra = onnx_text(15, "");
  EXPECT_TRUE(onnx_is_refused(other.bytes(), {"sparse"}));
  EXPECT_TRUE(onnx_is_refused(model.bytes() + onnx_text(7, ""), {"graph", "appears twice"}));
  EXPECT_TRUE(onnx_is_refused(onnx_varint_field(1, 8) + onnx_text(2, "pytorch"), {"graph", "is missing"}));
  EXPECT_TRUE(refuses([&] { parse_weights(model.bytes(), "net.onnx", "model"); },
                      {"--key", "ONNX files are not nested"}));
  OnnxModel many;
  many.nodes.assign(10'001, onnx_node("Relu", {"x"}, {"y"}));
  EXPECT_TRUE(onnx_is_refused(many.bytes(), {"more than 10000 nodes"}));
}

TEST(Onnx, DamagedProtobufIsRefusedAtItsOffset) {
  const std::string head = onnx_varint_field(1, 8) + onnx_text(2, "p");
  EXPECT_TRUE(onnx_is_refused(head + "\x3a\xff", {"offset ", "cut off or too long"}));
  EXPECT_TRUE(onnx_is_refused(head + "\x3a\x7f", {"longer than what holds it"}));
  EXPECT_TRUE(onnx_is_refused(head + "\x0b", {"not a protobuf field type"}));
  EXPECT_TRUE(onnx_is_refused(head + std::string("\x00\x00", 2), {"not a protobuf field number"}));
  EXPECT_TRUE(onnx_is_refused(head + "\x08" + std::string(10, '\xff') + "\x01", {"cut off or too long"}));
  EXPECT_TRUE(onnx_is_refused(head + "\x0d\x01", {"longer than what holds it"}));
  EXPECT_TRUE(onnx_is_refused(head + onnx_varint_field(7, 1), {"a message is stored as a number"}));
  EXPECT_TRUE(onnx_is_refused(head + onnx_text(7, onnx_text(1, onnx_varint_field(4, 1))),
                              {"a name is stored as a number"}));
  EXPECT_TRUE(onnx_is_refused(head + onnx_text(7, onnx_text(5, onnx_text(1, "\xff"))),
                              {"packed numbers are truncated"}));
}

TEST(Onnx, EveryTruncationAndFlippedBitIsRefusedOrGivesASoundNetwork) {
  const std::string good = bytes_of(kFloat32Model);
  int refusals = 0;
  const auto try_to_load = [&](const std::string& bytes) {
    try {
      const Weights weights = parse_weights(bytes, "damaged");
      for (std::size_t k = 1; k < weights.layers.size(); ++k)
        ASSERT_EQ(weights.layers[k].inputs, weights.layers[k - 1].outputs);
    } catch (const InputError&) {
      ++refusals;
    }
  };
  for (std::size_t size = 0; size < good.size(); ++size) try_to_load(good.substr(0, size));
  EXPECT_GT(refusals, static_cast<int>(good.size()) - 20);
  refusals = 0;
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    std::string bytes = good;
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ 1 << bit % 8);
    try_to_load(bytes);
  }
  EXPECT_GT(refusals, 1000);
}

}  // namespace
}  // namespace swarmcert::files
