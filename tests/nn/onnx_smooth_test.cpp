/// Smooth activations in ONNX models: single nodes, the groups of nodes that PyTorch exports, and rejected models.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "nn/weights/weights.h"
#include "onnx_writer.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using namespace tests;

/// Gemm, `nodes` from "h" to "a", Gemm; 2-2-1.
std::string smooth_model(const std::vector<std::string>& nodes, const std::string& end = "a") {
  OnnxModel model;
  model.nodes = {onnx_node("Gemm", {"x", "w", "b"}, {"h"})};
  model.nodes.insert(model.nodes.end(), nodes.begin(), nodes.end());
  model.nodes.push_back(onnx_node("Gemm", {end, "v"}, {"y"}));
  model.tensors = {onnx_raw("w", {2, 2}, {1, -2, 0.5F, 3}),
                   onnx_raw("b", {2}, {0.25F, -1}),
                   onnx_raw("v", {2, 1}, {2, -3}),
                   onnx_raw("root", {}, {1.41421354F}),
                   onnx_raw("one", {}, {1}),
                   onnx_raw("above_one", {}, {1.00000012F}),
                   onnx_raw("half", {}, {0.5F})};
  model.shape = {1, 2};
  return model.bytes();
}

Weights smooth_weights(const std::vector<std::string>& nodes) {
  return parse_weights(smooth_model(nodes), "net.onnx");
}

testing::AssertionResult smooth_is_refused(const std::vector<std::string>& nodes,
                                           const std::vector<std::string>& pieces) {
  return refuses([&] { smooth_weights(nodes); }, pieces);
}

std::vector<std::string> gelu_nodes(const std::string& root = "root", const std::string& one = "one") {
  return {onnx_node("Div", {"h", root}, {"q"}), onnx_node("Erf", {"q"}, {"e"}),
          onnx_node("Add", {"e", one}, {"p"}), onnx_node("Mul", {"h", "p"}, {"m"}),
          onnx_node("Mul", {"m", "half"}, {"a"})};
}

TEST(OnnxSmooth, EveryActivationIsTheFunctionOfItsName) {
  const auto gelu = [](double t) { return t / 2 * (1 + std::erf(t / std::sqrt(2.0))); };
  const auto silu = [](double t) { return t / (1 + std::exp(-t)); };
  const auto elu = [](double t) { return t > 0 ? t : std::expm1(t); };
  struct Case {
    std::vector<std::string> nodes;
    Activation activation;
    std::function<double(double)> function;
  };
  const std::vector<Case> cases = {
      {{onnx_node("Tanh", {"h"}, {"a"})}, Activation::kTanh, [](double t) { return std::tanh(t); }},
      {{onnx_node("Sigmoid", {"h"}, {"a"})},
       Activation::kSigmoid,
       [](double t) { return 1 / (1 + std::exp(-t)); }},
      {{onnx_node("Softplus", {"h"}, {"a"})},
       Activation::kSoftplus,
       [](double t) { return std::log1p(std::exp(t)); }},
      {{onnx_node("Elu", {"h"}, {"a"}, {onnx_float("alpha", 1)})}, Activation::kElu, elu},
      {{onnx_node("Celu", {"h"}, {"a"})}, Activation::kElu, elu},
      {{onnx_node("Gelu", {"h"}, {"a"})}, Activation::kGelu, gelu},
      {gelu_nodes(), Activation::kGelu, gelu},
      {{onnx_node("Sigmoid", {"h"}, {"s"}), onnx_node("Mul", {"h", "s"}, {"a"})}, Activation::kSilu, silu},
      {{onnx_node("Sigmoid", {"h"}, {"s"}), onnx_node("Mul", {"s", "h"}, {"a"})}, Activation::kSilu, silu},
      {{onnx_node("Swish", {"h"}, {"a"})}, Activation::kSilu, silu},
  };
  for (const Case& one : cases) {
    const Weights weights = smooth_weights(one.nodes);
    EXPECT_EQ(weights.activation_names(), function_of(one.activation).op);
    EXPECT_EQ(weights.layers.size(), 2u);
    EXPECT_TRUE(weights.states_activation());
    const std::vector<double> x = {0.75, -0.5};
    const double h[] = {x[0] + 0.5 * x[1] + 0.25, -2 * x[0] + 3 * x[1] - 1};
    EXPECT_NEAR(Evaluator<double>(weights)(x)[0], 2 * one.function(h[0]) - 3 * one.function(h[1]), 1e-14)
        << function_of(one.activation).op;
  }
}

TEST(OnnxSmooth, AnActivationAtTheEndOrTheBeginningIsBesideAnIdentityLayer) {
  OnnxModel model;
  model.nodes = {onnx_node("Tanh", {"x"}, {"t"}), onnx_node("Gemm", {"t", "w"}, {"h"}),
                 onnx_node("Tanh", {"h"}, {"y"})};
  model.tensors = {onnx_raw("w", {2, 2}, {1, -2, 0.5F, 3})};
  model.shape = {1, 2};
  const Weights weights = parse_weights(model.bytes(), "net.onnx");
  ASSERT_EQ(weights.layers.size(), 3u);
  EXPECT_EQ(weights.layers.front().weights, (std::vector<double>{1, 0, 0, 1}));
  EXPECT_EQ(weights.layers.back().weights, (std::vector<double>{1, 0, 0, 1}));
  EXPECT_NE(weights.notes.front().find("ends in a tanh"), std::string::npos);
  const double y = Evaluator<double>(weights)({0.5, -0.25})[0];
  EXPECT_NEAR(y, std::tanh(std::tanh(0.5) + 0.5 * std::tanh(-0.25)), 1e-15);
}

TEST(OnnxSmooth, OtherParametersAreRefused) {
  EXPECT_TRUE(
      smooth_is_refused({onnx_node("Elu", {"h"}, {"a"}, {onnx_float("alpha", 0.5F)})}, {"Elu: alpha"}));
  // 1.05070102214813232 * 1.67326319217681885 = 1.75809934634, above the slope 1.75809934085 of the statement's SELU.
  EXPECT_TRUE(
      smooth_is_refused({onnx_node("Swish", {"h"}, {"a"}, {onnx_float("alpha", 2)})}, {"Swish: alpha"}));
  const std::string tanh_form = onnx_text(1, "approximate") + onnx_text(4, "tanh");
  EXPECT_TRUE(smooth_is_refused({onnx_node("Gelu", {"h"}, {"a"}, {tanh_form})}, {"Gelu: approximate"}));
  EXPECT_TRUE(smooth_is_refused({onnx_node("Mish", {"h"}, {"a"})},
                                {"Mish: is not one of the supported operators", "SiLU"}));
}

TEST(OnnxSmooth, AProductThatOnlyResemblesSiluOrGeluIsRefused) {
  EXPECT_TRUE(smooth_is_refused({onnx_node("Sigmoid", {"h"}, {"s"}), onnx_node("Mul", {"s", "s"}, {"a"})},
                                {"Mul: is not an affine function"}));
  EXPECT_TRUE(smooth_is_refused({onnx_node("Neg", {"h"}, {"n"}), onnx_node("Sigmoid", {"h"}, {"s"}),
                                 onnx_node("Mul", {"n", "s"}, {"a"})},
                                {"Mul: is not an affine function"}));
  EXPECT_TRUE(smooth_is_refused(gelu_nodes("half"), {"Erf: is not one of the supported operators"}));
  // Such a function's slope exceeds GELU's by half of the number's deviation.
  EXPECT_TRUE(
      smooth_is_refused(gelu_nodes("root", "above_one"), {"Erf: is not one of the supported operators"}));
}

TEST(OnnxSmooth, EveryTruncatedOrFlippedModelIsRefusedOrSound) {
  const std::string whole = smooth_model(gelu_nodes());
  int sound = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    for (const bool truncates : {true, false}) {
      std::string bytes = truncates ? whole.substr(0, i) : whole;
      if (!truncates) bytes[i] = static_cast<char>(bytes[i] ^ 4);
      try {
        const Weights weights = parse_weights(bytes, "net.onnx");
        EXPECT_FALSE(weights.layers.empty());
        EXPECT_TRUE(weights.is_relu() || weights.layers.size() > 1);
        ++sound;
      } catch (const InputError&) {
        continue;
      }
    }
  }
  EXPECT_GT(sound, 20);
}

}  // namespace
}  // namespace swarmcert::files
