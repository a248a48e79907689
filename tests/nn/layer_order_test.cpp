#include "nn/weights/layer_order.h"

#include <gtest/gtest.h>

#include "nn/weights/chain.h"
#include "nn/weights/functions.h"
#include "pth_writer.h"
#include "random_network.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using tests::refuses;

/// Layers by name and [inputs, outputs], in the order in which the file lists them.
using Listed = std::vector<LayerShape>;
const Listed kSquare = {{"fc1", 2, 4}, {"fc2", 4, 4}, {"fc3", 4, 4}, {"fc4", 4, 1}};

Listed listed(const Listed& layers, const std::vector<std::size_t>& order) {
  Listed result;
  for (const std::size_t i : order) result.push_back(layers[i]);
  return result;
}

/// Returns the names in the order of evaluation.
std::string decided(const Listed& layers, Listing listing = Listing::kRegistration,
                    const std::vector<std::string>& stated = {}) {
  std::string text;
  for (const std::size_t i : decide_layer_order(layers, listing, stated, "net.pth").indices)
    text += (text.empty() ? "" : ",") + layers[i].name;
  return text;
}

OrderSource source(const Listed& layers, Listing listing = Listing::kRegistration,
                   const std::vector<std::string>& stated = {}) {
  return decide_layer_order(layers, listing, stated, "net.pth").source;
}

testing::AssertionResult order_is_refused(const Listed& layers, const std::vector<std::string>& pieces,
                                          Listing listing = Listing::kRegistration,
                                          const std::vector<std::string>& stated = {}) {
  return refuses([&] { decided(layers, listing, stated); }, pieces);
}

/// Returns a state dict of square float32 layers [2 x 2] with the given names, in the order of registration.
std::string square_state_dict(const std::vector<std::string>& names,
                              const std::vector<tests::TensorSpec>& more = {}) {
  std::vector<tests::TensorSpec> tensors;
  tests::Storages storages;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const std::string key = std::to_string(k);
    tensors.push_back({names[k] + ".weight", key, 4, {2, 2}, {2, 1}});
    storages.emplace_back(key, tests::raw_numbers<float>({1, 0, 0, static_cast<float>(k + 1)}));
  }
  tensors.insert(tensors.end(), more.begin(), more.end());
  return tests::zip_file(tensors, storages);
}

TEST(LayerOrder, NumbersInNamesThatAgreeWithTheRegistrationDecide) {
  EXPECT_EQ(decided(kSquare), "fc1,fc2,fc3,fc4");
  EXPECT_EQ(source(kSquare), OrderSource::kNames);
  EXPECT_EQ(decided({{"0", 3, 3}, {"2", 3, 3}, {"10", 3, 3}}), "0,2,10");
  EXPECT_EQ(decided({{"net.layers.0.fc", 3, 3}, {"net.layers.1.fc", 3, 3}}),
            "net.layers.0.fc,net.layers.1.fc");
}

TEST(LayerOrder, AnotherOrderOfRegistrationThanThatOfTheNamesIsRefusedWithBoth) {
  EXPECT_TRUE(order_is_refused(listed(kSquare, {0, 2, 1, 3}),
                               {"net.pth", "more than one fits", "fc1,fc3,fc2,fc4 (as registered)",
                                "fc1,fc2,fc3,fc4 (by name)", "--order", "network.toml"}));
}

TEST(LayerOrder, SquareLayersWithUnrelatedNamesAreRefused) {
  const Listed layers = {{"alpha", 3, 3}, {"beta", 3, 3}, {"gamma", 3, 3}};
  EXPECT_TRUE(order_is_refused(layers, {"alpha,beta,gamma (as registered and by name)", "alpha,gamma,beta"}));
  EXPECT_TRUE(order_is_refused(layers, {"alpha,beta,gamma (by name)"}, Listing::kUnordered));
}

TEST(LayerOrder, TheOnlyOrderThatFitsTheShapesIsTakenWhateverTheNames) {
  const Listed layers = {{"head", 5, 1}, {"stem", 2, 3}, {"body", 3, 5}};
  EXPECT_EQ(decided(layers), "stem,body,head");
  EXPECT_EQ(source(layers), OrderSource::kShapes);
}

TEST(LayerOrder, NumbersDecideBetweenTheOrdersThatTheShapesLeave) {
  EXPECT_EQ(decided({{"stem", 2, 4}, {"body1", 4, 4}, {"body2", 4, 4}, {"head", 4, 1}}),
            "stem,body1,body2,head");
  EXPECT_TRUE(order_is_refused({{"stem", 2, 4}, {"body2", 4, 4}, {"body1", 4, 4}, {"head", 4, 1}},
                               {"more than one"}));
}

TEST(LayerOrder, WithoutARegistrationTheNumbersDecide) {
  EXPECT_EQ(decided(listed(kSquare, {3, 2, 1, 0}), Listing::kUnordered), "fc1,fc2,fc3,fc4");
}

TEST(LayerOrder, AStatedOrderIsTakenAndMustNameEveryLayerOnceAndFit) {
  EXPECT_EQ(decided(kSquare, Listing::kRegistration, {"fc1", "fc3", "fc2", "fc4"}), "fc1,fc3,fc2,fc4");
  EXPECT_EQ(source(kSquare, Listing::kRegistration, {"fc1", "fc3", "fc2", "fc4"}), OrderSource::kUser);
  const auto stated_is_refused = [](const std::vector<std::string>& stated,
                                    const std::vector<std::string>& pieces) {
    return order_is_refused(kSquare, pieces, Listing::kRegistration, stated);
  };
  EXPECT_TRUE(stated_is_refused({"fc1", "fc2", "fc2", "fc4"}, {"\"fc2\"", "named twice"}));
  EXPECT_TRUE(stated_is_refused({"fc1", "fc2", "fc5", "fc4"}, {"\"fc5\"", "no such layer"}));
  EXPECT_TRUE(
      stated_is_refused({"fc4", "fc2", "fc3", "fc1"}, {"fc2.weight", "takes 4 inputs", "gives 1 outputs"}));
}

TEST(LayerOrder, AFileThatStatesItsOrderTakesNoOther) {
  EXPECT_EQ(decided(kSquare, Listing::kEvaluation, {"fc1", "fc2", "fc3", "fc4"}), "fc1,fc2,fc3,fc4");
  EXPECT_TRUE(order_is_refused(kSquare, {"itself states another order"}, Listing::kEvaluation,
                               {"fc1", "fc3", "fc2", "fc4"}));
}

TEST(LayerOrder, ManyLayersAreDecidedOrRefusedWithoutEnumeratingTheirOrders) {
  Listed layers;
  for (int k = 0; k < 1000; ++k) layers.push_back({"fc" + std::to_string(k), 8, 8});
  EXPECT_EQ(source(layers), OrderSource::kNames);
  std::swap(layers[0], layers[1]);
  EXPECT_TRUE(order_is_refused(layers, {"more than one fits"}));
  layers.resize(64);  // 64! orders
  for (LayerShape& layer : layers) layer.name = "a" + layer.name + "x" + std::to_string(layer.name.size());
  EXPECT_TRUE(order_is_refused(layers, {"more than one fits"}));
}

TEST(LayerOrder, AStateDictThatCouldBeSeveralNetworksIsRefusedUnlessTheOrderIsGiven) {
  const std::string bytes = square_state_dict({"fc3", "fc1", "fc2"});
  EXPECT_TRUE(refuses([&] { parse_weights(bytes, "net.pth"); },
                      {"net.pth", "fc3,fc1,fc2 (as registered)", "fc1,fc2,fc3 (by name)"}));
  const Weights weights = parse_weights(bytes, "net.pth", "", {"fc1", "fc2", "fc3"});
  ASSERT_EQ(weights.layers.size(), 3u);
  EXPECT_EQ(weights.layers[0].name, "fc1");
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{1, 0, 0, 2}));
  EXPECT_EQ(weights.layers[2].weights, (std::vector<double>{1, 0, 0, 1}));
  EXPECT_EQ(weights.order_source, OrderSource::kUser);
}

TEST(LayerOrder, HintsOfAnotherStructureAreRefusedWithTheReason) {
  const auto refused_with = [](const std::string& tensor, const std::vector<std::string>& pieces) {
    tests::TensorSpec more{tensor, "0", 4, {2}, {1}};
    const std::string bytes = square_state_dict({"fc1"}, {more});
    return refuses([&] { parse_weights(bytes, "net.pth"); }, pieces);
  };
  EXPECT_TRUE(refused_with("bn1.running_mean", {"bn1.running_mean", "batch normalisation", "fold it"}));
  EXPECT_TRUE(refused_with("bn1.running_var", {"bn1.running_var", "batch normalisation"}));
  EXPECT_TRUE(refused_with("rnn.weight_ih_l0", {"rnn.weight_ih_l0", "recurrent"}));
  EXPECT_TRUE(refused_with("mha.in_proj_weight", {"mha.in_proj_weight", "attention"}));
  EXPECT_TRUE(refused_with("norm.weight", {"norm.weight", "two dimensions"}));
  EXPECT_TRUE(refused_with("scale", {"scale", "neither the weight nor the bias"}));
}

TEST(Chain, NamesEveryOperationInTheOrderOfEvaluation) {
  std::mt19937 generator(1);
  Network network;
  network.plain = tests::random_network({3, 5, 2}, generator);
  EXPECT_EQ(chain_words(network), "fc1 - ReLU - fc2");
  EXPECT_EQ(chain_json(chain(network, "network")),
            Json::parse(R"([{"op":"linear","layer":"fc1","inputs":3,"outputs":5},
                            {"op":"relu","layer":null,"inputs":5,"outputs":5},
                            {"op":"linear","layer":"fc2","inputs":5,"outputs":2}])"));
}

TEST(Chain, OfADeepSetHasTheClampWhereItActs) {
  std::mt19937 generator(1);
  Network network;
  network.phi["ground"] = tests::random_network({4, 5}, generator);
  network.phi["small"] = tests::random_network({2, 5}, generator);
  network.rho["small"] = tests::random_network({5, 3, 1}, generator);
  network.clamp = InputClamp{{-1, -1}, {1, 1}};
  EXPECT_EQ(chain_words(network), "phi:ground: fc1; phi:small: clamp - fc1; rho:small: fc1 - ReLU - fc2");
  EXPECT_EQ(chain(network, "phi:small").front().op, "clamp");
}

}  // namespace
}  // namespace swarmcert::files
