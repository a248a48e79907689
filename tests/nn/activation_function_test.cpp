/// Activations: slopes are within the assumed bounds, and values agree with the formulas.
#include "nn/weights/activation_function.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "nn/base/file_io.h"
#include "nn/weights/activation.h"
#include "nn/weights/network.h"
#include "nn/weights/safetensors.h"
#include "nn/weights/samples.h"
#include "random_network.h"
#include "refusal.h"
#include "temp_folder.h"

namespace swarmcert::files {
namespace {

using tests::refuses;

/// The formulas in the certificate's statement, in long double.
struct Formula {
  Activation activation;
  std::function<long double(long double)> value;
};

const std::vector<Formula>& formulas() {
  static const std::vector<Formula> made = {
      {Activation::kRelu, [](long double t) { return std::fmax(0.0L, t); }},
      {Activation::kTanh, [](long double t) { return std::tanh(t); }},
      {Activation::kSigmoid, [](long double t) { return 1 / (1 + std::exp(-t)); }},
      {Activation::kSoftplus,
       [](long double t) { return t > 40 ? t + std::exp(-t) : std::log1p(std::exp(t)); }},
      {Activation::kElu, [](long double t) { return std::fmax(0.0L, t) + std::fmin(0.0L, std::expm1(t)); }},
      {Activation::kSelu,
       [](long double t) {
         return 1.0507009873554805L * std::fmax(0.0L, t) +
                1.0507009873554805L * 1.6732632423543772L * std::fmin(0.0L, std::expm1(t));
       }},
      {Activation::kSilu, [](long double t) { return t / (1 + std::exp(-t)); }},
      {Activation::kGelu, [](long double t) { return t / 2 * std::erfc(-t / std::sqrt(2.0L)); }}};
  return made;
}

/// Returns pairs at all distances around every point where a slope is extreme, 0 from both sides, the extrema of SiLU
/// (2.3994) and GELU (sqrt 2), and far out; and random pairs.
std::vector<std::pair<long double, long double>> pairs() {
  std::mt19937 generator(5);
  std::vector<std::pair<long double, long double>> result;
  const auto random = [&generator] { return static_cast<long double>(tests::random_number(generator)); };
  const long double centres[] = {0, 2.3994L, -2.3994L, std::sqrt(2.0L), -std::sqrt(2.0L), 30, -30, 600, -600};
  for (int i = 0; i < 100000; ++i) {
    const long double width = std::exp2(static_cast<long double>(generator() % 20) - 16);
    const long double t = i % 2 == 0 ? centres[generator() % 9] + width * random() : 20 * random();
    const long double u = t + width * (i % 3 == 0 ? 1 : i % 3 == 1 ? -1 : random());
    if (std::fabs(t - u) > 1e-6L) result.emplace_back(t, u);
  }
  return result;
}

TEST(ActivationFunction, EveryDifferenceQuotientLiesBetweenTheSlopesAndTheSteepestAreReached) {
  constexpr long double kRounding = 1e-11L;  // for values up to 2000 with arguments 1e-6 apart
  const auto tried = pairs();
  ASSERT_GT(tried.size(), 90000u);
  for (const Formula& formula : formulas()) {
    const ActivationFunction& function = function_of(formula.activation);
    long double least = 1, greatest = 0;
    for (const auto& [t, u] : tried) {
      const long double quotient = (formula.value(t) - formula.value(u)) / (t - u);
      least = std::fmin(least, quotient);
      greatest = std::fmax(greatest, quotient);
    }
    EXPECT_LE(greatest, function.greatest_slope + kRounding) << function.op;
    EXPECT_GE(greatest, 0.99L * function.greatest_slope) << function.op;
    EXPECT_GE(least, function.least_slope - kRounding) << function.op;
    EXPECT_LE(least, 0.99L * function.least_slope + 1e-3L) << function.op;
    EXPECT_EQ(function.is_monotone(), least >= -kRounding) << function.op;
    EXPECT_EQ(function.steepest(), function.greatest_slope) << function.op;
  }
}

TEST(ActivationFunction, TheSlopeOfSeluIsTheProductOfItsConstantsRoundedUp) {
  const long double product = 1.0507009873554805L * 1.6732632423543772L;  // to 2^-64
  const auto excess = function_of(Activation::kSelu).greatest_slope - product;
  EXPECT_GT(excess, 1e-18L);
  EXPECT_LT(excess, 0x1p-52L - 1e-18L);
}

TEST(ActivationFunction, ValuesAreThoseOfTheFormulasAndDoNotOverflow) {
  for (const Formula& formula : formulas()) {
    const ActivationFunction& function = function_of(formula.activation);
    for (const double t : {-800.0, -40.0, -3.0, -0.7, -1e-9, 0.0, 1e-9, 0.3, 1.5, 20.0, 50.0, 800.0}) {
      const auto expected = static_cast<double>(formula.value(t));
      EXPECT_NEAR(function.value(t), expected, 1e-15 + 4e-15 * std::fabs(expected))
          << function.op << " " << t;
    }
    EXPECT_EQ(activation_called(function.op), formula.activation);
  }
  EXPECT_FALSE(activation_called("mish"));
}

/// Returns a network of two inputs and one output whose file states neither order nor activation.
Weights unstated() {
  std::mt19937 generator(3);
  Weights weights = tests::random_network({2, 6, 5, 1}, generator);
  weights.order_source = OrderSource::kNames;
  weights.activation_source = ActivationSource::kDefault;
  return weights;
}

TEST(SmoothActivation, IsWhatTheEvaluatorInDoubleApplies) {
  for (const Formula& formula : formulas()) {
    const ActivationFunction& function = function_of(formula.activation);
    const Weights weights = with_activation(unstated(), function.op);
    EXPECT_EQ(weights.activation_names(), function.op);
    std::vector<double> h = {0.7, -1.2};
    const double y = Evaluator<double>(weights)(h)[0];
    for (const Layer& layer : weights.layers) {
      std::vector<double> next = layer.biases;
      for (std::size_t i = 0; i < next.size(); ++i)
        for (std::size_t j = 0; j < h.size(); ++j) next[i] += layer.weights[i * h.size() + j] * h[j];
      if (&layer != &weights.layers.back())
        for (double& value : next) value = static_cast<double>(formula.value(value));
      h = next;
    }
    EXPECT_NEAR(y, h[0], 1e-13) << function.op;
    if (formula.activation == Activation::kRelu) continue;
    EXPECT_TRUE(refuses([&] { Evaluator<float>{weights}; }, {"float32", function.op}));
    EXPECT_TRUE(refuses([&] { safetensors_bytes(weights); }, {"activation", function.op}));
    EXPECT_THROW(Evaluator<double>(weights).mlp(), std::logic_error);
  }
}

TEST(SmoothActivation, SamplesRefuseEveryOtherActivation) {
  const std::vector<const char*> all = {"relu", "tanh", "sigmoid", "softplus", "elu", "selu", "silu", "gelu"};
  int refused = 0;
  for (const char* const trained : all) {
    const Evaluator<double> f(with_activation(unstated(), trained));
    Samples samples{"recorded", "", 2, 1, {}, {}, {}};
    for (int i = 0; i < 20; ++i) {
      const std::vector<double> x = {std::sin(i), std::cos(2 * i)};
      samples.x.insert(samples.x.end(), x.begin(), x.end());
      samples.y.push_back(f(x)[0]);
    }
    for (const char* const read_as : all) {
      Network network;
      network.plain = with_activation(unstated(), read_as);
      if (read_as == trained) {
        EXPECT_LE(hold_against(network, "network", samples).largest_deviation, 1e-15);
        continue;
      }
      EXPECT_TRUE(refuses([&] { hold_against(network, "network", samples); }, {"recorded", "--activation"}))
          << trained << " read as " << read_as;
      ++refused;
    }
  }
  EXPECT_EQ(refused, 56);
}

TEST(SmoothActivation, IsRefusedWhereTheFileStatesAnotherOne) {
  Weights stated = unstated();
  stated.order_source = OrderSource::kFile;
  stated.activation_source = ActivationSource::kFile;
  EXPECT_TRUE(
      refuses([&] { with_activation(stated, "tanh"); }, {"--activation", "the file itself states relu"}));
  EXPECT_TRUE(with_activation(stated, "relu").is_relu());
  const Weights given = with_activation(unstated(), "tanh");
  EXPECT_TRUE(given.states_activation());
  EXPECT_EQ(with_activation(given, "tanh").activation_names(), "tanh");
  EXPECT_TRUE(refuses([&] { with_activation(given, "elu"); }, {"network.toml states tanh"}));
  EXPECT_TRUE(refuses([&] { with_activation(given, "relu6"); }, {"network.toml states tanh"}));
}

TEST(SmoothActivation, RoundedWeightsCountTimesTheSteepestSlopes) {
  Weights weights = unstated();
  weights.layers[0].weight_rounding = 1e-12;
  const double with_relu = rounding_of_slope(weights);
  tests::set_activation(weights, Activation::kSigmoid);  // two sigmoids: 1/16
  EXPECT_NEAR(rounding_of_slope(weights), with_relu / 16, 1e-6 * with_relu);
  tests::set_activation(weights, Activation::kSilu);
  EXPECT_GT(rounding_of_slope(weights), with_relu * 1.2);
}

constexpr char kPair[] = R"(schema = "swarmcert/network/1"
[phi.small]
weights = "phi"
activation = "tanh"
[rho.small]
weights = "rho"
activation = "sigmoid"
)";

/// Returns phi 2-6-5-1 and rho 1-3-1, whose files state no activation unless `source` is kFile.
Network pair(const std::string& text, OrderSource source = OrderSource::kNames) {
  return parse_network(text, "network.toml", [source](const std::string& path, const LayerChoice&) {
    std::mt19937 generator(4);
    Weights weights = path == "phi" ? unstated() : tests::random_network({1, 3, 1}, generator);
    weights.order_source = source;
    weights.activation_source =
        source == OrderSource::kFile ? ActivationSource::kFile : ActivationSource::kDefault;
    return weights;
  });
}

TEST(SmoothActivation, NetworkTomlStatesItForEachPart) {
  const Network network = pair(kPair);
  EXPECT_EQ(network.phi.at("small").activation_names(), "tanh");
  EXPECT_EQ(network.rho.at("small").activation_names(), "sigmoid");
  EXPECT_FALSE(is_relu(network, "set:small:small"));
  EXPECT_TRUE(refuses([&] { require_relu(network, "this is for ReLU"); },
                      {"\"tanh\"", "phi:small", "this is for ReLU"}));
  EXPECT_TRUE(refuses([] { pair(kPair, OrderSource::kFile); },
                      {"network.toml: line 4", "activation", "the file itself states relu"}));
  std::string text = kPair;
  text.replace(text.find("tanh"), 4, "mish");
  EXPECT_TRUE(refuses([&] { pair(text); }, {"network.toml: line 4", "\"mish\"", "silu"}));
}

TEST(SmoothActivation, IsReadForBoundsOnly) {
  const tests::TempFolder folder;
  Weights weights = unstated();
  save_safetensors(weights, folder / "net.safetensors", true);  // states the order, and thus ReLU
  NetworkArguments arguments;
  arguments.file = folder / "net.safetensors";
  arguments.activation = "tanh";
  EXPECT_TRUE(refuses([&] { load_any_network(arguments); }, {"the file itself states relu"}));
  // Neither .npz nor C source states the order. Simulated here with the same safetensors without their order.
  std::string bytes = read_file(arguments.file);
  const std::size_t at = bytes.find("swarmcert.layers");
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, 16, "not.swarmcert.ly");
  write_file(arguments.file, bytes, true);
  EXPECT_EQ(load_any_network(arguments).plain->activation_names(), "tanh");
  EXPECT_TRUE(refuses([&] { load_network(arguments); }, {"\"tanh\"", "ReLU networks"}));
  arguments.activation = "";
  EXPECT_TRUE(load_network(arguments).plain->is_relu());
}

}  // namespace
}  // namespace swarmcert::files
