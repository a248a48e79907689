/// The normalization of observations beside a policy: the same values as the formula, a clamp that contains the clip,
/// and errors. files/make_vec_normalize.py writes the pickles.
#include "nn/weights/vec_normalize.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "nn/base/file_io.h"
#include "pth_writer.h"
#include "refusal.h"
#include "temp_folder.h"

namespace swarmcert::files {
namespace {

using namespace tests;

std::string pickled(const std::string& name) {
  return read_file(std::string(SWARMCERT_SOURCE_DIR "/tests/nn/files/") + name);
}

/// "net" with two inputs: 3 x 2, ReLU, 1 x 3.
std::string two_inputs() {
  const std::vector<float> first = {1, 2, -3, 4, 0.5F, -6}, bias = {0.5F, -0.25F, 1}, last = {1, -2, 3};
  return zip_file({{"0.weight", "a", 6, {3, 2}, {2, 1}},
                   {"0.bias", "b", 3, {3}, {1}},
                   {"2.weight", "c", 3, {1, 3}, {3, 1}}},
                  {{"a", raw_numbers(first)}, {"b", raw_numbers(bias)}, {"c", raw_numbers(last)}});
}

double normalized_value(double x, double y) {
  const auto clipped = [](double z) { return std::clamp(z, -2.0, 2.0); };
  const double u = clipped((x - 0.25) / std::sqrt(4 + 1e-8)),
               v = clipped((y + 1.5) / std::sqrt(0.0225 + 1e-8));
  const auto relu = [](double z) { return std::fmax(z, 0); };
  return relu(u + 2 * v + 0.5) - 2 * relu(-3 * u + 4 * v - 0.25) + 3 * relu(0.5 * u - 6 * v + 1);
}

class VecNormalizeFile : public testing::Test {
 protected:
  VecNormalizeFile() { write_file(folder_ / "net.pth", two_inputs(), true); }

  Network read(const std::string& name) {
    write_file(folder_ / name, pickled(name), true);
    NetworkArguments arguments;
    arguments.file = folder_ / "net.pth";
    arguments.normalization = folder_ / name;
    return load_any_network(arguments);
  }

  TempFolder folder_;
};

TEST_F(VecNormalizeFile, ValuesAreThoseOfTheNetworkOnNormalizedAndClippedObservations) {
  const Network network = read("vec_normalize.pkl");
  const Evaluator<double> f(*network.plain);
  for (const double x : {-7.0, -3.7, 0.0, 0.25, 4.0, 9.0}) {
    for (const double y : {-2.0, -1.75, -1.5, -1.3, 0.0}) {
      const double clamped_x = std::clamp(x, network.clamp->lower[0], network.clamp->upper[0]);
      const double clamped_y = std::clamp(y, network.clamp->lower[1], network.clamp->upper[1]);
      EXPECT_NEAR(f({clamped_x, clamped_y})[0], normalized_value(x, y), 1e-12) << x << ", " << y;
    }
  }
}

TEST_F(VecNormalizeFile, TheClampContainsTheClipUpToItsLastPlace) {
  const Network network = read("vec_normalize.pkl");
  const long double deviation = std::sqrt(4.0L + 1e-8L);
  EXPECT_LE(static_cast<long double>(network.clamp->lower[0]), 0.25L - 2 * deviation);
  EXPECT_GE(static_cast<long double>(network.clamp->upper[0]), 0.25L + 2 * deviation);
  EXPECT_NEAR(network.clamp->upper[0], static_cast<double>(0.25L + 2 * deviation), 1e-14);
  EXPECT_GT(rounding_of_slope(*network.plain), 0) << "1 / sqrt(var + epsilon) is no double";
  EXPECT_LT(rounding_of_slope(*network.plain), 1e-13);
}

TEST_F(VecNormalizeFile, NormsAreThoseOfTheStoredMatricesAndTheFileIsNamedWithItsHash) {
  const Network network = read("vec_normalize.pkl");
  EXPECT_EQ(network.plain->stored_layers().front().weights, (std::vector<double>{1, 2, -3, 4, 0.5, -6}));
  ASSERT_EQ(network.plain->data_files.size(), 1u);
  EXPECT_EQ(network.plain->data_files[0].first, "vec_normalize.pkl");
  EXPECT_EQ(network.plain->data_files[0].second, sha256(pickled("vec_normalize.pkl")));
  EXPECT_EQ(options_of(options_json(network.options)).normalization, "vec_normalize.pkl");
}

TEST_F(VecNormalizeFile, OnlyAPolicyTakesTheFileBesideItUnasked) {
  read("vec_normalize.pkl");
  NetworkArguments arguments;
  arguments.file = folder_ / "net.pth";
  EXPECT_FALSE(load_any_network(arguments).clamp);
  const std::string data =
      R"({"policy_class":{"__module__":"stable_baselines3.dqn.policies"},"policy_kwargs":{}})";
  const std::vector<float> matrix = {1, 2};
  const std::string policy =
      zip_file({{"q_net.q_net.0.weight", "a", 2, {1, 2}, {2, 1}}}, {{"a", raw_numbers(matrix)}});
  write_file(folder_ / "dqn.zip", zip({{"data", data}, {"policy.pth", policy}}), true);
  arguments.file = folder_ / "dqn.zip";
  arguments.select = {"policy"};
  EXPECT_TRUE(load_any_network(arguments).clamp);
  arguments.normalization = "none";
  EXPECT_FALSE(load_any_network(arguments).clamp);
}

TEST_F(VecNormalizeFile, OtherPicklesAndObservationsByNameAreRefused) {
  EXPECT_TRUE(refuses([&] { read("vec_normalize_by_name.pkl"); }, {"obs_rms", "several observations"}));
  write_file(folder_ / "other.pkl", pickle("}"), true);
  NetworkArguments arguments;
  arguments.file = folder_ / "net.pth";
  arguments.normalization = folder_ / "other.pkl";
  EXPECT_TRUE(refuses([&] { load_any_network(arguments); }, {"other.pkl", "VecNormalize.save()"}));
  write_file(
      folder_ / "net.pth",
      zip_file({{"0.weight", "a", 3, {1, 3}, {3, 1}}}, {{"a", raw_numbers(std::vector<float>{1, 2, 3})}}),
      true);
  EXPECT_TRUE(refuses([&] { read("vec_normalize.pkl"); }, {"2 numbers", "3 inputs", "--normalization none"}));
}

TEST_F(VecNormalizeFile, EveryTruncationAndManyFlippedBitsAreRefusedOrGiveFiniteNumbers) {
  const std::string good = pickled("vec_normalize.pkl");
  NetworkArguments arguments;
  arguments.file = folder_ / "net.pth";
  arguments.normalization = folder_ / "damaged.pkl";
  int refused = 0;
  const auto try_to_read = [&](const std::string& bytes) {
    write_file(folder_ / "damaged.pkl", bytes, true);
    try {
      const Network network = load_any_network(arguments);
      for (const double number : network.plain->layers[0].weights) ASSERT_TRUE(std::isfinite(number));
    } catch (const InputError&) {
      ++refused;
    }
  };
  for (std::size_t size = 0; size < good.size(); size += 3) try_to_read(good.substr(0, size));
  for (std::size_t bit = 0; bit < 8 * good.size(); bit += 7) {
    std::string bytes = good;
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ 1 << bit % 8);
    try_to_read(bytes);
  }
  EXPECT_GT(refused, 400);
}

}  // namespace
}  // namespace swarmcert::files
