/// The C format of the authors. Its text is generated here, from our own matrices and from the published networks.
#include "nn/weights/c_source.h"

#include <gtest/gtest.h>

#include <charconv>

#include "data.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "nn/weights/network.h"
#include "random_network.h"
#include "refusal.h"
#include "temp_folder.h"

namespace swarmcert::files {
namespace {

using namespace tests;

testing::AssertionResult source_is_refused(const std::string& text, const std::vector<std::string>& pieces,
                                           const std::string& key = "") {
  return refuses([&] { parse_weights(text, "weights.c", key); }, pieces);
}

std::string shortest(double value, bool narrow) {
  char digits[40];
  const auto result = narrow ? std::to_chars(digits, digits + sizeof digits, static_cast<float>(value))
                             : std::to_chars(digits, digits + sizeof digits, value);
  return {digits, result.ptr};
}

/// Writes a network like the authors' generator: matrices transposed, shortest decimals.
std::string c_source(const Weights& weights, const std::string& name) {
  const bool narrow = weights.precision == Precision::kFloat32;
  std::string type = "struct neuralNetworkFF_" + name + "\n{\n";
  std::string object = "static const struct neuralNetworkFF_" + name + " weights_" + name + " = {\n";
  for (const Layer& layer : weights.layers) {
    type += "\tfloat " + layer.name + "_weight[" + std::to_string(layer.inputs) + "][" +
            std::to_string(layer.outputs) + "];\n\tfloat " + layer.name + "_bias[" +
            std::to_string(layer.outputs) + "];\n";
    object += "." + layer.name + "_weight = {";
    for (int j = 0; j < layer.inputs; ++j) {
      object += j == 0 ? "{" : ", {";
      for (int i = 0; i < layer.outputs; ++i)
        object += (i == 0 ? "" : ",") +
                  shortest(layer.weights[static_cast<std::size_t>(i * layer.inputs + j)], narrow);
      object += "}";
    }
    object += "},\n." + layer.name + "_bias = {";
    for (int i = 0; i < layer.outputs; ++i)
      object += (i == 0 ? "" : ",") + shortest(layer.biases[static_cast<std::size_t>(i)], narrow);
    object += "},\n";
  }
  return type + "};\n" + object + "};\n\n";
}

void expect_same_numbers(const Weights& a, const Weights& b) {
  ASSERT_EQ(a.layers.size(), b.layers.size());
  for (std::size_t k = 0; k < a.layers.size(); ++k) {
    EXPECT_EQ(a.layers[k].name, b.layers[k].name);
    EXPECT_EQ(a.layers[k].weights, b.layers[k].weights);
    EXPECT_EQ(a.layers[k].biases, b.layers[k].biases);
  }
}

const char kSmall[] =
    "/* GENERATED FILE */\n#include <x.h>\nstruct A\n{\n\tfloat fc1_weight[2][3];\n\tfloat fc1_bias[3]; // "
    "three\n};\n"
    "static const struct A weights_A = {\n.fc1_weight = {{1,2.,3e0},{-4.5,.5,6f}},\n.fc1_bias = "
    "{0,1.e-05,-0.}};\n";

std::string changed(const std::string& from, const std::string& to) {
  std::string text = kSmall;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(CSource, IsReadTransposedAndAsACompilerStoresIt) {
  const Weights weights = parse_weights(kSmall, "weights.c");
  EXPECT_EQ(weights.precision, Precision::kFloat32);
  ASSERT_EQ(weights.layers.size(), 1u);
  EXPECT_EQ(weights.layers[0].name, "fc1");
  EXPECT_EQ(weights.layers[0].outputs, 3);
  EXPECT_EQ(weights.layers[0].weights, (std::vector<double>{1, -4.5, 2, 0.5, 3, 6}));
  EXPECT_EQ(weights.layers[0].biases, (std::vector<double>{0, static_cast<double>(1e-05f), -0.0}));
}

TEST(CSource, DecimalsAreRoundedToDoubleFirstUnlessTheyHaveASuffix) {
  // Just above the midpoint of two floats: rounds to the midpoint in double, and from there to even, which is 1.
  const std::string decimal = "1.000000059604644775390626";
  EXPECT_EQ(parse_weights(changed("6f", decimal), "weights.c").layers[0].weights[5], 1.0);
  EXPECT_EQ(parse_weights(changed("6f", decimal + "f"), "weights.c").layers[0].weights[5],
            static_cast<double>(1.00000012f));
}

TEST(CSource, SeveralNetworksAreChosenByKeyOrByNameOfTheFile) {
  std::mt19937 generator(2);
  const Weights phi = random_network({6, 5, 4}, generator);
  const Weights rho = random_network({4, 5, 1}, generator);
  const std::string text = "/* two */\n" + c_source(rho, "rho_L") + c_source(phi, "phi_L");
  expect_same_numbers(parse_weights(text, "weights.c", "phi_L"), phi);
  expect_same_numbers(parse_weights(text, "weights.c", "rho_L"), rho);
  EXPECT_TRUE(source_is_refused(text, {"several networks: phi_L, rho_L", "weights.c#phi_L"}));
  EXPECT_TRUE(source_is_refused(text, {"\"phi_l\"", "did you mean", "phi_L"}, "phi_l"));
  const TempFolder folder;
  write_file(folder / "weights.c", text, true);
  NetworkArguments arguments;
  arguments.phi = folder / "weights.c#phi_L";
  arguments.rho = folder / "weights.c#rho_L";
  const Network network = load_network(arguments);
  expect_same_numbers(network.phi.at("default"), phi);
  expect_same_numbers(network.rho.at("default"), rho);
  NetworkArguments plain;
  plain.file = folder / "weights.c#rho_L";
  expect_same_numbers(*load_network(plain).plain, rho);
  plain.key = "rho_L";
  EXPECT_TRUE(refuses([&] { load_network(plain); }, {"--key", "already names a key"}));
}

TEST(CSource, PublishedNetworksComeBackBitForBitAndFloat64RoundsToWhatIsFlashed) {
  SWARMCERT_NEEDS_DATA();
  for (const char* const name : {"phi_G", "phi_L", "phi_S", "rho_L", "rho_S"}) {
    const Weights weights = load_weights(data_path(std::string("weights/zip_f32/") + name + ".pth"));
    expect_same_numbers(parse_weights(c_source(weights, name), "weights.c", name), weights);
  }
  const Weights wide = load_weights(data_path("weights/legacy_f64/rho_L.pth"));
  expect_same_numbers(parse_weights(c_source(wide, "rho_L"), "weights.c"), as_float32(wide));
}

TEST(CSource, EverythingElseIsRefusedWithItsLine) {
  EXPECT_TRUE(
      source_is_refused(changed("float fc1_bias", "int fc1_bias"), {"line 6", "neither float nor double"}));
  EXPECT_TRUE(source_is_refused(changed("fc1_bias[3]", "fc1_bias[]"), {"line 6", "the size of an array"}));
  EXPECT_TRUE(source_is_refused(changed("fc1_bias[3]", "fc1_bias[3"), {"expected ']'"}));
  EXPECT_TRUE(source_is_refused(changed("fc1_bias[3]", "fc1_bias"), {"neither a matrix nor a vector"}));
  EXPECT_TRUE(
      source_is_refused(changed("fc1_bias[3]", "fc1_bias[3][1][1]"), {"neither a matrix nor a vector"}));
  EXPECT_TRUE(source_is_refused(changed("fc1_bias[3]", "fc1_bias[4]"), {"expected ','"}));
  EXPECT_TRUE(source_is_refused(changed("fc1_weight[2][3]", "fc1_weight[0][3]"), {"impossible shape"}));
  EXPECT_TRUE(
      source_is_refused(changed("fc1_weight[2][3]", "fc1_weight[99999999][99999999]"), {"impossible shape"}));
  EXPECT_TRUE(source_is_refused(changed("-4.5", "x"), {"line 9", "expected a number"}));
  EXPECT_TRUE(source_is_refused(changed("-4.5", "-inf"), {"expected a number"}));
  EXPECT_TRUE(source_is_refused(changed("-4.5", "0x10"), {"expected a decimal number"}));
  EXPECT_TRUE(source_is_refused(changed("-4.5", "1e39"), {"beyond the range"}));
  EXPECT_TRUE(source_is_refused(changed("-4.5", "1e999"), {"beyond the range"}));
  EXPECT_TRUE(source_is_refused(changed("-4.5", "1e39f"), {"beyond the range"}));
  EXPECT_TRUE(source_is_refused(changed(",{-4.5,.5,6f}", ""), {"expected ','"}));
  EXPECT_TRUE(
      source_is_refused(changed(".fc1_bias =", ".fc2_bias ="), {"weights_A.fc2_bias", "not a member"}));
  EXPECT_TRUE(source_is_refused(changed(".fc1_bias =", ".fc1_weight ="), {"initialised twice"}));
  EXPECT_TRUE(
      source_is_refused(changed(",\n.fc1_bias = {0,1.e-05,-0.}", ""), {"fc1_bias", "is not initialised"}));
  EXPECT_TRUE(source_is_refused(changed("struct A weights_A", "struct B weights_A"), {"unknown type \"B\""}));
  EXPECT_TRUE(source_is_refused(std::string(kSmall) + kSmall, {"is defined twice"}));
  EXPECT_TRUE(source_is_refused(std::string(kSmall) +
                                    "static const struct A weights_A = {.fc1_weight = {{1,2,3},{4,5,6}}, "
                                    ".fc1_bias = {1,2,3}};",
                                {"weights_A", "is defined twice"}));
  EXPECT_TRUE(source_is_refused(std::string(kSmall) + "int main() {}", {"expected a struct"}));
  EXPECT_TRUE(source_is_refused("struct A { float a_weight[1][1]; };", {"holds no network"}));
  EXPECT_TRUE(source_is_refused("struct A { float a_weight[1][1]; ", {"neither float nor double"}));
  EXPECT_TRUE(source_is_refused(changed("fc1_weight[2]", "gain[2]").replace(0, 0, ""), {"not a member"}));
}

TEST(CSource, EveryTruncationIsRefused) {
  const std::string text = kSmall;
  for (std::size_t size = 0; size + 2 < text.size(); ++size)
    EXPECT_TRUE(refuses([&] { parse_weights(text.substr(0, size), "weights.c"); }, {})) << "cut to " << size;
}

}  // namespace
}  // namespace swarmcert::files
