/// The published networks, compared with outputs that an independent program computed from the same files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "data.h"
#include "nn/base/file_io.h"
#include "nn/base/json.h"
#include "nn/weights/weights.h"

namespace swarmcert::files {
namespace {

std::vector<double> hex_floats(const Json& list) {
  std::vector<double> numbers;
  for (const Json& text : list) numbers.push_back(parse_hex_float(text.get<std::string>()));
  return numbers;
}

/// golden.json and the file that it refers to; one test per network.
class Golden : public testing::TestWithParam<const char*> {
 protected:
  void load() {
    const std::string golden = tests::data_path("weights/golden.json");
    expected_ = parse_json(read_file(golden), golden)["networks"][GetParam()];
    weights_ = load_weights(tests::data_path(std::string("weights/") + GetParam()));
  }
  Json expected_;
  Weights weights_;
};

TEST_P(Golden, HashShapesAndPrecisionAreAsPublished) {
  SWARMCERT_NEEDS_DATA();
  load();
  EXPECT_EQ(weights_.sha256, expected_["sha256"].get<std::string>());
  EXPECT_EQ(name(weights_.precision), expected_["dtype"].get<std::string>());
  ASSERT_EQ(weights_.layers.size(), expected_["shapes"].size());
  for (std::size_t k = 0; k < weights_.layers.size(); ++k) {
    EXPECT_EQ(weights_.layers[k].outputs, expected_["shapes"][k][0].get<int>());
    EXPECT_EQ(weights_.layers[k].inputs, expected_["shapes"][k][1].get<int>());
    EXPECT_EQ(weights_.layers[k].name, "fc" + std::to_string(k + 1));
  }
}

TEST_P(Golden, Float32OrderAgreesBitForBit) {
  SWARMCERT_NEEDS_DATA();
  load();
  const Evaluator<float> evaluate(weights_);
  for (const Json& one : expected_["cases"]) {
    const std::vector<double> x = hex_floats(one["x"]);
    const std::vector<float> y = evaluate(std::vector<float>(x.begin(), x.end()));
    EXPECT_EQ(std::vector<double>(y.begin(), y.end()), hex_floats(one["y_float32_order"]));
  }
  EXPECT_GE(expected_["cases"].size(), 12u);
}

TEST_P(Golden, DoubleAgreesTo1e12OfTheLargestOutput) {
  SWARMCERT_NEEDS_DATA();
  load();
  const Evaluator<double> evaluate(weights_);
  for (const Json& one : expected_["cases"]) {
    const std::vector<double> y = evaluate(hex_floats(one["x"]));
    const std::vector<double> golden = hex_floats(one["y_double"]);
    ASSERT_EQ(y.size(), golden.size());
    double largest = 0;
    for (const double value : golden) largest = std::max(largest, std::abs(value));
    for (std::size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(y[i], golden[i], 1e-12 * largest);
  }
}

INSTANTIATE_TEST_SUITE_P(Published, Golden,
                         testing::Values("zip_f32/phi_G.pth", "zip_f32/phi_L.pth", "zip_f32/phi_S.pth",
                                         "zip_f32/rho_L.pth", "zip_f32/rho_S.pth", "legacy_f64/phi_L.pth",
                                         "legacy_f64/phi_S.pth", "legacy_f64/rho_L.pth",
                                         "legacy_f64/rho_S.pth"),
                         [](const auto& network) {
                           std::string name = network.param;
                           for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                           return name.substr(0, name.size() - 4);
                         });

}  // namespace
}  // namespace swarmcert::files
