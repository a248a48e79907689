/// Networks with different activations between their layers and after the last one, read from ONNX or stated by name.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "nn/weights/activation.h"
#include "nn/weights/chain.h"
#include "nn/weights/network.h"
#include "onnx_writer.h"
#include "random_network.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using namespace tests;
using Values = std::vector<double>;
using Function = std::function<double(double)>;

double relu(double t) { return t > 0 ? t : 0; }
double sigmoid(double t) { return 1 / (1 + std::exp(-t)); }
double silu(double t) { return t / (1 + std::exp(-t)); }
double gelu(double t) { return t / 2 * (1 + std::erf(t / std::sqrt(2.0))); }
double tanh_of(double t) { return std::tanh(t); }

/// Computes W x + b by definition.
Values affine(const Values& w, const Values& b, const Values& x) {
  Values y = b;
  for (std::size_t i = 0; i < y.size(); ++i)
    for (std::size_t j = 0; j < x.size(); ++j) y[i] += w[i * x.size() + j] * x[j];
  return y;
}

Values each(const Function& function, Values values) {
  for (double& value : values) value = function(value);
  return values;
}

/// x -> h1 = W x + b -> t1 -> ..., sizes 2 - 2 - 2: Gemm layers with transB, named l1, l2, ... in the order of `nodes`.
struct Model {
  const Values w = {1, -2, 0.5, 3}, b = {0.25, -1};
  OnnxModel model;

  Model() {
    model.tensors = {onnx_raw("w", {2, 2}, {1, -2, 0.5F, 3}),
                     onnx_raw("b", {2}, {0.25F, -1}),
                     onnx_raw("root", {}, {1.41421354F}),
                     onnx_raw("one", {}, {1}),
                     onnx_raw("half", {}, {0.5F}),
                     onnx_raw("leaky", {}, {0.01F})};
    model.shape = {1, 2};
  }
  Model& gemm(const std::string& from, const std::string& to) {
    model.nodes.push_back(onnx_node("Gemm", {from, "w", "b"}, {to}, {onnx_integer("transB", 1)}));
    return *this;
  }
  Model& node(const std::string& type, const std::vector<std::string>& from, const std::string& to) {
    model.nodes.push_back(onnx_node(type, from, {to}));
    return *this;
  }
  Weights weights() const { return parse_weights(model.bytes(), "net.onnx"); }
};

const Values kPoints[] = {{0.75, -0.5}, {-1.5, 0.25}, {0.125, 2}, {-0.25, -0.75}};

/// Expects that `weights` equals `f` at every point.
void expect_function(const Weights& weights, const std::function<Values(const Values&)>& f) {
  const Evaluator<double> evaluator(weights);
  for (const Values& x : kPoints) {
    const Values found = evaluator(x), expected = f(x);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-13);
  }
}

TEST(MixedActivations, OfOnnxModelsEachFollowItsOwnLayer) {
  Model m;
  m.gemm("x", "h").node("Relu", {"h"}, "r").gemm("r", "g").node("Tanh", {"g"}, "t").gemm("t", "k");
  m.node("Sigmoid", {"k"}, "s").node("Mul", {"k", "s"}, "u").gemm("u", "y");
  const Weights weights = m.weights();
  EXPECT_EQ(weights.activation_names(), "relu, tanh, silu");
  EXPECT_FALSE(weights.is_relu());
  expect_function(weights, [&m](Values x) {
    for (const Function& function : {Function(relu), Function(tanh_of), Function(silu)})
      x = each(function, affine(m.w, m.b, x));
    return affine(m.w, m.b, x);
  });
}

TEST(MixedActivations, AtTheEndOfOnnxModelsAreFollowedByTheIdentity) {
  for (const auto& [type, function] :
       {std::pair<const char*, Function>{"Tanh", tanh_of}, {"Sigmoid", sigmoid}}) {
    Model m;
    m.gemm("x", "h").node("Relu", {"h"}, "r").gemm("r", "g").node(type, {"g"}, "y");
    const Weights weights = m.weights();
    ASSERT_EQ(weights.layers.size(), 3u);
    EXPECT_EQ(weights.layers.back().weights, (Values{1, 0, 0, 1}));
    EXPECT_EQ(weights.activation_names(), std::string("relu, ") + (type[0] == 'T' ? "tanh" : "sigmoid"));
    expect_function(weights, [&m, end = function](const Values& x) {
      return each(end, affine(m.w, m.b, each(relu, affine(m.w, m.b, x))));
    });
  }
}

TEST(MixedActivations, GroupsThatExportersWriteAndPiecewiseLinearOnesStandBesideOthers) {
  Model m;
  m.gemm("x", "h").node("Div", {"h", "root"}, "q").node("Erf", {"q"}, "e").node("Add", {"e", "one"}, "p");
  m.node("Mul", {"h", "p"}, "v")
      .node("Mul", {"v", "half"}, "a")
      .gemm("a", "g")
      .node("PRelu", {"g", "leaky"}, "l");
  m.gemm("l", "k").node("Tanh", {"k"}, "y");
  const Weights weights = m.weights();
  EXPECT_EQ(weights.activation_names(), "gelu, relu, tanh");
  const double slope = 0.01F;
  expect_function(weights, [&m, slope](const Values& x) {
    const Values a = each(gelu, affine(m.w, m.b, x));
    const Values l = each([slope](double t) { return t > 0 ? t : slope * t; }, affine(m.w, m.b, a));
    return each(tanh_of, affine(m.w, m.b, l));
  });
}

/// A value carried past a ReLU as relu(x) is never negative after a ReLU, but may be negative after tanh.
TEST(MixedActivations, ASkipConnectionPastAReluTakesNegativeValuesOfAnotherActivationAlong) {
  Model m;
  m.gemm("x", "h")
      .node("Tanh", {"h"}, "t")
      .gemm("t", "g")
      .node("Relu", {"g"}, "r")
      .node("Add", {"r", "t"}, "s");
  m.gemm("s", "y");
  const Weights weights = m.weights();
  EXPECT_EQ(weights.activation_names(), "tanh, relu");
  int negative = 0;
  expect_function(weights, [&m, &negative](const Values& x) {
    const Values t = each(tanh_of, affine(m.w, m.b, x));
    Values s = each(relu, affine(m.w, m.b, t));
    for (std::size_t i = 0; i < s.size(); ++i) {
      s[i] += t[i];
      negative += t[i] < 0;
    }
    return affine(m.w, m.b, s);
  });
  EXPECT_GT(negative, 2);
}

TEST(MixedActivations, SkipConnectionsPastSmoothOnesAreKeptAsTheyAre) {
  Model around;  // y = W (t + h) + b with t = tanh h
  around.gemm("x", "h").node("Tanh", {"h"}, "t").node("Add", {"t", "h"}, "s").gemm("s", "y");
  const Weights weights = around.weights();
  EXPECT_EQ(weights.activation_names(), "tanh:2");
  EXPECT_EQ(weights.layers.front().outputs, 4);
  EXPECT_EQ(weights.layers.front().kept, 2);
  EXPECT_EQ(words_after(weights.layers.front()), "tanh of the first 2");
  EXPECT_FALSE(weights.is_relu());
  expect_function(weights, [&around](const Values& x) {
    const Values h = affine(around.w, around.b, x);
    return affine(around.w, around.b, each([](double t) { return std::tanh(t) + t; }, h));
  });
}

TEST(MixedActivations, ResidualBlocksAndParallelBranchesAreTheSameFunction) {
  Model residual;  // two blocks h + W silu(W h + b) + b, then h - relu(h)
  residual.gemm("x", "h");
  for (const std::string k : {"1", "2"}) {
    const std::string from = k == "1" ? "h" : "r1";
    residual.gemm(from, "g" + k).node("Sigmoid", {"g" + k}, "s" + k).node("Mul", {"g" + k, "s" + k}, "a" + k);
    residual.gemm("a" + k, "b" + k).node("Add", {from, "b" + k}, "r" + k);
  }
  residual.node("Relu", {"r2"}, "p").node("Sub", {"r2", "p"}, "y");
  const Weights blocks = residual.weights();
  EXPECT_EQ(blocks.activation_names(), "silu:2, silu:2, relu");
  expect_function(blocks, [&residual](const Values& x) {
    Values h = affine(residual.w, residual.b, x);
    for (int k = 0; k < 2; ++k) {
      const Values b = affine(residual.w, residual.b, each(silu, affine(residual.w, residual.b, h)));
      for (std::size_t i = 0; i < h.size(); ++i) h[i] += b[i];
    }
    return each([](double t) { return t - relu(t); }, h);
  });

  Model gated;  // h + W gelu(h) + b, GELU as PyTorch exports it for opsets below 20
  gated.gemm("x", "h").node("Div", {"h", "root"}, "q").node("Erf", {"q"}, "e").node("Add", {"e", "one"}, "p");
  gated.node("Mul", {"h", "p"}, "m")
      .node("Mul", {"m", "half"}, "a")
      .gemm("a", "g")
      .node("Add", {"h", "g"}, "y");
  EXPECT_EQ(gated.weights().activation_names(), "gelu:2");
  expect_function(gated.weights(), [&gated](const Values& x) {
    const Values h = affine(gated.w, gated.b, x);
    Values y = affine(gated.w, gated.b, each(gelu, h));
    for (std::size_t i = 0; i < y.size(); ++i) y[i] += h[i];
    return y;
  });

  Model parallel;  // tanh h - sigmoid h, then tanh of the difference
  parallel.gemm("x", "h").node("Tanh", {"h"}, "t").node("Sigmoid", {"h"}, "s").node("Sub", {"t", "s"}, "d");
  parallel.gemm("d", "g").node("Tanh", {"g"}, "y");
  const Weights branches = parallel.weights();
  EXPECT_EQ(branches.activation_names(), "tanh:2, sigmoid:2, tanh");
  expect_function(branches, [&parallel](const Values& x) {
    const Values d =
        each([](double t) { return std::tanh(t) - sigmoid(t); }, affine(parallel.w, parallel.b, x));
    return each(tanh_of, affine(parallel.w, parallel.b, d));
  });
}

Weights unstated_network(const std::vector<int>& sizes) {
  std::mt19937 generator(5);
  Weights weights = random_network(sizes, generator);
  weights.order_source = OrderSource::kNames;
  weights.activation_source = ActivationSource::kDefault;
  return weights;
}

TEST(MixedActivations, OneNameIsBetweenAllLayersAndAListIsOnePerLayer) {
  const Weights plain = unstated_network({2, 6, 4, 3});
  EXPECT_EQ(with_activation(plain, "tanh").activation_names(), "tanh");
  EXPECT_EQ(with_activation(plain, "tanh,relu").activation_names(), "tanh, relu");
  const Weights ended = with_activation(plain, "relu,elu,sigmoid");
  EXPECT_EQ(ended.activation_names(), "relu, elu, sigmoid");
  ASSERT_EQ(ended.layers.size(), 4u);
  EXPECT_EQ(ended.layers.back().name, "layer4");
  const auto of = [&plain](const std::vector<Function>& functions) {
    return [&plain, functions](Values x) {
      for (std::size_t k = 0; k < plain.layers.size(); ++k) {
        x = affine(plain.layers[k].weights, plain.layers[k].biases, x);
        if (k < functions.size()) x = each(functions[k], x);
      }
      return x;
    };
  };
  const Function elu = [](double t) { return t > 0 ? t : std::expm1(t); };
  const Function leaky = [](double t) { return t > 0 ? t : 0.25 * t; };
  const Function hardtanh = [](double t) { return std::fmin(std::fmax(t, -1), 1); };
  expect_function(ended, of({relu, elu, sigmoid}));
  expect_function(with_activation(plain, "gelu,silu"), of({gelu, silu}));
  expect_function(with_activation(plain, "leaky_relu:0.25,tanh"), of({leaky, tanh_of}));
  expect_function(with_activation(plain, "tanh,leaky_relu:0.25"), of({tanh_of, leaky}));
  expect_function(with_activation(plain, "tanh,relu,hardtanh"), of({tanh_of, relu, hardtanh}));
  EXPECT_EQ(with_activation(plain, "maxmin:pairs,relu").activation_names(), "maxmin:pairs, relu");
  EXPECT_EQ(with_activation(plain, "hardtanh,groupsort:4").activation_names(), "relu, groupsort:4");
}

TEST(MixedActivations, AreRefusedWithTheCountThatIsExpected) {
  const Weights plain = unstated_network({2, 6, 4, 3});
  const auto refused = [&plain](const char* text, const std::vector<std::string>& pieces) {
    return refuses([&] { with_activation(plain, text); }, pieces);
  };
  const char* const counts =
      "name one, or 2 for those between the layers, or 3 with one after the last layer";
  EXPECT_TRUE(refused("tanh,relu,relu,tanh", {"--activation", "names 4 activations for 3 layers", counts}));
  EXPECT_TRUE(refused("relu,maxmin:pairs,maxmin:pairs", {"\"fc3\" of 3 outputs, no multiple of 2"}));
  EXPECT_TRUE(refused("groupsort:4,relu", {"\"fc1\" of 6 outputs, no multiple of 4"}));
  EXPECT_THROW(with_activation(plain, "tanh,"), std::invalid_argument);
  EXPECT_TRUE(refuses(
      [] {
        with_activation(unstated_network({2, 3}), "tanh,relu");
      },
      {"names 2 activations for 1 layer: name one"}));
  Weights stated = with_activation(plain, "tanh,relu");
  EXPECT_EQ(with_activation(stated, "tanh,relu").activation_names(), "tanh, relu");
  EXPECT_TRUE(refuses([&] { with_activation(stated, "tanh"); }, {"network.toml states tanh, relu"}));
  EXPECT_TRUE(refuses([&] { with_activation(stated, "relu,tanh"); }, {"network.toml states tanh, relu"}));
  stated.order_source = OrderSource::kFile;
  stated.activation_source = ActivationSource::kFile;
  EXPECT_TRUE(refuses([&] { with_activation(stated, "tanh"); }, {"the file itself states tanh, relu"}));
}

TEST(MixedActivations, AnIdentityLayerGetsANameThatIsFree) {
  Weights plain = unstated_network({2, 4, 3});
  plain.layers[0].name = "layer3";
  EXPECT_EQ(with_activation(plain, "relu,tanh").layers.back().name, "layer3_layer3");
}

TEST(MixedActivations, RoundedWeightsCountTimesTheSteepestSlopeOfEachLayer) {
  Weights weights = unstated_network({2, 6, 4, 3});
  weights.layers[1].weight_rounding = 1e-12;
  const double with_relu = rounding_of_slope(weights);
  weights.set_activations({Activation::kSigmoid, Activation::kRelu});
  EXPECT_NEAR(rounding_of_slope(weights), with_relu / 4, 1e-6 * with_relu);
  weights.set_activations({Activation::kRelu, Activation::kSigmoid});
  EXPECT_NEAR(rounding_of_slope(weights), with_relu / 4, 1e-6 * with_relu);
  EXPECT_THROW(weights.set_activations({Activation::kRelu}), std::invalid_argument);
  // Each copy of a duplicated layer counts: hardtanh before and after it.
  const Weights doubled = with_activation(unstated_network({2, 6, 4, 3}), "hardtanh,tanh");
  EXPECT_EQ(doubled.layers[0].weight_rounding + doubled.layers[2].weight_rounding, 0);
  Weights rounded = unstated_network({2, 6, 4, 3});
  for (Layer& layer : rounded.layers) layer.weight_rounding = 1e-12;
  const Weights copied = with_activation(rounded, "hardtanh,tanh");
  EXPECT_NEAR(copied.layers[0].weight_rounding, std::sqrt(2.0) * 1e-12, 1e-16);
  EXPECT_NEAR(copied.layers[1].weight_rounding, std::sqrt(2.0) * 1e-12, 1e-16);
  EXPECT_NEAR(copied.layers[2].weight_rounding, 1e-12, 1e-16);
}

Network with_line(const std::string& line) {
  const std::string text = "schema = \"swarmcert/network/1\"\n[phi.small]\nweights = \"phi\"\n" + line +
                           "\n[rho.small]\nweights = \"rho\"\n";
  return parse_network(text, "network.toml", [](const std::string& path, const LayerChoice&) {
    return path == "phi" ? unstated_network({2, 6, 5, 1}) : unstated_network({1, 3, 1});
  });
}

TEST(MixedActivations, OfNetworkTomlAreANameOrAList) {
  EXPECT_EQ(with_line("activation = [\"relu\", \"tanh\"]").phi.at("small").activation_names(), "relu, tanh");
  EXPECT_EQ(with_line("activation = [\"tanh\"]").phi.at("small").activation_names(), "tanh");
  const Network ended = with_line("activation = [\"relu\", \"relu\", \"sigmoid\"]");
  EXPECT_EQ(chain_words(chain(ended, "phi:small")), "fc1 - ReLU - fc2 - ReLU - fc3 - sigmoid - layer4");
  EXPECT_TRUE(ended.rho.at("small").is_relu());
  EXPECT_TRUE(refuses([] { with_line("activation = [\"relu\", \"relu\", \"relu\", \"tanh\"]"); },
                      {"network.toml: line 4", "activation", "names 4 activations for 3 layers"}));
  EXPECT_TRUE(refuses([] { with_line("activation = [\"relu\", \"hardtanh\"]"); },
                      {"network.toml: line 4", "\"hardtanh\"", "must be one of relu, tanh"}));
  EXPECT_TRUE(refuses([] { with_line("activation = []"); }, {"network.toml: line 4", "is empty"}));
  EXPECT_TRUE(
      refuses([] { require_relu(with_line("activation = [\"relu\", \"tanh\"]"), "this is for ReLU"); },
              {"\"relu, tanh\"", "phi:small", "this is for ReLU"}));
}

}  // namespace
}  // namespace swarmcert::files
