/// MAT files of version 7.3 and Keras models: exact values, what the files say about activations, and rejection of
/// damaged and malicious files. Files written by h5py are tested in foreign_files_test.
#include <gtest/gtest.h>

#include <functional>

#include "hdf5_writer.h"
#include "nn/weights/weights.h"
#include "pth_writer.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using tests::Hdf5Writer;

testing::AssertionResult hdf5_is_refused(const std::string& bytes, const std::vector<std::string>& pieces) {
  return tests::refuses([&] { parse_weights(bytes, "net.mat"); }, pieces);
}

TEST(Mat73, NumbersAreReadColumnByColumn) {
  const Weights weights = parse_weights(tests::small_mat73(), "net.mat");
  ASSERT_EQ(weights.layers.size(), 2u);
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{1, 3, 2, 4}));
  EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{0.5, -0.5}));
  EXPECT_EQ(weights.layers[1].weights, (std::vector<double>{5, 6}));
  EXPECT_EQ(weights.precision, Precision::kFloat64);
  EXPECT_FALSE(weights.states_activation());
}

TEST(Mat73, CompressedChunksGiveTheSameNumbers) {
  Hdf5Writer writer(512);  // HDF5's 2 x 3 elements are a 3 x 2 matrix in MATLAB
  writer.add("W1", {2, 3}, {1, 2, 3, 4, 5, 6}, H5T_IEEE_F64LE, {2, 2});
  writer.set_text("W1", "MATLAB_class", {"double"});
  const Weights weights = parse_weights(writer.bytes(), "net.mat");
  EXPECT_EQ(weights.layers.at(0).weights, (std::vector<double>{1, 4, 2, 5, 3, 6}));
  EXPECT_EQ(weights.layers.at(0).outputs, 3);
}

TEST(Mat73, TheActivationsThatTheFileStatesAreUsed) {
  Hdf5Writer writer(512);
  writer.add_matrix("#refs#/a", {2, 2}, {1, 2, 3, 4});
  writer.add_matrix("#refs#/b", {1, 2}, {5, 6});
  writer.add_cells("W", {"#refs#/a", "#refs#/b"});
  // Two rows of text, padded to the same length and stored column by column: "tanh  ", "linear".
  std::vector<double> units;
  const std::string rows[] = {"tanh  ", "linear"};
  for (std::size_t k = 0; k < 6; ++k)
    for (const std::string& row : rows) units.push_back(row[k]);
  writer.add_matrix("act_fcns", {2, 6}, units, "char");
  const Weights weights = parse_weights(writer.bytes(), "net.mat");
  EXPECT_EQ(weights.activation_names(), "tanh");
  EXPECT_EQ(weights.layers.size(), 2u);
  EXPECT_EQ(weights.activation_source, ActivationSource::kFile);
}

TEST(Mat73, WhatIsNoNetworkIsRefusedByName) {
  Hdf5Writer text(512);
  text.add_matrix("comment", {1, 2}, {'h', 'i'}, "char");
  EXPECT_TRUE(hdf5_is_refused(text.bytes(), {"neither a cell array", "-v7"}));
  Hdf5Writer words(512);
  words.add_matrix("#refs#/a", {1, 2}, {'h', 'i'}, "char");
  words.add_cells("weights", {"#refs#/a"});
  EXPECT_TRUE(hdf5_is_refused(words.bytes(), {"\"weights\"", "holds text"}));
  Hdf5Writer outside(512);
  outside.link_to_file("other.h5", "W1");
  EXPECT_TRUE(hdf5_is_refused(outside.bytes(), {"\"W1\"", "another file"}));
}

TEST(Mat73, TypesWithUnusedOrMovedBitsAreRefusedAndIeeeOfEitherOrderIsRead) {
  // The library's conversions trust the positions of bits in the file.
  const auto with = [](hid_t type) {
    Hdf5Writer writer(512);
    writer.add("W1", {1, 2}, {1, 2}, type);
    writer.set_text("W1", "MATLAB_class", {"double"});
    return writer.bytes();
  };
  const auto changed = [](hid_t plain, const std::function<void(hid_t)>& change) {
    const hid_t type = H5Tcopy(plain);
    change(type);
    return type;
  };
  for (const hid_t type : {H5T_IEEE_F64LE, H5T_IEEE_F64BE, H5T_IEEE_F32LE, H5T_IEEE_F32BE, H5T_STD_I8LE,
                           H5T_STD_U16BE, H5T_STD_I32LE})
    EXPECT_EQ(parse_weights(with(type), "net.mat").layers.at(0).weights, (std::vector<double>{1, 2}));
  const hid_t half = changed(H5T_IEEE_F32LE, [](hid_t type) {
    H5Tset_fields(type, 15, 10, 5, 0, 10);
    H5Tset_precision(type, 16);
    H5Tset_size(type, 2);
    H5Tset_ebias(type, 15);
  });
  EXPECT_EQ(parse_weights(with(half), "net.mat").layers.at(0).weights, (std::vector<double>{1, 2}));
  const hid_t refused[] = {changed(H5T_STD_I16LE, [](hid_t type) { H5Tset_precision(type, 12); }),
                           changed(H5T_STD_I32LE,
                                   [](hid_t type) {
                                     H5Tset_precision(type, 12);
                                     H5Tset_offset(type, 7);
                                   }),
                           changed(H5T_IEEE_F32LE, [](hid_t type) { H5Tset_fields(type, 30, 22, 8, 0, 22); }),
                           changed(H5T_IEEE_F64LE, [](hid_t type) { H5Tset_ebias(type, 1000); }),
                           changed(H5T_STD_I64LE, [](hid_t) {})};
  for (const hid_t type : refused) EXPECT_TRUE(hdf5_is_refused(with(type), {"W1", "another type"}));
}

TEST(Mat73, TruncatedFilesAreRefused) {
  const std::string good = tests::small_mat73();
  for (std::size_t size = 512; size < good.size(); size += 97)
    EXPECT_TRUE(hdf5_is_refused(good.substr(0, size), {"net.mat"})) << size;
}

TEST(Mat73, RepetitionsCostNoMoreThanALargeNetwork) {
  Hdf5Writer writer(512);  // a matrix of 2^20 zeros, a few kilobytes, under 100 names
  writer.add("W1", {1024, 1024}, std::vector<double>(1 << 20), H5T_IEEE_F64LE, {1024, 1024});
  writer.set_text("W1", "MATLAB_class", {"double"});
  for (int k = 2; k <= 100; ++k) writer.link("W1", "W" + std::to_string(k));
  EXPECT_TRUE(hdf5_is_refused(writer.bytes(), {"more than 2^25 numbers"}));
}

TEST(Mat73, AMatrixOfManyRowsWithoutColumnsCostsNoTime) {
  Hdf5Writer writer(512);
  writer.add("W1", {0, hsize_t{1} << 40}, {});
  writer.set_text("W1", "MATLAB_class", {"double"});
  EXPECT_TRUE(hdf5_is_refused(writer.bytes(), {"dimension of size 0"}));
}

TEST(Keras, LayersOrderAndActivationsAreThoseOfTheModel) {
  const Weights weights = parse_weights(tests::small_keras("tanh"), "net.h5");
  ASSERT_EQ(weights.layers.size(), 2u);
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{1, 4, 2, 5, 3, 6}));
  EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{0.5, 0.25, 0.125}));
  EXPECT_EQ(weights.layers[1].biases, (std::vector<double>{0}));
  EXPECT_EQ(weights.activation_names(), "tanh");
  EXPECT_EQ(weights.precision, Precision::kFloat32);
  EXPECT_TRUE(weights.assumed.empty());
}

TEST(Keras, AnUnknownActivationOrAFileWithoutLayersIsRefused) {
  EXPECT_TRUE(hdf5_is_refused(tests::small_keras("mish"), {"mish", "not known"}));
  Hdf5Writer other;
  other.add("table", {2, 2}, {1, 2, 3, 4});
  EXPECT_TRUE(hdf5_is_refused(other.bytes(), {"without the layers of a Keras model"}));
}

std::string functional_keras(const std::string& outputs) {
  return R"({"class_name": "Functional", "config": {"name": "m", "layers": [
    {"class_name": "InputLayer", "config": {"name": "x"}, "inbound_nodes": []},
    {"class_name": "Dense", "config": {"name": "policy_1", "units": 3, "activation": "leaky_relu"}, "inbound_nodes":
     [{"args": [{"class_name": "__keras_tensor__", "config": {"keras_history": ["x", 0, 0]}}], "kwargs": {}}]},
    {"class_name": "Dense", "config": {"name": "head", "units": 1, "activation": "linear"}, "inbound_nodes":
     [{"args": [{"class_name": "__keras_tensor__", "config": {"keras_history": ["policy_1", 0, 0]}}], "kwargs": {}}]}],
    "output_layers": )" +
         outputs + "}}";
}

std::string keras_archive(const std::string& config, const std::string& folder = "layers") {
  Hdf5Writer writer;
  writer.add(folder + "/dense/vars/0", {2, 3}, {1, 2, 3, 4, 5, 6}, H5T_IEEE_F32LE);
  writer.add(folder + "/dense/vars/1", {3}, {0.5, 0.25, 0.125}, H5T_IEEE_F32LE);
  writer.add(folder + "/dense_1/vars/0", {3, 1}, {1, -1, 2}, H5T_IEEE_F32LE);
  return tests::zip({{"metadata.json", "{}"}, {"config.json", config}, {"model.weights.h5", writer.bytes()}});
}

TEST(KerasArchive, LayersAreFoundByTheirClassInTheOrderOfTheConfiguration) {
  for (const char* const folder : {"layers", "_layer_checkpoint_dependencies"}) {
    const Weights weights =
        parse_weights(keras_archive(functional_keras(R"(["head", 0, 0])"), folder), "net.keras");
    ASSERT_EQ(weights.layers.size(), 2u);
    EXPECT_EQ(weights.layers[0].outputs, 6) << "leaky_relu is written with ReLU of both signs";
    EXPECT_EQ(weights.stored_layers()[0].weights, (std::vector<double>{1, 4, 2, 5, 3, 6}));
    EXPECT_EQ(weights.stored_layers()[0].name, "policy_1");
    EXPECT_TRUE(weights.assumed.empty());
  }
}

TEST(KerasArchive, LeakyReluHasTheSlopeOfKerasNotOfPyTorch) {
  const Evaluator<double> f(
      parse_weights(keras_archive(functional_keras(R"([["head", 0, 0]])")), "net.keras"));
  const double h[] = {-4.5, -6.75, -8.875};  // of the input (-1, -1)
  EXPECT_NEAR(f({-1, -1})[0], 0.2 * (h[0] - h[1] + 2 * h[2]), 1e-12);
}

TEST(KerasArchive, OutputsAndShapesThatDoNotFitTheConfigurationAreRefused) {
  for (const char* const outputs :
       {R"([["policy_1", 0, 0], ["head", 0, 0]])", R"(["policy_1", 0, 0])", "null"})
    EXPECT_TRUE(tests::refuses([&] { parse_weights(keras_archive(functional_keras(outputs)), "net.keras"); },
                               {"head", "not the only output"}));
  std::string other = functional_keras(R"(["head", 0, 0])");
  other.replace(other.find("\"units\": 3"), 10, "\"units\": 4");
  EXPECT_TRUE(tests::refuses([&] { parse_weights(keras_archive(other), "net.keras"); },
                             {"policy_1", "4 outputs of the configuration"}));
}

TEST(Keras, AnActivationThatIsAnObjectIsNotTakenForNone) {
  std::string model = tests::small_keras("tanh");
  EXPECT_NO_THROW(parse_weights(model, "net.h5"));
  std::string config = functional_keras(R"(["head", 0, 0])");
  config.replace(config.find("\"leaky_relu\""), 12, R"({"class_name": "function", "config": "mine"})");
  EXPECT_TRUE(tests::refuses([&] { parse_weights(keras_archive(config), "net.keras"); },
                             {"policy_1", "an activation of its own"}));
}

}  // namespace
}  // namespace swarmcert::files
