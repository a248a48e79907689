#include "stability/reach/network_values.h"

#include "tests/reach/random_forms.h"

namespace swarmcert::stability {
namespace {

using files::Activation;

files::Weights random_network(files::Random& random, Activation activation) {
  files::Weights network;
  network.precision = files::Precision::kFloat64;
  const int sizes[] = {3, 10, 10, 2};
  for (int k = 0; k < 3; ++k) {
    files::Layer layer;
    layer.outputs = sizes[k + 1];
    layer.inputs = sizes[k];
    for (int i = 0; i < layer.outputs * layer.inputs; ++i) layer.weights.push_back(random.symmetric());
    for (int i = 0; i < layer.outputs; ++i) layer.biases.push_back(random.symmetric());
    layer.activation = activation;
    network.layers.push_back(layer);
  }
  return network;
}

TEST(NetworkValues, FormsContainTheOutputsAtAllPoints) {
  files::Random random(4);
  for (const Activation activation : {Activation::kSigmoid, Activation::kTanh, Activation::kRelu}) {
    for (int run = 0; run < 50; ++run) {
      const files::Weights network = random_network(random, activation);
      AffineVector x;
      for (int i = 0; i < 3; ++i) x.push_back(tests::random_form(random, 0, random.log_uniform(1e-6, 1)));
      const AffineVector y = network_values(network, x);
      ASSERT_EQ(symbols(y), 3U);
      for (int point = 0; point < 20; ++point) {
        std::vector<double> e(3), inputs;
        for (double& one : e) one = random.symmetric();
        for (const AffineForm& one : x)
          inputs.push_back(static_cast<double>(tests::middle(one, e)) +
                           0.999999 * random.symmetric() * one.radius);
        const std::vector<double> outputs = files::Evaluator<double>(network)(inputs);
        for (std::size_t i = 0; i < y.size(); ++i)
          ASSERT_TRUE(tests::contains(y[i], e, outputs[i], 1e-13)) << static_cast<int>(activation);
      }
    }
  }
}

TEST(NetworkValues, RefusesWhatItDoesNotEnclose) {
  files::Random random(5);
  EXPECT_THROW(network_values(random_network(random, Activation::kGelu), AffineVector(3)),
               std::invalid_argument);
  files::Weights network = random_network(random, Activation::kTanh);
  EXPECT_THROW(network_values(network, AffineVector(4)), std::invalid_argument);
  network.layers[1].bias_rounding = 1e-18;
  EXPECT_THROW(network_values(network, AffineVector(3)), std::invalid_argument);
}

}  // namespace
}  // namespace swarmcert::stability
