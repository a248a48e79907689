/// State dicts that must load, in every form written by torch.save.
#include <gtest/gtest.h>

#include "nn/base/file_io.h"
#include "nn/weights/weights.h"
#include "pth_writer.h"
#include "refusal.h"
#include "temp_folder.h"

namespace swarmcert::files {
namespace {

using namespace tests;

/// Weights and biases in small_storages().
const std::vector<double> kFirst = {1, -2, 0.5, 3, -0.25, 4};
const std::vector<double> kFirstBias = {0.125, 0, -1};
const std::vector<double> kSecond = {1, 2, -3};
const std::vector<double> kSecondBias = {0.75};

void expect_small_network(const Weights& weights) {
  ASSERT_EQ(weights.layers.size(), 2u);
  const Layer& first = weights.layers[0];
  const Layer& second = weights.layers[1];
  EXPECT_EQ(first.name, "fc1");
  EXPECT_EQ(first.outputs, 3);
  EXPECT_EQ(first.inputs, 2);
  EXPECT_EQ(first.weights, kFirst);
  EXPECT_EQ(first.biases, kFirstBias);
  EXPECT_EQ(second.name, "fc2");
  EXPECT_EQ(second.outputs, 1);
  EXPECT_EQ(second.inputs, 3);
  EXPECT_EQ(second.weights, kSecond);
  EXPECT_EQ(second.biases, kSecondBias);
  EXPECT_EQ(weights.inputs(), 2);
  EXPECT_EQ(weights.outputs(), 1);
}

TEST(Pth, ZipHoldsTheNetworkExactly) {
  const Weights weights = parse_weights(small_zip(), "small.pth");
  expect_small_network(weights);
  EXPECT_EQ(weights.precision, Precision::kFloat32);
  EXPECT_EQ(weights.path, "small.pth");
  EXPECT_EQ(weights.sha256, sha256(small_zip()));
}

TEST(Pth, LegacyHoldsTheNetworkExactly) {
  const Weights weights = parse_weights(small_legacy(), "small.pth");
  expect_small_network(weights);
  EXPECT_EQ(weights.precision, Precision::kFloat64);
}

TEST(Pth, BothContainersHoldBothPrecisions) {
  const Weights wide =
      parse_weights(zip_file(small_tensors("DoubleStorage"), small_storages<double>()), "f64");
  expect_small_network(wide);
  EXPECT_EQ(wide.precision, Precision::kFloat64);
  const Weights narrow = parse_weights(legacy_file(small_tensors(), small_storages<float>(), 4), "f32");
  expect_small_network(narrow);
  EXPECT_EQ(narrow.precision, Precision::kFloat32);
}

TEST(Pth, ParametersLoadLikeTensors) {
  std::vector<TensorSpec> tensors = small_tensors();
  for (TensorSpec& tensor : tensors) tensor.is_parameter = true;
  expect_small_network(parse_weights(zip_file(tensors, small_storages<float>()), "parameters"));
}

TEST(Pth, TransposedViewsAreReadThroughTheirStrides) {
  std::vector<TensorSpec> tensors = small_tensors();
  tensors[0].strides = {1, 3};
  Storages storages = small_storages<float>();
  storages[0].second = raw_numbers<float>({1, 0.5, -0.25, -2, 3, 4});
  expect_small_network(parse_weights(zip_file(tensors, storages), "transposed"));
}

TEST(Pth, SlicesOfOneSharedStorageAreReadThroughTheirOffsets) {
  std::vector<TensorSpec> tensors = small_tensors("DoubleStorage");
  for (TensorSpec& tensor : tensors) tensor.key = "all", tensor.elements = 20;
  tensors[0].offset = 2, tensors[0].strides = {3, 1};
  tensors[1].offset = 11, tensors[1].strides = {2};
  tensors[2].offset = 16;
  tensors[3].offset = 19;
  const Storages storages = {{"all", raw_numbers<double>({9, 9,     1, -2, 9, 0.5, 3, 9, -0.25, 4,
                                                          9, 0.125, 9, 0,  9, -1,  1, 2, -3,    0.75})}};
  expect_small_network(parse_weights(zip_file(tensors, storages), "zip"));
  expect_small_network(parse_weights(legacy_file(tensors, storages, sizeof(double)), "legacy"));
}

TEST(Pth, ALayerWithoutBiasHasZeros) {
  std::vector<TensorSpec> tensors = small_tensors();
  tensors.erase(tensors.begin() + 1);
  const Weights weights = parse_weights(zip_file(tensors, small_storages<float>()), "no bias");
  EXPECT_EQ(weights.layers[0].biases, std::vector<double>(3, 0.0));
  EXPECT_EQ(weights.layers[1].biases, kSecondBias);
}

TEST(Pth, ABareLinearLayerNeedsNoName) {
  const std::vector<TensorSpec> tensors = {{"weight", "2", 3, {1, 3}, {3, 1}}, {"bias", "3", 1, {1}, {1}}};
  const Weights weights = parse_weights(zip_file(tensors, small_storages<float>()), "linear");
  ASSERT_EQ(weights.layers.size(), 1u);
  EXPECT_EQ(weights.layers[0].weights, kSecond);
}

TEST(Pth, LayersFollowTheFileNotTheirNames) {
  std::vector<TensorSpec> tensors = small_tensors();
  tensors[0].name = "z_input.weight";
  tensors[1].name = "z_input.bias";
  tensors[2].name = "a_output.weight";
  tensors[3].name = "a_output.bias";
  std::swap(tensors[0], tensors[1]);  // and a bias may come before its weight
  const Weights weights = parse_weights(zip_file(tensors, small_storages<float>()), "order");
  EXPECT_EQ(weights.layers[0].name, "z_input");
  EXPECT_EQ(weights.layers[1].name, "a_output");
}

TEST(Pth, PrefixesOfWrappersStayInTheNamesOfLayers) {
  std::vector<TensorSpec> tensors = small_tensors();
  for (TensorSpec& tensor : tensors)
    tensor.name = "module._orig_mod." + tensor.name;  // DataParallel, compile
  const Weights weights = parse_weights(zip_file(tensors, small_storages<float>()), "wrapped");
  EXPECT_EQ(weights.layers[0].name, "module._orig_mod.fc1");
  EXPECT_EQ(weights.layers[1].weights, kSecond);
}

TEST(Pth, ACheckpointWithItsOptimizerNamesTheStateDictsInIt) {
  // As in torch.save({"model": ..., "optimizer": ...}): the optimizer numbers its parameters.
  const std::string model = state_dict_op(small_tensors(), false);
  const std::string moments = "}" + text_op("exp_avg") + tensor_op(small_tensors()[0], false) + "s";
  const std::string optimizer = "}(" + text_op("state") + "}" + std::string("K\0", 2) + moments + "s" +
                                text_op("param_groups") + "]}" + text_op("lr") + "G" + std::string(8, '\0') +
                                "sau";
  const std::string checkpoint = "}(" + text_op("model") + model + text_op("optimizer") + optimizer + "u";
  const std::string bytes = zip_file(pickle(checkpoint), small_storages<float>());
  expect_small_network(parse_weights(bytes, "checkpoint", "model"));
  EXPECT_TRUE(refuses([&] { parse_weights(bytes, "checkpoint"); }, {"--key", "\"model\""}));
}

TEST(Pth, NestedCheckpointsAreReachedByKey) {
  const std::string state = state_dict_op(small_tensors(), false);
  const std::string checkpoint = "}(" + text_op("epoch") + "K\7" + text_op("lr") + "G" +
                                 std::string(8, '\0') + text_op("history") + "](K\1K\2e" + text_op("best") +
                                 "N" + text_op("ema") + "}" + text_op("net.v2") + state + "su";
  const std::string bytes = zip_file(pickle(checkpoint), small_storages<float>());
  expect_small_network(parse_weights(bytes, "nested", "ema.net.v2"));
  EXPECT_TRUE(refuses([&] { parse_weights(bytes, "nested"); }, {"nested: ", "--key", "\"ema.net.v2\""}));
  EXPECT_TRUE(refuses([&] { parse_weights(bytes, "nested", "ema.net.v3"); },
                      {"\"ema.net.v3\"", "no such key", "did you mean \"ema.net.v2\"?"}));
  EXPECT_TRUE(
      refuses([&] { parse_weights(bytes, "nested", "zzz"); }, {"no such key", "--key", "\"ema.net.v2\""}));
  EXPECT_TRUE(
      refuses([&] { parse_weights(bytes, "nested", "epoch"); }, {"epoch = an integer", "not a state dict"}));
  EXPECT_TRUE(refuses([&] { parse_weights(bytes, "nested", "epoch.x"); }, {"no such key"}));
}

TEST(Pth, LegacyStoragesOfOtherTypesBesideTheNetworkAreSkipped) {
  // An optimizer's integer counter, whose raw data are stored between those of the network.
  const TensorSpec counter = {"", "step", 2, {2}, {1}, 0, "LongStorage"};
  const std::string checkpoint = "}(" + text_op("optimizer") + tensor_op(counter, true) + text_op("model") +
                                 state_dict_op(small_tensors(), true) + "u";
  Storages storages = small_storages<float>();
  storages.insert(storages.begin() + 1, {"step", std::string(16, '\1')});
  std::string bytes = legacy_file(pickle(checkpoint), storages, sizeof(float));
  const std::string counted_as_floats = little_endian(4, 8) + std::string(16, '\1');
  bytes.replace(bytes.find(counted_as_floats), 8, little_endian(2, 8));
  expect_small_network(parse_weights(bytes, "nested", "model"));
}

TEST(Pth, StringsOfPython2AreRead) {
  std::string state = state_dict_op(small_tensors(), false);
  const std::string name = text_op("fc1.weight");
  state.replace(state.find(name), name.size(),
                "U\x0a"
                "fc1.weight");
  const std::string bias = text_op("fc1.bias");
  state.replace(state.find(bias), bias.size(), "T" + little_endian(8, 4) + "fc1.bias");
  expect_small_network(parse_weights(zip_file(pickle(state), small_storages<float>()), "python 2"));
}

TEST(Pth, MetadataAndNewerPicklesAreRead) {
  // The metadata that torch attaches to a state dict, and the opcodes of pickle protocol 4.
  const std::string metadata =
      "}" + text_op("_metadata") + "}" + text_op("") + "}" + text_op("version") + "K\1sssb";
  expect_small_network(parse_weights(
      zip_file(pickle(state_dict_op(small_tensors(), false) + metadata), small_storages<float>()),
      "metadata"));

  const auto short_text = [](const std::string& text) {
    return "\x8c" + little_endian(text.size(), 1) + text + "\x94";
  };
  const std::string state = state_dict_op(small_tensors(), false);
  const std::string classic = global_op("collections", "OrderedDict");
  std::string newer =
      short_text("collections") + short_text("OrderedDict") + "\x93\x94" + state.substr(classic.size());
  newer = "\x80\x04\x95" + little_endian(newer.size() + 1, 8) + newer + ".";
  expect_small_network(parse_weights(zip_file(newer, small_storages<float>()), "protocol 4"));
}

TEST(Pth, LittleEndianArchivesSayingSoAreRead) {
  const std::string bytes =
      zip_file(pickle(state_dict_op(small_tensors(), false)), small_storages<float>(),
               {{"archive/byteorder", "little"}, {"archive/.data/serialization_id", "1"}});
  expect_small_network(parse_weights(bytes, "byteorder"));
}

TEST(Pth, TheFormatIsFoundInTheContentNotTheName) {
  const tests::TempFolder folder;
  write_file(folder / "zip.txt", small_zip(), true);
  write_file(folder / "legacy.safetensors", small_legacy(), true);
  expect_small_network(load_weights(folder / "zip.txt"));
  expect_small_network(load_weights(folder / "legacy.safetensors"));
}

}  // namespace
}  // namespace swarmcert::files
