/// PyTorch files that must be rejected, each with the field at fault and a remedy.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nn/weights/weights.h"
#include "pth_writer.h"
#include "refusal.h"

namespace swarmcert::files {
namespace {

using namespace tests;

testing::AssertionResult pth_is_refused(const std::string& bytes, const std::vector<std::string>& pieces,
                                        const std::string& key = "") {
  return refuses([&] { parse_weights(bytes, "phi.pth", key); }, pieces);
}
testing::AssertionResult pth_is_refused(const std::vector<TensorSpec>& tensors,
                                        const std::vector<std::string>& pieces) {
  return pth_is_refused(zip_file(tensors, small_storages<float>()), pieces);
}
/// Returns an archive whose data.pkl is `ops` between PROTO and STOP.
std::string program(const std::string& ops) { return zip_file(pickle(ops), small_storages<float>()); }

TEST(PthRefusal, NamesThePlaceOfANumberThatIsNotFinite) {
  for (const float number : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                             -std::numeric_limits<float>::infinity()}) {
    const std::string text = std::isnan(number) ? "nan" : number > 0 ? "inf" : "-inf";
    Storages storages = small_storages<float>();
    storages[0].second.replace(12, 4, raw_numbers<float>({number}));
    EXPECT_TRUE(pth_is_refused(zip_file(small_tensors(), storages),
                               {"phi.pth: fc1.weight[1,1] = " + text + ": not finite; "}));
    storages = small_storages<float>();
    storages[1].second.replace(8, 4, raw_numbers<float>({number}));
    EXPECT_TRUE(
        pth_is_refused(zip_file(small_tensors(), storages), {"fc1.bias[2] = " + text + ": not finite"}));
  }
}

TEST(PthRefusal, OtherTypesOfNumbers) {
  for (const char* const type : {"LongStorage", "IntStorage", "ByteStorage", "BoolStorage",
                                 "ComplexFloatStorage", "QInt8Storage", "UntypedStorage"}) {
    EXPECT_TRUE(
        pth_is_refused(small_tensors(type), {"fc1.weight = torch." + std::string(type), "model.float()"}));
  }
  EXPECT_TRUE(pth_is_refused(legacy_file(small_tensors("LongStorage"), small_storages<float>(), 4),
                             {"fc1.weight = torch.LongStorage", "model.float()"}));
}

TEST(PthRefusal, MixedPrecisions) {
  std::vector<TensorSpec> tensors = small_tensors();
  tensors[2].type = "DoubleStorage";
  EXPECT_TRUE(pth_is_refused(tensors, {"fc2.weight = float64", "fc1.weight is float32", "model.double()"}));
}

TEST(PthRefusal, WeightsThatDoNotFollowOneAnother) {
  std::vector<TensorSpec> tensors = small_tensors();
  tensors[2].sizes = {3, 1}, tensors[2].strides = {1, 1};
  tensors.pop_back();
  EXPECT_TRUE(
      pth_is_refused(tensors, {"fc2.weight = [3, 1]", "takes 1 inputs", "fc1.weight", "gives 3 outputs"}));
}

TEST(PthRefusal, ABiasOfAnotherLength) {
  std::vector<TensorSpec> tensors = small_tensors();
  tensors[1].sizes = {2};
  EXPECT_TRUE(pth_is_refused(tensors, {"fc1.bias = [2]", "does not fit fc1.weight of shape [3, 2]"}));
  tensors[1].sizes = {3, 1}, tensors[1].strides = {1, 1};
  EXPECT_TRUE(pth_is_refused(tensors, {"fc1.bias = [3, 1]", "does not fit"}));
}

TEST(PthRefusal, WeightsThatAreNotMatrices) {
  std::vector<TensorSpec> tensors = small_tensors();
  tensors[2].sizes = {3}, tensors[2].strides = {1};
  EXPECT_TRUE(pth_is_refused(tensors, {"fc2.weight = [3]", "two dimensions", "linear layers"}));
  tensors[2].sizes = {1, 3, 1, 1}, tensors[2].strides = {3, 1, 1, 1};
  EXPECT_TRUE(pth_is_refused(tensors, {"fc2.weight = [1, 3, 1, 1]", "two dimensions"}));
}

TEST(PthRefusal, NamesTensorsThatAreNotPartOfALayer) {
  std::vector<TensorSpec> tensors = small_tensors();
  tensors.push_back({"bn.running_mean", "1", 3, {3}, {1}});
  EXPECT_TRUE(pth_is_refused(tensors, {"bn.running_mean = [3]", "batch normalisation"}));
  tensors.back().name = "fc3.bias";
  EXPECT_TRUE(pth_is_refused(tensors, {"fc3.bias = [3]", "fc3.weight is missing"}));
  tensors.back().name = "fc3.scale";
  EXPECT_TRUE(pth_is_refused(tensors, {"fc3.scale = [3]", "neither the weight nor the bias"}));
  tensors.back() = {"n_averaged", "3", 1, {}, {}};
  EXPECT_TRUE(pth_is_refused(tensors, {"n_averaged", "AveragedModel", "averaged.module.state_dict()"}));
}

TEST(PthRefusal, TensorsThatAppearTwice) {
  for (const std::size_t i : {std::size_t{2}, std::size_t{3}}) {
    std::vector<TensorSpec> tensors = small_tensors();
    tensors.push_back(tensors[i]);
    EXPECT_TRUE(pth_is_refused(tensors, {tensors[i].name, "appears twice"}));
  }
}

TEST(PthRefusal, ParametrizationsThatLackATensorWithTheCallThatMendsThem) {
  const std::vector<std::pair<std::string, std::string>> names_and_hints = {
      {"fc1.weight_orig", "torch.nn.utils.remove_spectral_norm(layer)"},
      {"fc1.weight_u", "torch.nn.utils.remove_spectral_norm(layer)"},
      {"fc1.parametrizations.weight.original", "remove_parametrizations(layer, \"weight\")"},
      {"fc1.weight_g", "torch.nn.utils.remove_weight_norm(layer)"}};
  for (const auto& [name, hint] : names_and_hints) {
    std::vector<TensorSpec> tensors = small_tensors();
    tensors[0].name = name;
    EXPECT_TRUE(pth_is_refused(tensors, {name, "parametrised", hint}));
  }
}

TEST(PthRefusal, PickledModulesWithoutExecutingThem) {
  const std::string harmful = global_op("posix", "system") + "(" + text_op("touch /tmp/never") + "tR";
  EXPECT_TRUE(
      pth_is_refused(program(harmful), {"offset 2", "archive/data.pkl = \"posix.system\"",
                                        "nothing was executed", "torch.save(model.state_dict(), ...)"}));
  EXPECT_TRUE(pth_is_refused(program(global_op("__main__", "Net") + ")\x81"),
                             {"\"__main__.Net\"", "model.state_dict()"}));
  EXPECT_TRUE(
      pth_is_refused(legacy_file(pickle(global_op("torch.nn.modules.linear", "Linear") + ")\x81"), {}, 4),
                     {"torch.nn.modules.linear.Linear", "model.state_dict()"}));
  EXPECT_TRUE(pth_is_refused(program(global_op("torch", "load") + ")R"), {"\"torch.load\""}));
}

TEST(PthRefusal, TorchScriptArchives) {
  const std::string state = pickle(state_dict_op(small_tensors(), false));
  for (const char* const entry : {"archive/constants.pkl", "archive/code/__torch__/net.py"}) {
    EXPECT_TRUE(pth_is_refused(zip_file(state, small_storages<float>(), {{entry, "x"}}),
                               {entry, "TorchScript", "torch.save(model.state_dict(), ...)"}));
  }
}

TEST(PthRefusal, BigEndianFiles) {
  EXPECT_TRUE(pth_is_refused(zip_file(pickle(state_dict_op(small_tensors(), false)), small_storages<float>(),
                                      {{"archive/byteorder", "big"}}),
                             {"archive/byteorder", "little-endian"}));
  EXPECT_TRUE(pth_is_refused(
      legacy_file(pickle(state_dict_op(small_tensors(), true)), small_storages<float>(), 4, false),
      {"little_endian", "load and save"}));
}

TEST(PthRefusal, FilesOfOtherKinds) {
  EXPECT_TRUE(pth_is_refused("", {"is empty"}));
  EXPECT_TRUE(pth_is_refused("hello, world", {"offset 0", "neither a PyTorch state dict"}));
  EXPECT_TRUE(pth_is_refused(pickle("}"), {"bare pickle"}));
  EXPECT_TRUE(
      pth_is_refused("version https://git-lfs.github.com/spec/v1\n", {"Git LFS pointer", "git lfs pull"}));
  EXPECT_TRUE(pth_is_refused(zip({{"word/document.xml", "x"}}), {"data.pkl", "torch.save did not write it"}));
  EXPECT_TRUE(pth_is_refused(zip({}), {"data.pkl"}));
  EXPECT_TRUE(pth_is_refused(zip({{"config.json", "{}"}, {"model.weights.h5", "x"}}), {"not", "HDF5"}));
  EXPECT_TRUE(pth_is_refused(std::string("\x1c\0\0\0TFL3", 8) + std::string(40, '\0'),
                             {"TensorFlow Lite", "tf2onnx.convert --tflite"}));
  const std::string saved_model("\x8\1\x12\4\x8\1\x12\0", 8);
  EXPECT_TRUE(pth_is_refused(saved_model, {"graph", "not an ONNX model", "tf2onnx.convert --saved-model"}));
}

TEST(PthRefusal, ThingsThatAreNotStateDicts) {
  EXPECT_TRUE(pth_is_refused(program("]"), {"a list", "not a state dict"}));
  EXPECT_TRUE(pth_is_refused(program("}"), {"empty state dict"}));
  EXPECT_TRUE(pth_is_refused(program("}K\1K\2s"), {"a key that is not text"}));
  EXPECT_TRUE(pth_is_refused(program("}" + text_op("epoch") + "K\2s"),
                             {"\"epoch\" = an integer", "is not a tensor"}));
}

TEST(PthRefusal, NamesWhatStandsInTheTensorsPlace) {
  const std::vector<std::pair<std::string, std::string>> ops_and_names = {
      {"N", "None"},
      {"\x88", "a Boolean"},
      {integer_op(7), "an integer"},
      {"G" + std::string(8, '\0'), "a number"},
      {text_op("x"), "text"},
      {")", "a tuple"},
      {"]", "a list"},
      {global_op("torch._utils", "_rebuild_tensor_v2"), "a function"},
      {"r" + little_endian(7, 4) + "j" + little_endian(7, 4),
       "text"},  // the name itself, stored in the memo and recalled
      {global_op("torch", "FloatStorage"), "a storage type"},
      {storage_op(small_tensors()[0], false), "a storage"}};
  for (const auto& [op, what] : ops_and_names) {
    EXPECT_TRUE(pth_is_refused(program("}" + text_op("epoch") + op + "s"),
                               {"\"epoch\" = " + what, "is not a tensor"}));
  }
}

TEST(PthRefusal, ViewsThatLeaveTheirStorage) {
  const auto with = [](std::int64_t offset, const std::vector<std::int64_t>& strides) {
    std::vector<TensorSpec> tensors = small_tensors();
    tensors[0].offset = offset;
    tensors[0].strides = strides;
    return tensors;
  };
  EXPECT_TRUE(pth_is_refused(with(1, {2, 1}),
                             {"fc1.weight = [3, 2]", "does not fit its storage of 6 numbers", "clone()"}));
  EXPECT_TRUE(pth_is_refused(with(0, {3, 1}), {"does not fit its storage"}));
  EXPECT_TRUE(
      pth_is_refused(with(std::numeric_limits<std::int64_t>::max(), {2, 1}), {"does not fit its storage"}));
  EXPECT_TRUE(
      pth_is_refused(with(0, {std::numeric_limits<std::int64_t>::max(), 1}), {"does not fit its storage"}));
  EXPECT_TRUE(pth_is_refused(with(-1, {2, 1}), {"the offset of a tensor", "negative"}));
  EXPECT_TRUE(pth_is_refused(with(0, {-2, 1}), {"the strides of a tensor", "negative"}));
  EXPECT_TRUE(pth_is_refused(with(0, {2}), {"different numbers of strides"}));
}

TEST(PthRefusal, ExpandedViewsThatTakeMoreThanTheirStorage) {
  std::vector<TensorSpec> tensors = small_tensors();
  tensors[0].sizes = {3, 5}, tensors[0].strides = {1, 0};
  EXPECT_TRUE(pth_is_refused(tensors, {"fc1.weight = [3, 5]", "does not fit its storage of 6 numbers"}));
}

TEST(PthRefusal, AbsurdShapesBeforeMemoryIsTaken) {
  const auto with = [](const std::vector<std::int64_t>& sizes) {
    std::vector<TensorSpec> tensors = small_tensors();
    tensors[0].sizes = sizes;
    return tensors;
  };
  const std::int64_t largest = std::numeric_limits<std::int64_t>::max();
  EXPECT_TRUE(pth_is_refused(with({1'000'000'000, 1'000'000'000}),
                             {"fc1.weight = [1000000000, 1000000000]", "numbers"}));
  EXPECT_TRUE(pth_is_refused(with({largest, largest}), {"fc1.weight", "more than"}));
  EXPECT_TRUE(
      pth_is_refused(with({std::int64_t{1} << 32, std::int64_t{1} << 32}), {"fc1.weight", "more than"}));
  EXPECT_TRUE(pth_is_refused(with({0, 2}), {"fc1.weight = [0, 2]", "size 0"}));
  EXPECT_TRUE(pth_is_refused(with({-3, 2}), {"the shape of a tensor", "negative"}));
  EXPECT_TRUE(pth_is_refused(with({3, 8'000'000}), {"does not fit its storage"}));
  std::vector<TensorSpec> many_dimensions = with(std::vector<std::int64_t>(9, 1));
  EXPECT_TRUE(pth_is_refused(many_dimensions, {"the shape of a tensor has more than 8 dimensions"}));
}

TEST(PthRefusal, StoragesOfAnotherSizeThanDeclared) {
  Storages storages = small_storages<float>();
  storages[0].second += "x";
  EXPECT_TRUE(pth_is_refused(zip_file(small_tensors(), storages),
                             {"storage \"0\" = 25 bytes", "6 numbers were declared"}));
  std::vector<TensorSpec> tensors = small_tensors();
  tensors[0].elements = std::numeric_limits<std::int64_t>::max();
  EXPECT_TRUE(pth_is_refused(tensors, {"storage \"0\" = 24 bytes", "numbers were declared"}));
  EXPECT_TRUE(pth_is_refused(legacy_file(tensors, small_storages<float>(), 4),
                             {"storage \"0\"", "numbers were declared"}));
  storages = small_storages<float>();
  storages.erase(storages.begin());
  EXPECT_TRUE(pth_is_refused(zip_file(small_tensors(), storages), {"archive/data/0", "no such entry"}));
  EXPECT_TRUE(pth_is_refused(legacy_file(small_tensors(), storages, 4),
                             {"storage \"0\"", "6 numbers were declared"}));
}

TEST(PthRefusal, LegacyStoragesThatAreInconsistent) {
  Storages storages = small_storages<float>();
  storages.push_back({"4", raw_numbers<float>({1})});
  EXPECT_TRUE(
      pth_is_refused(legacy_file(small_tensors(), storages, 4), {"storage \"4\"", "belongs to no tensor"}));
  std::vector<TensorSpec> tensors = small_tensors();
  tensors[1].key = "0";
  EXPECT_TRUE(pth_is_refused(legacy_file(tensors, small_storages<float>(), 4),
                             {"storage \"0\"", "declared inconsistently"}));
  tensors = small_tensors();
  tensors[3].key = "2", tensors[3].elements = 3, tensors[3].type = "ComplexFloatStorage";
  EXPECT_TRUE(
      pth_is_refused(legacy_file(tensors, small_storages<float>(), 4), {"torch.ComplexFloatStorage"}));
}

TEST(PthRefusal, DamagedChecksums) {
  std::string bytes = small_zip();
  const std::size_t at = bytes.find(small_storages<float>()[0].second);
  ASSERT_NE(at, std::string::npos);
  bytes[at + 5] = static_cast<char>(bytes[at + 5] ^ 1);
  EXPECT_TRUE(pth_is_refused(bytes, {"archive/data/0", "checksum", "copy it again"}));
}

TEST(PthRefusal, ControlCharactersOfAFileDoNotReachTheTerminal) {
  std::vector<TensorSpec> tensors = small_tensors();
  tensors[0].name = "fc1.\x1b[2Jweight\n";
  try {
    parse_weights(zip_file(tensors, small_storages<float>()), "phi.pth");
    FAIL();
  } catch (const InputError& error) {
    for (const char c : std::string(error.what())) EXPECT_GE(c, ' ');
  }
}

}  // namespace
}  // namespace swarmcert::files
