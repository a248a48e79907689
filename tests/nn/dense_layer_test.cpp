#include "nn/dense_layer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "random_network.h"

namespace swarmcert::nn {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The definition: bias first, inputs ascending, one accumulator, each product rounded before the sum.
std::vector<float> by_definition(const std::vector<float>& weights, const std::vector<float>& biases,
                                 const std::vector<float>& x, Activation activation) {
  std::vector<float> y = biases;
  for (std::size_t i = 0; i < y.size(); ++i) {
    for (std::size_t j = 0; j < x.size(); ++j) {
      volatile const float product = weights[i * x.size() + j] * x[j];
      y[i] = y[i] + product;
    }
    if (activation == Activation::kRelu && y[i] < 0) y[i] = 0;
  }
  return y;
}

class DenseLayerTest : public testing::Test {
 protected:
  std::vector<float> random(std::size_t count) {
    std::vector<float> numbers(count);
    for (float& x : numbers) x = tests::random_number(generator_);
    return numbers;
  }

  /// Compares one layer in one layout, for `Together` inputs at once, with its definition.
  template <int Together>
  void expect_the_definition(Layout layout, int outputs, int inputs, bool with_strange_inputs) {
    const std::vector<float> rows = random(static_cast<std::size_t>(outputs) * inputs);
    const std::vector<float> biases = random(static_cast<std::size_t>(outputs));
    std::vector<float> blocks(rows.size());
    to_blocks(rows.data(), outputs, inputs, blocks.data());
    const DenseLayer<float> layer{layout == Layout::kRows ? rows.data() : blocks.data(), biases.data(),
                                  outputs, inputs, layout};
    std::vector<std::vector<float>> xs;
    std::vector<float> x(static_cast<std::size_t>(inputs) * Together);
    std::vector<float> y(static_cast<std::size_t>(outputs) * Together);
    for (std::size_t c = 0; c < Together; ++c) {
      xs.push_back(random(static_cast<std::size_t>(inputs)));
      const float strange[] = {kNaN, kInfinity, -kInfinity, 0x1p-149f, -0.0f};
      if (with_strange_inputs) xs.back()[generator_() % xs.back().size()] = strange[generator_() % 5];
      for (std::size_t j = 0; j < xs.back().size(); ++j) x[j * Together + c] = xs.back()[j];
    }
    for (const Activation activation : {Activation::kNone, Activation::kRelu}) {
      apply<Together>(layer, x.data(), y.data(), activation);
      for (std::size_t c = 0; c < Together; ++c) {
        const std::vector<float> expected = by_definition(rows, biases, xs[c], activation);
        for (std::size_t i = 0; i < expected.size(); ++i) {
          const float found = y[i * Together + c];
          if (expected[i] == expected[i]) {
            ASSERT_EQ(bits(found), bits(expected[i])) << outputs << " x " << inputs << ", output " << i;
          } else {
            ASSERT_FALSE(found == found) << outputs << " x " << inputs << ", output " << i;
            ++not_a_number_;
          }
          ++compared_;
        }
      }
    }
  }

  std::mt19937 generator_{11};
  long compared_ = 0, not_a_number_ = 0;
};

TEST_F(DenseLayerTest, EveryLayoutAndTileGivesTheBitsOfThePlainLoop) {
  for (int outputs = 1; outputs <= 41; ++outputs) {
    for (const int inputs : {1, 2, 3, 6, 7, 20, 25, 40}) {
      for (const Layout layout : {Layout::kRows, Layout::kBlocks}) {
        for (const bool strange : {false, true}) {
          expect_the_definition<1>(layout, outputs, inputs, strange);
          expect_the_definition<2>(layout, outputs, inputs, strange);
          expect_the_definition<3>(layout, outputs, inputs, strange);
        }
      }
    }
  }
  EXPECT_GT(compared_, 300000);
  EXPECT_GT(not_a_number_, 10000);
}

TEST_F(DenseLayerTest, BlocksHoldEachWeightOnce) {
  for (int outputs = 1; outputs <= 20; ++outputs) {
    std::vector<float> rows = random(static_cast<std::size_t>(outputs) * 5);
    std::vector<float> blocks(rows.size());
    to_blocks(rows.data(), outputs, 5, blocks.data());
    std::sort(rows.begin(), rows.end());
    std::sort(blocks.begin(), blocks.end());
    EXPECT_EQ(rows, blocks) << outputs;
  }
}

TEST_F(DenseLayerTest, BlocksAreEightOutputsSideBySideThenWhatIsLeftByPowersOfTwo) {
  std::vector<float> rows(std::size_t{15} * 2), blocks(rows.size());
  for (int i = 0; i < 15; ++i) {
    for (int j = 0; j < 2; ++j) rows[static_cast<std::size_t>(2 * i + j)] = static_cast<float>(10 * i + j);
  }
  to_blocks(rows.data(), 15, 2, blocks.data());
  EXPECT_EQ(blocks,
            (std::vector<float>{0,  10, 20, 30,  40,  50, 60, 70,  1,   11,  21,  31,  41,  51,  61,
                                71, 80, 90, 100, 110, 81, 91, 101, 111, 120, 130, 121, 131, 140, 141}));
}

}  // namespace
}  // namespace swarmcert::nn
