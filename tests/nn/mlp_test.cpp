#include "nn/mlp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "nn/weights/weights.h"
#include "refusal.h"

namespace swarmcert {
namespace {

constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();

/// y = 2 relu(x1 - x2) - 3 relu(x1 + x2 + 1) + 0.5
files::Weights example() {
  files::Weights weights;
  weights.layers = {{"fc1", 2, 2, {1, -1, 1, 1}, {0, 1}}, {"fc2", 1, 2, {2, -3}, {0.5}}};
  return weights;
}

TEST(Mlp, EvaluatesTheFormulaByHand) {
  const files::Evaluator<double> f(example());
  EXPECT_EQ(f({3, 1}), std::vector<double>{2 * 2 - 3 * 5 + 0.5});
  EXPECT_EQ(f({1, 3}), std::vector<double>{-3 * 5 + 0.5});
  EXPECT_EQ(f({-2, -3}), std::vector<double>{2 * 1 + 0.5});
}

TEST(Mlp, OneLayerIsAffineAndNeedsNoScratch) {
  files::Weights weights;
  weights.layers = {{"fc1", 1, 2, {2, 3}, {-1}}};
  const files::Evaluator<float> f(weights);
  EXPECT_EQ(nn::scratch_size(f.mlp()), 0);
  EXPECT_EQ(f({-1, 1}), std::vector<float>{0});
}

TEST(Mlp, NotANumberReachesTheOutput) {
  EXPECT_TRUE(std::isnan(files::Evaluator<float>(example())({kNotANumber, 0})[0]));
}

TEST(Mlp, ProductsAreRoundedBeforeTheSum) { EXPECT_FALSE(nn::arithmetic_is_fused()); }

TEST(Mlp, AddsTheBiasFirstAndTheInputsInOrder) {
  files::Weights weights;  // 2^24 + 1 is not a float: starting from the bias, both ones are lost
  weights.layers = {{"fc1", 1, 2, {1, 1}, {0x1p24}}};
  EXPECT_EQ(files::Evaluator<float>(weights)({1, 1})[0], 0x1p24f);
  EXPECT_EQ(files::Evaluator<double>(weights)({1, 1})[0], 0x1p24 + 2);
}

TEST(Evaluator, SurvivesItsWeightsAndAMove) {
  auto first = std::make_unique<files::Evaluator<double>>(example());
  const files::Evaluator<double> second = std::move(*first);
  first.reset();
  EXPECT_EQ(second({3, 1}), std::vector<double>{-10.5});
}

TEST(Evaluator, RefusesAnInputOfAnotherLength) {
  const files::Evaluator<float> f(example());
  EXPECT_THROW(f({1, 2, 3}), std::invalid_argument);
}

TEST(Evaluator, RefusesAWeightBeyondFloat32) {
  files::Weights weights = example();
  weights.layers[1].weights[0] = std::numeric_limits<float>::max();
  EXPECT_NO_THROW(files::Evaluator<float>{weights});
  weights.layers[1].weights[0] = std::nextafter(0x1.ffffffp127, 0.0);  // still rounds to the largest float
  EXPECT_EQ(files::Evaluator<float>(weights).mlp().layers[1].weights[0], std::numeric_limits<float>::max());
  weights.layers[1].weights[0] = -0x1.ffffffp127;
  EXPECT_TRUE(tests::refuses([&] { files::Evaluator<float>{weights}; }, {"fc2.weight", "float32"}));
  EXPECT_NO_THROW(files::Evaluator<double>{weights});
}

}  // namespace
}  // namespace swarmcert
