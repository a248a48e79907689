#include "nn/weights/safetensors.h"

#include <gtest/gtest.h>

#include "data.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "pth_writer.h"
#include "random_network.h"
#include "refusal.h"
#include "temp_folder.h"

namespace swarmcert::files {
namespace {

using tests::little_endian;
using tests::refuses;

std::string safetensors(const std::string& header, const std::string& data = "") {
  return little_endian(header.size(), 8) + header + data;
}
testing::AssertionResult safetensors_is_refused(const std::string& bytes,
                                                const std::vector<std::string>& pieces) {
  return refuses([&] { parse_weights(bytes, "net.safetensors"); }, pieces);
}

void expect_equal(const Weights& a, const Weights& b) {
  EXPECT_EQ(a.precision, b.precision);
  ASSERT_EQ(a.layers.size(), b.layers.size());
  for (std::size_t k = 0; k < a.layers.size(); ++k) {
    EXPECT_EQ(a.layers[k].name, b.layers[k].name);
    EXPECT_EQ(a.layers[k].outputs, b.layers[k].outputs);
    EXPECT_EQ(a.layers[k].inputs, b.layers[k].inputs);
    EXPECT_EQ(tests::raw_numbers(a.layers[k].weights),
              tests::raw_numbers(b.layers[k].weights));  // compare bits, not values
    EXPECT_EQ(tests::raw_numbers(a.layers[k].biases), tests::raw_numbers(b.layers[k].biases));
  }
}

TEST(Safetensors, RoundTripIsExactInBothPrecisions) {
  std::mt19937 generator(3);
  Weights weights = tests::random_network({6, 25, 40, 20}, generator);
  weights.layers[0].weights[0] = -0.0;
  weights.layers[0].weights[1] = 0x1p-149;  // the smallest float
  const tests::TempFolder folder;
  for (const Precision precision : {Precision::kFloat32, Precision::kFloat64}) {
    weights.precision = precision;
    if (precision == Precision::kFloat64) weights.layers[1].weights[7] = 0x1.23456789abcdep-1000;
    const std::string path = folder / "round_trip.safetensors";
    save_safetensors(weights, path, true);
    const Weights again = load_weights(path);
    expect_equal(again, weights);
    EXPECT_EQ(again.sha256, sha256(safetensors_bytes(weights)));
    EXPECT_EQ(safetensors_bytes(again), safetensors_bytes(weights));
  }
}

TEST(Safetensors, RoundTripKeepsTheOrderOfLayersWhateverTheirNames) {
  std::mt19937 generator(4);
  Weights weights = tests::random_network({3, 3, 3, 3}, generator);
  weights.layers[0].name = "input";
  weights.layers[1].name = "body.10";
  weights.layers[2].name = "body.9";
  expect_equal(parse_weights(safetensors_bytes(weights), "order"), weights);
  weights.layers = {weights.layers[1]};
  weights.layers[0].name = "";
  expect_equal(parse_weights(safetensors_bytes(weights), "no name"), weights);
}

TEST(Safetensors, PublishedNetworksSurviveTheRoundTrip) {
  SWARMCERT_NEEDS_DATA();
  for (const char* const file : {"weights/zip_f32/phi_S.pth", "weights/legacy_f64/rho_L.pth"}) {
    const Weights weights = load_weights(tests::data_path(file));
    expect_equal(parse_weights(safetensors_bytes(weights), "again"), weights);
  }
}

TEST(Safetensors, FilesOfOthersAreReadInNaturalOrder) {
  // fc2 comes before fc10, and a bias before its weight.
  const std::string header =
      R"({"fc10.weight":{"dtype":"F32","shape":[1,2],"data_offsets":[8,16]},)"
      R"("fc2.bias":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},)"
      R"("fc2.weight":{"dtype":"F32","shape":[2,1],"data_offsets":[16,24]},"__metadata__":{"format":"pt"}})";
  const Weights weights =
      parse_weights(safetensors(header, tests::raw_numbers<float>({1, 2, 3, 4, 5, 6})), "net.safetensors");
  ASSERT_EQ(weights.layers.size(), 2u);
  EXPECT_EQ(weights.layers[0].name, "fc2");
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{5, 6}));
  EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{1, 2}));
  EXPECT_EQ(weights.layers[1].name, "fc10");
  EXPECT_EQ(weights.layers[1].weights, (std::vector<double>{3, 4}));
}

TEST(Safetensors, AKeyIsRefused) {
  std::mt19937 generator(4);
  const std::string bytes = safetensors_bytes(tests::random_network({2, 1}, generator));
  EXPECT_TRUE(refuses([&] { parse_weights(bytes, "x", "model"); }, {"--key", "\"model\"", "not nested"}));
}

TEST(Safetensors, OffsetsThatOverlapLeaveGapsOrLeaveTheFileAreRefused) {
  const auto one = [](const std::string& offsets, const std::string& shape = "[2,1]") {
    return R"({"fc.weight":{"dtype":"F32","shape":)" + shape + R"(,"data_offsets":)" + offsets + "}}";
  };
  const std::string eight(8, '\0');
  EXPECT_TRUE(
      safetensors_is_refused(safetensors(one("[0,8]"), eight + "x"), {"1 bytes", "belong to no tensor"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(one("[0,8]"), "x"),
                                     {"fc.weight\".data_offsets = [0, 8]", "1 bytes of data"}));
  EXPECT_TRUE(
      safetensors_is_refused(safetensors(one("[8,0]"), eight), {"data_offsets = [8, 0]", "not a range"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(one("[1,9]"), eight + "x"), {"leaves a gap"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(one("[0,18446744073709551615]"), eight), {"not a range"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(one("[0]"), eight), {"not a range"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(one("[-1,8]"), eight), {"non-negative integer"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(one("[0,8.5]"), eight), {"non-negative integer"}));
  EXPECT_TRUE(
      safetensors_is_refused(safetensors(one("[0,8]", "[3,1]"), eight), {"shape = [3, 1]", "8 bytes"}));
  EXPECT_TRUE(
      safetensors_is_refused(safetensors(one("[0,8]", "[1000000000,1000000000]"), eight), {"does not fit"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(one("[0,0]", "[0,4294967296]")), {"size 0"}));
  const std::string overlap = R"({"a.weight":{"dtype":"F32","shape":[2,1],"data_offsets":[0,8]},)"
                              R"("b.weight":{"dtype":"F32","shape":[2,2],"data_offsets":[4,20]}})";
  EXPECT_TRUE(
      safetensors_is_refused(safetensors(overlap, std::string(20, '\0')), {"\"b.weight\"", "overlaps"}));
}

TEST(Safetensors, OtherTypesAreRefused) {
  const std::string header = R"({"fc.weight":{"dtype":"I16","shape":[2,1],"data_offsets":[0,4]}})";
  EXPECT_TRUE(safetensors_is_refused(safetensors(header, "abcd"), {"fc.weight = I16", "model.float()"}));
}

TEST(Safetensors, BrokenHeadersAreRefused) {
  EXPECT_TRUE(safetensors_is_refused(little_endian(1000, 8) + "{}", {"the header is longer than the file"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors("{]"), {"net.safetensors: line 1, column", "not JSON"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors("{}"), {"holds no tensor"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(R"({"fc.weight":1})"), {"not an object"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(R"({"fc.weight":{}})"), {"has no dtype"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(R"({"fc.weight":{"dtype":"F32","strides":[1]}})"),
                                     {"\"strides\"", "known key"}));
  EXPECT_TRUE(
      safetensors_is_refused(safetensors(R"({"fc.weight":{"dtype":"F32"}})"), {"shape", "not a list"}));
  EXPECT_TRUE(
      safetensors_is_refused(safetensors(R"({"a":{"dtype":"F32"},"a":{}})"), {"\"a\"", "appears twice"}));
  EXPECT_TRUE(
      safetensors_is_refused(safetensors(R"({"__metadata__":3})"), {"__metadata__", "not an object"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(R"({"__metadata__":{"swarmcert.layers":3}})"),
                                     {"swarmcert.layers", "not text"}));
  EXPECT_TRUE(safetensors_is_refused(safetensors(R"({"__metadata__":{"swarmcert.layers":"[3]"}})"),
                                     {"not a list of layers"}));
  const std::string many_sizes = R"({"a":{"dtype":"F32","shape":[1,1,1,1,1,1,1,1,1],"data_offsets":[0,0]}})";
  EXPECT_TRUE(safetensors_is_refused(safetensors(many_sizes), {"more than 8 entries"}));
}

TEST(Safetensors, NamesThatAreNotUtf8AreNotWritten) {
  std::mt19937 generator(4);
  Weights weights = tests::random_network({2, 1}, generator);
  weights.layers[0].name = "\xff";
  EXPECT_TRUE(refuses([&] { safetensors_bytes(weights); }, {"not UTF-8"}));
}

TEST(Safetensors, AnExistingFileIsKeptUnlessToldOtherwise) {
  std::mt19937 generator(4);
  const Weights weights = tests::random_network({2, 1}, generator);
  const tests::TempFolder folder;
  const std::string path = folder / "existing.safetensors";
  write_file(path, "mine", true);
  EXPECT_TRUE(refuses([&] { save_safetensors(weights, path, false); }, {path, "exists", "--force"}));
  EXPECT_EQ(read_file(path), "mine");
}

}  // namespace
}  // namespace swarmcert::files
