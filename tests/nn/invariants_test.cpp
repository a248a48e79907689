#include "nn/invariants.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "nn/deep_set.h"
#include "random_network.h"

namespace swarmcert::nn {
namespace {

using State = std::array<double, kRelativeState>;
using Invariants = std::array<double, kNeighbourInvariants>;

Invariants of(const State& state) {
  Invariants result;
  neighbour_invariants(state.data(), result.data());
  return result;
}

template <typename Vector>
double distance(const Vector& a, const Vector& b) {
  double square = 0;
  for (std::size_t k = 0; k < a.size(); ++k) square += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(square);
}

/// Returns the state rotated about the vertical, after a reflection in the plane y = 0 if `mirrored`.
template <typename Scalar>
std::array<Scalar, 6> turned(std::array<Scalar, 6> state, Scalar cosine, Scalar sine, bool mirrored) {
  for (const std::size_t x : {0u, 3u}) {
    const Scalar y = mirrored ? -state[x + 1] : state[x + 1], old = state[x];
    state[x] = cosine * old - sine * y;
    state[x + 1] = sine * old + cosine * y;
  }
  return state;
}

class InvariantsTest : public testing::Test {
 protected:
  State random_state(double scale) {
    State state;
    for (double& x : state) x = scale * static_cast<double>(tests::random_number(generator_));
    return state;
  }

  std::mt19937 generator_{3};
};

TEST_F(InvariantsTest, NoPairChangesByMoreThanTheStatedSlopesAndBothAreAttained) {
  double steepest = 0, steepest_own = 0;
  for (int i = 0; i < 200000; ++i) {
    const State x = random_state(1);
    State y = random_state(std::exp2(-(i % 20)));
    for (std::size_t k = 0; k < y.size(); ++k) y[k] += x[k];
    const double slope = distance(of(x), of(y)) / distance(x, y);
    ASSERT_LE(slope, kNeighbourInvariantsSlope * (1 + 1e-9));
    steepest = std::max(steepest, slope);
    std::array<double, kOwnInvariants> a, b;
    own_invariants(x.data(), a.data());
    own_invariants(y.data(), b.data());
    const std::array<double, 4> own_x = {x[0], x[1], x[2], x[3]}, own_y = {y[0], y[1], y[2], y[3]};
    const double own_slope = distance(a, b) / distance(own_x, own_y);
    ASSERT_LE(own_slope, kOwnInvariantsSlope * (1 + 1e-9));
    steepest_own = std::max(steepest_own, own_slope);
  }
  EXPECT_GT(steepest, 1.45);
  EXPECT_GT(steepest_own, 0.999);
  // The constant is attained along (p, v) = (2, 1) in one direction, and along the vertical.
  EXPECT_NEAR(distance(of({10, 0, 0, 10, 0, 0}), of({12, 0, 0, 11, 0, 0})) / std::sqrt(5.0), 1.5, 1e-12);
  EXPECT_EQ(distance(of({1, 1, 0, 1, 1, 0}), of({1, 1, 2, 1, 1, 0})), 3);
}

TEST_F(InvariantsTest, NothingButATurnAndAReflectionIsLost) {
  for (int i = 0; i < 1000; ++i) {
    const State s = random_state(1);
    const Invariants y = of(s);
    // |p + v / 2|^2 = |p|^2 + p.v + |v|^2 / 4
    const double product = y[4] * y[4] - y[0] * y[0] - y[2] * y[2] / 4;
    EXPECT_NEAR(product, s[0] * s[3] + s[1] * s[4], 1e-12);
    EXPECT_NEAR(y[1] / 1.5, s[2], 1e-15);
    EXPECT_NEAR(y[3] / 1.5, s[5], 1e-15);
  }
}

TEST_F(InvariantsTest, RootsAreCorrectlyRounded) {
  for (int i = 0; i < 100000; ++i) {
    const float x = std::abs(tests::random_number(generator_)) * std::exp2(static_cast<float>(i % 60 - 30));
    // The square root of a float computed in double and rounded to float is correctly rounded, since 53 >= 2 * 24 + 2.
    ASSERT_EQ(square_root(x), static_cast<float>(std::sqrt(static_cast<double>(x)))) << x;
    ASSERT_EQ(square_root(static_cast<double>(x)), std::sqrt(static_cast<double>(x)));
  }
  EXPECT_EQ(square_root(std::numeric_limits<float>::infinity()), std::numeric_limits<float>::infinity());
}

/// A deep set of invariants in float, and the arrays needed to evaluate it.
class SetOfInvariants {
 public:
  explicit SetOfInvariants(std::mt19937& generator)
      : ground_(tests::random_network({kOwnInvariants, 9, 8}, generator)),
        phi_(tests::random_network({kNeighbourInvariants, 11, 8}, generator)),
        rho_(tests::random_network({8, 12, 1}, generator)) {}

  DeepSet<float> set() const { return {&ground_mlp_, &phi_mlp_, 1, rho_.mlp(), nullptr, nullptr, true}; }

  DeepSetStatus operator()(const std::array<float, 4>& own, const std::vector<std::array<float, 6>>& states,
                           float& force) {
    std::vector<Neighbour<float>> neighbours;
    for (const auto& state : states) neighbours.push_back({state.data(), 0});
    std::vector<float> scratch(static_cast<std::size_t>(scratch_size(set())));
    return evaluate(set(), own.data(), neighbours.data(), static_cast<int>(neighbours.size()), &force,
                    {inputs_.data(), order_.data(), 4, sum_.data(), scratch.data()});
  }

 private:
  files::Evaluator<float> ground_, phi_, rho_;
  Mlp<float> ground_mlp_ = ground_.mlp(), phi_mlp_ = phi_.mlp();
  std::array<float, 4 * std::size_t{kNeighbourInvariants}> inputs_{};
  std::array<int, 4> order_{};
  std::array<float, 8> sum_{};
};

TEST_F(InvariantsTest, ASetOfThemGivesTheSameBitsAfterQuarterTurnsAndReflectionsAndTheSameForceAfterAnyTurn) {
  SetOfInvariants set(generator_);
  EXPECT_TRUE(fits_together(set.set()));
  EXPECT_EQ(set.set().inputs(), kRelativeState);
  EXPECT_EQ(set.set().own_inputs(), kOwnState);
  float largest_change = 0;
  for (int i = 0; i < 1000; ++i) {
    std::array<float, 4> own;
    for (float& x : own) x = tests::random_number(generator_);
    std::vector<std::array<float, 6>> states(static_cast<std::size_t>(i % 4));
    for (auto& state : states)
      for (float& x : state) x = 2 * tests::random_number(generator_);
    float force = 0, same = 0;
    ASSERT_EQ(set(own, states, force), DeepSetStatus::kOk);
    const auto after = [&](float cosine, float sine, bool mirrored) {
      const auto seen = turned<float>({own[1], own[2], 0, 0, 0, 0}, cosine, sine, mirrored);
      auto moved = states;
      for (auto& state : moved) state = turned(state, cosine, sine, mirrored);
      EXPECT_EQ(set({own[0], seen[0], seen[1], own[3]}, moved, same), DeepSetStatus::kOk);
      return same;
    };
    for (const bool mirrored : {false, true}) {
      for (const auto& [cosine, sine] : {std::pair{1.0f, 0.0f}, {0.0f, 1.0f}, {-1.0f, 0.0f}, {0.0f, -1.0f}})
        ASSERT_EQ(after(cosine, sine, mirrored), force);
      const float angle = 3.1f * tests::random_number(generator_);
      EXPECT_NEAR(after(std::cos(angle), std::sin(angle), mirrored), force, 2e-5f);
    }
    std::swap(own[0], own[3]);
    set(own, states, same);
    largest_change = std::max(largest_change, std::abs(same - force));
  }
  EXPECT_GT(largest_change, 0.1f) << "the network says something";
}

TEST_F(InvariantsTest, ASetOfThemRefusesInputsThatAreNotFiniteOrWhoseSquaresOverflow) {
  SetOfInvariants set(generator_);
  for (std::size_t k = 0; k < 6; ++k) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 3e38f}) {
      std::array<float, 6> state = {1, 1, 1, 1, 1, 1};
      state[k] = bad;
      float force = 1;
      EXPECT_EQ(set({0, 0, 0, 0}, {state}, force), DeepSetStatus::kInputNotFinite) << k << " " << bad;
      EXPECT_EQ(force, 0);
      if (k >= 4 || (bad == 3e38f && k % 3 == 0)) continue;  // only the vehicle's height is not squared
      std::array<float, 4> own = {0, 0, 0, 0};
      own[k] = bad;
      EXPECT_EQ(set(own, {}, force), DeepSetStatus::kInputNotFinite) << k << " " << bad;
    }
  }
}

TEST_F(InvariantsTest, ASetOfThemFitsTogetherOnlyWithAsManyInputsAsThereAreInvariants) {
  SetOfInvariants networks(generator_);
  DeepSet<float> set = networks.set();
  const files::Evaluator<float> six(tests::random_network({6, 4, 8}, generator_));
  const Mlp<float> other = six.mlp();
  set.phi = &other;
  EXPECT_FALSE(fits_together(set));
  set = networks.set();
  set.ground = &other;
  EXPECT_FALSE(fits_together(set));
  set.ground = nullptr;
  EXPECT_TRUE(fits_together(set));
  EXPECT_EQ(set.own_inputs(), 0);
}

}  // namespace
}  // namespace swarmcert::nn
