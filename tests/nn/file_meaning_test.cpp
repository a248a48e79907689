/// What a weight file means is decided by what it says: several networks in one file, tied tensors, gaps, policies,
/// objects beside the tensors, numbers in other files.
#include <gtest/gtest.h>

#include "nn/base/file_io.h"
#include "nn/weights/activation.h"
#include "nn/weights/layer_choice.h"
#include "nn/weights/layer_names.h"
#include "nn/weights/weights.h"
#include "onnx_writer.h"
#include "pth_writer.h"
#include "refusal.h"
#include "temp_folder.h"

namespace swarmcert::files {
namespace {

using namespace tests;

/// Layers "<name>.weight" [outputs x inputs] of float32, weights 1, 2, 3, ..., without biases.
struct Shape {
  std::string name;
  std::int64_t outputs, inputs;
};

std::string state_dict_of(const std::vector<Shape>& layers, const std::vector<TensorSpec>& more = {},
                          Storages storages = {}) {
  std::vector<TensorSpec> tensors;
  for (const Shape& layer : layers) {
    const std::int64_t count = layer.outputs * layer.inputs;
    tensors.push_back(
        {layer.name + ".weight", layer.name, count, {layer.outputs, layer.inputs}, {layer.inputs, 1}});
    std::vector<float> numbers;
    for (std::int64_t k = 0; k < count; ++k) numbers.push_back(static_cast<float>(k + 1));
    storages.emplace_back(layer.name, raw_numbers(numbers));
  }
  tensors.insert(tensors.end(), more.begin(), more.end());
  return zip_file(tensors, storages);
}

const std::vector<Shape> kActorCritic = {
    {"actor.0", 5, 2}, {"actor.2", 2, 5}, {"critic.0", 3, 2}, {"critic.2", 1, 3}};

LayerChoice selected(const std::vector<std::string>& prefixes) {
  LayerChoice choice;
  choice.select = prefixes;
  return choice;
}

std::string names_of(const Weights& weights) {
  std::string names;
  for (const Layer& layer : weights.layers) names += (names.empty() ? "" : ",") + layer.name;
  return names;
}

TEST(FileMeaning, NetworksOfSeveralModulesAreNotChainedThoughTheirShapesFit) {
  const std::string bytes = state_dict_of(kActorCritic);
  EXPECT_TRUE(refuses([&] { parse_weights(bytes, "net.pth"); },
                      {"several modules", "\"actor\", \"critic\"", "--select actor or --select critic"}));
  const Weights actor = parse_weights(bytes, "net.pth", "", selected({"actor"}));
  EXPECT_EQ(names_of(actor), "actor.0,actor.2");
  EXPECT_EQ(actor.unused.size(), 2u);
  EXPECT_TRUE(actor.assumed.empty());
  EXPECT_EQ(names_of(parse_weights(bytes, "net.pth", "", {"critic.0", "critic.2"})), "critic.0,critic.2");
  EXPECT_EQ(names_of(parse_weights(bytes, "net.pth", "", selected({"actor", "critic"}))),
            "actor.0,actor.2,critic.0,critic.2");
  EXPECT_TRUE(
      refuses([&] { parse_weights(bytes, "net.pth", "", {"actor.0"}); }, {"\"actor.2\"", "left out"}));
  EXPECT_TRUE(refuses([&] { parse_weights(bytes, "net.pth", "", selected({"act"})); },
                      {"--select", "actor, critic"}));
}

TEST(FileMeaning, StemsWithNumbersOfTheirOwnAreSeveralNetworks) {
  EXPECT_TRUE(refuses(
      [] {
        parse_weights(
            state_dict_of(
                {{"actor_fc1", 5, 2}, {"actor_fc2", 2, 5}, {"critic_fc1", 3, 2}, {"critic_fc2", 1, 3}}),
            "net.pth");
      },
      {"several modules", "--select actor_fc"}));
  EXPECT_EQ(modules_of({"fc1", "fc2", "out"}), std::vector<std::string>{""});
  EXPECT_EQ(modules_of({"net.layers.0.fc", "net.layers.1.fc"}).size(), 1u);
  EXPECT_EQ(modules_of({"mlp.0", "mlp.2", "head"}), (std::vector<std::string>{"mlp", "head"}));
}

TEST(FileMeaning, GuessedOrdersAndGapsAreAssumed) {
  const auto assumed = [](const std::vector<Shape>& layers) {
    return parse_weights(state_dict_of(layers), "net.pth").assumed.size();
  };
  EXPECT_EQ(assumed({{"0", 3, 2}, {"2", 3, 3}, {"4", 1, 3}}), 0u);
  EXPECT_EQ(assumed({{"fc1", 3, 2}, {"fc2", 1, 3}}), 0u);
  EXPECT_EQ(assumed({{"0", 3, 2}, {"2", 3, 3}, {"6", 1, 3}}), 1u);
  EXPECT_EQ(assumed({{"fc2", 3, 2}, {"fc3", 1, 3}}), 1u);
  EXPECT_EQ(assumed({{"hidden", 3, 2}, {"output", 1, 3}}), 1u);
  EXPECT_EQ(assumed({{"q1.0", 1, 1}, {"q2.0", 1, 1}}), 0u);
  EXPECT_EQ(assumed({{"q1.0", 1, 1}, {"q1.2", 1, 1}, {"q2.0", 1, 1}, {"q2.2", 1, 1}}), 1u);
  EXPECT_TRUE(
      parse_weights(state_dict_of({{"0", 3, 2}, {"6", 1, 3}}), "net.pth", "", {"0", "6"}).assumed.empty());
}

TEST(FileMeaning, TheDeviationOfAPolicyIsNamedAsUnused) {
  const std::string bytes = state_dict_of({{"actor.0", 3, 2}, {"actor.2", 1, 3}},
                                          {{"log_std", "s", 1, {1}, {1}}}, {{"s", raw_numbers<float>({0})}});
  const Weights weights = parse_weights(bytes, "net.pth");
  EXPECT_EQ(weights.layers.size(), 2u);
  ASSERT_EQ(weights.unused.size(), 1u);
  EXPECT_EQ(weights.unused[0].substr(0, 8), "log_std:");
}

/// A policy and its values, with one more tensor.
std::string policy_with(const std::string& name) {
  return state_dict_of({{"actor.0", 3, 2}, {"actor.2", 1, 3}, {"critic.0", 1, 2}},
                       {{name, "s", 1, {1, 1}, {1, 1}}}, {{"s", raw_numbers<float>({0})}});
}

TEST(FileMeaning, DeviationsAreKnownByAWordOfTheirName) {
  for (const char* name : {"actor_logstd", "std", "actor.sigma_param", "actor.log_std_parameter", "sigma"})
    EXPECT_TRUE(refuses([&] { parse_weights(policy_with(name), "net.pth"); },
                        {"holds layers of several modules", "--select actor"}))
        << name;
}

TEST(FileMeaning, ATensorOfNoLayerPointsToWhatLeavesItOut) {
  const std::string policy = policy_with("action_scale");
  EXPECT_TRUE(refuses([&] { parse_weights(policy, "net.pth"); },
                      {"action_scale", "--select and one of actor, critic"}));
  EXPECT_EQ(names_of(parse_weights(policy, "net.pth", "", {"actor.0", "actor.2"})), "actor.0,actor.2");
  const std::string flat =
      state_dict_of({{"fc1", 3, 2}, {"fc_mean", 1, 3}, {"fc_logstd", 1, 3}},
                    {{"action_scale", "s", 1, {1, 1}, {1, 1}}}, {{"s", raw_numbers<float>({1})}});
  EXPECT_TRUE(refuses([&] { parse_weights(flat, "net.pth"); }, {"action_scale", "fc1, fc_mean, fc_logstd"}));
  EXPECT_EQ(names_of(parse_weights(flat, "net.pth", "", selected({"fc1", "fc_mean"}))), "fc1,fc_mean");
}

TEST(FileMeaning, AnStdBesideAMeanIsNoDeviation) {
  const std::string bytes = state_dict_of({{"0", 3, 2}, {"2", 1, 3}},
                                          {{"obs_std", "s", 1, {1}, {1}}, {"obs_mean", "m", 1, {1}, {1}}},
                                          {{"s", raw_numbers<float>({1})}, {"m", raw_numbers<float>({0})}});
  EXPECT_TRUE(refuses([&] { parse_weights(bytes, "net.pth"); }, {"obs_std"}));
}

std::string safetensors(const std::string& header, const std::vector<float>& numbers) {
  return little_endian(header.size(), 8) + header + raw_numbers(numbers);
}

TEST(FileMeaning, TiedTensorsAreReadFromTheMetadata) {
  const std::string layers = R"(,"0.weight":{"dtype":"F32","shape":[1,1],"data_offsets":[0,4]},)"
                             R"("2.weight":{"dtype":"F32","shape":[1,1],"data_offsets":[4,8]},)"
                             R"("6.weight":{"dtype":"F32","shape":[1,1],"data_offsets":[8,12]}})";
  const Weights weights = parse_weights(
      safetensors(R"({"__metadata__":{"format":"pt","4.weight":"2.weight"})" + layers, {1, 5, 7}),
      "net.safetensors");
  EXPECT_EQ(names_of(weights), "0,2,4,6");
  EXPECT_EQ(weights.layers[2].weights, std::vector<double>{5});
  EXPECT_TRUE(weights.assumed.empty());
  EXPECT_TRUE(refuses(
      [&] {
        parse_weights(safetensors(R"({"__metadata__":{"4.weight":"3.weight"})" + layers, {1, 5, 7}),
                      "net.safetensors");
      },
      {"4.weight", "tied", "no such tensor"}));
  const Weights stated = parse_weights(
      safetensors(R"({"__metadata__":{"activation":"tanh","4.weight":"2.weight"})" + layers, {1, 5, 7}),
      "net");
  EXPECT_EQ(stated.activation_names(), "tanh");
  EXPECT_TRUE(refuses([&] { with_activation(stated, "relu"); }, {"the file itself states tanh"}));
}

TEST(FileMeaning, ObjectsBesideTheStateDictArePassedOverAndOtherTypesRefused) {
  const auto checkpoint = [](const std::string& object) {
    const std::string ops =
        "}(" + text_op("args") + object + text_op("state_dict") + state_dict_op(small_tensors(), false) + "u";
    return zip_file(pickle(ops), small_storages<float>());
  };
  const std::string settings =
      "}(" + text_op("lr") + std::string("G\x3f\x50\x62\x4d\xd2\xf1\xa9\xfc", 9) + "u";
  const Weights weights =
      parse_weights(checkpoint(global_op("argparse", "Namespace") + ")\x81" + settings + "b"), "net.pth");
  EXPECT_EQ(weights.layers.size(), 2u);
  EXPECT_EQ(
      parse_weights(checkpoint(global_op("pathlib", "PosixPath") + text_op("runs") + "\x85R"), "net.pth")
          .layers.size(),
      2u);
  const std::string counts = "}(" + text_op("milestones") + integer_op(3) + "u\x85R";
  EXPECT_EQ(parse_weights(checkpoint(global_op("collections", "Counter") + counts), "net.pth").layers.size(),
            2u);
  const std::string generator = "\x8a\x10" + std::string(16, '\1');  // 128 bits of a random generator
  EXPECT_EQ(parse_weights(checkpoint(generator), "net.pth").layers.size(), 2u);
  EXPECT_TRUE(refuses(
      [&] { parse_weights(checkpoint(global_op("os", "system") + text_op("true") + "\x85R"), "net.pth"); },
      {"os.system", "nothing was executed"}));
}

TEST(FileMeaning, ADictionaryOfNumpyArraysIsAStateDict) {
  const auto array = [](const std::vector<std::int64_t>& shape, const std::vector<float>& numbers) {
    const std::string raw = raw_numbers(numbers);
    return global_op("numpy.core.multiarray", "_reconstruct") + global_op("numpy", "ndarray") +
           integer_op(0) + "\x85" + "C\x01" + "b\x87R(" + integer_op(1) + tuple_op(shape) +
           global_op("numpy", "dtype") + text_op("f4") + "\x89\x88\x87R(" + integer_op(3) + text_op("<") +
           "NNN" + integer_op(-1) + integer_op(-1) + integer_op(0) + "tb\x89" + "C" +
           little_endian(raw.size(), 1) + raw + "tb";
  };
  const std::string ops = "}(" + text_op("fc1.weight") + array({2, 1}, {3, 4}) + text_op("fc1.bias") +
                          array({2}, {5, 6}) + text_op("fc2.weight") + array({1, 2}, {7, 8}) + "u";
  const Weights weights = parse_weights(zip_file(pickle(ops), {}), "net.pth");
  ASSERT_EQ(weights.layers.size(), 2u);
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{3, 4}));
  EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{5, 6}));
  EXPECT_EQ(weights.layers[1].weights, (std::vector<double>{7, 8}));
}

TEST(FileMeaning, SpectralNormWithoutVTakesTheStoredWeight) {
  const Storages storages = {
      {"o", raw_numbers<float>({2, 4})}, {"w", raw_numbers<float>({1, 2})}, {"u", raw_numbers<float>({1})}};
  const std::vector<TensorSpec> tensors = {{"fc1.weight_orig", "o", 2, {1, 2}, {2, 1}},
                                           {"fc1.weight", "w", 2, {1, 2}, {2, 1}},
                                           {"fc1.weight_u", "u", 1, {1}, {1}}};
  const Weights weights = parse_weights(zip_file(tensors, storages), "net.pth");
  EXPECT_EQ(weights.layers.at(0).weights, (std::vector<double>{1, 2}));
  EXPECT_EQ(weights.unused.size(), 2u);
}

TEST(FileMeaning, PoliciesOfStableBaselinesNeedASelectionAndHaveTheirActivations) {
  const std::string policy = state_dict_of({{"mlp_extractor.policy_net.0", 3, 2},
                                            {"mlp_extractor.policy_net.2", 3, 3},
                                            {"mlp_extractor.value_net.0", 3, 2},
                                            {"action_net", 1, 3},
                                            {"value_net", 1, 3}});
  const auto archive = [&policy](const std::string& settings) {
    const std::string data = R"({"policy_class":{"__module__":"stable_baselines3.common.policies"},)"
                             R"("policy_kwargs":{)" +
                             settings + "}}";
    return zip({{"data", data}, {"policy.pth", policy}, {"system_info.txt", "x"}});
  };
  EXPECT_TRUE(refuses([&] { parse_weights(archive(""), "ppo.zip"); }, {"--select policy or --select value"}));
  const Weights actor = parse_weights(archive(""), "ppo.zip", "", selected({"policy"}));
  EXPECT_EQ(names_of(actor), "mlp_extractor.policy_net.0,mlp_extractor.policy_net.2,action_net");
  EXPECT_EQ(actor.activation_names(), "tanh");
  const std::string relu = R"("activation_fn":"<class 'torch.nn.modules.activation.ReLU'>")";
  EXPECT_TRUE(parse_weights(archive(relu), "ppo.zip", "", selected({"value"})).is_relu());
}

TEST(FileMeaning, AModuleThatTheMetadataListBehindTheLastLayerIsAssumedToBeNothingUntilItIsStated) {
  const std::vector<std::string> modules = {"", "0", "1", "2", "3"};
  const auto sequential = [&modules](std::size_t count) {
    std::string metadata = "}" + text_op("_metadata") + ordered_dict_op({});
    for (std::size_t k = 0; k < count; ++k)
      metadata += text_op(modules[k]) + "}" + text_op("version") + "K\1ss";
    const std::vector<TensorSpec> tensors = {{"0.weight", "a", 4, {2, 2}, {2, 1}},
                                             {"2.weight", "b", 2, {1, 2}, {2, 1}}};
    return zip_file(
        pickle(state_dict_op(tensors, false) + metadata + "sb"),
        {{"a", raw_numbers(std::vector<float>{1, 2, 3, 4})}, {"b", raw_numbers(std::vector<float>{1, 2})}});
  };
  EXPECT_TRUE(parse_weights(sequential(4), "net.pth").assumed.empty());
  const Weights guessed = parse_weights(sequential(5), "net.pth");
  ASSERT_EQ(guessed.assumed.size(), 1u);
  EXPECT_NE(guessed.assumed[0].find("the module \"3\""), std::string::npos) << guessed.assumed[0];
  EXPECT_FALSE(with_activation(guessed, "tanh").assumed.empty()) << "one name is what lies between layers";
  EXPECT_TRUE(with_activation(guessed, "tanh,tanh").assumed.empty());
  EXPECT_TRUE(with_activation(guessed, "relu,linear").assumed.empty());
}

TEST(FileMeaning, ActivationsAreNamedOnceWhereAllAreAlike) {
  const Weights weights = with_activation(
      parse_weights(state_dict_of({{"0", 3, 2}, {"2", 3, 3}, {"4", 1, 3}}), "net.pth"), "relu6");
  EXPECT_EQ(weights.notes.back(), "piecewise linear activations of relu6 are written with ReLU");
}

TEST(FileMeaning, NormsAreThoseOfTheStoredMatrices) {
  Weights weights = parse_weights(small_zip(), "small.pth");
  const std::vector<double> stored = weights.layers[0].weights;
  for (const char* const activation : {"hardtanh", "relu6", "leaky_relu"}) {
    const Weights written = with_activation(weights, activation);
    EXPECT_NE(written.layers[0].weights, stored);
    EXPECT_EQ(written.stored_layers()[0].weights, stored) << activation;
  }
  EXPECT_TRUE(with_activation(weights, "tanh").stored.empty());
}

TEST(FileMeaning, LayersWithoutAnActivationBetweenThemAreFoldedExactly) {
  const Weights weights = with_activation(parse_weights(small_zip(), "small.pth"), "linear");
  ASSERT_EQ(weights.layers.size(), 1u);
  // [1, 2, -3] [[1, -2], [0.5, 3], [-0.25, 4]] and [1, 2, -3] [0.125, 0, -1] + 0.75.
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{2.75, -8}));
  EXPECT_EQ(weights.layers[0].biases, std::vector<double>{3.875});
}

TEST(FileMeaning, ExternalDataOfOnnxAreReadAndBoundByTheirHash) {
  TempFolder folder;
  const auto model = [](const std::string& location, const std::string& offset) {
    const auto entry = [](const std::string& key, const std::string& value) {
      return onnx_text(13, onnx_text(1, key) + onnx_text(2, value));
    };
    OnnxModel made;
    made.nodes = {onnx_node("MatMul", {"x", "w"}, {"y"})};
    made.tensors = {onnx_tensor("w", {2, 1}, 1,
                                entry("location", location) + entry("offset", offset) + entry("length", "8") +
                                    onnx_varint_field(14, 1))};
    made.shape = {1, 2};
    return made.bytes();
  };
  const std::string numbers = raw_numbers<float>({9, 3, 4});
  write_file(folder / "net.onnx.data", numbers, false);
  const Weights weights = parse_weights(model("net.onnx.data", "4"), folder / "net.onnx");
  EXPECT_EQ(weights.layers.at(0).weights, (std::vector<double>{3, 4}));
  ASSERT_EQ(weights.data_files.size(), 1u);
  EXPECT_EQ(weights.data_files[0].second, sha256(numbers));
  EXPECT_TRUE(
      refuses([&] { parse_weights(model("net.onnx.data", "8"), folder / "net.onnx"); }, {"beyond the end"}));
  EXPECT_TRUE(refuses([&] { parse_weights(model("../net.data", "0"), folder / "net.onnx"); },
                      {"outside the folder"}));
}

}  // namespace
}  // namespace swarmcert::files
