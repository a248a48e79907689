#include "nn/deep_set.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include "random_network.h"

namespace swarmcert::nn {
namespace {

constexpr int kCapacity = 8;
constexpr int kInputs = 6;
constexpr int kHidden = 20;

/// The networks, and the arrays needed to evaluate their deep set.
template <typename Scalar>
class Fixture {
 public:
  Fixture(const files::Weights& ground, const files::Weights& small, const files::Weights& large,
          const files::Weights& rho)
      : ground_(ground), small_(small), large_(large), rho_(rho) {}

  DeepSet<Scalar> set() const { return {&ground_mlp_, phi_.data(), 2, rho_.mlp(), nullptr, nullptr}; }

  DeepSetWorkspace<Scalar> workspace(const DeepSet<Scalar>& set) {
    scratch_.assign(static_cast<std::size_t>(scratch_size(set)), std::numeric_limits<Scalar>::quiet_NaN());
    return {inputs_.data(), order_.data(), kCapacity, sum_.data(), scratch_.data()};
  }

  /// Returns the result of an evaluation that must succeed.
  Scalar operator()(const std::vector<Neighbour<Scalar>>& neighbours) { return (*this)(set(), neighbours); }
  Scalar operator()(const DeepSet<Scalar>& set, const std::vector<Neighbour<Scalar>>& neighbours) {
    Scalar y = 0;
    EXPECT_EQ(status(set, neighbours, own.data(), y), DeepSetStatus::kOk);
    return y;
  }

  DeepSetStatus status(const DeepSet<Scalar>& set, const std::vector<Neighbour<Scalar>>& neighbours,
                       const Scalar* own_state, Scalar& y) {
    return evaluate(set, own_state, neighbours.data(), static_cast<int>(neighbours.size()), &y,
                    workspace(set));
  }

  std::array<Scalar, 4> own = {Scalar(-0.5), Scalar(0.25), Scalar(0.125), Scalar(-1)};

 private:
  files::Evaluator<Scalar> ground_, small_, large_, rho_;
  Mlp<Scalar> ground_mlp_ = ground_.mlp();
  std::array<Mlp<Scalar>, 2> phi_ = {small_.mlp(), large_.mlp()};
  std::array<Scalar, std::size_t{kCapacity} * kInputs> inputs_{};
  std::array<int, kCapacity> order_{};
  std::array<Scalar, kHidden> sum_{};
  std::vector<Scalar> scratch_;
};

class DeepSetTest : public testing::Test {
 protected:
  std::mt19937 generator_{7};
  files::Weights ground_ = tests::random_network({4, 25, 40, kHidden}, generator_);
  files::Weights small_ = tests::random_network({kInputs, 25, 40, 40, kHidden}, generator_);
  files::Weights large_ = tests::random_network({kInputs, 30, kHidden}, generator_);
  files::Weights rho_ = tests::random_network({kHidden, 40, 40, 1}, generator_);
  Fixture<float> f_{ground_, small_, large_, rho_};

  using Input = std::array<float, kInputs>;
  Input random_input() {
    Input x;
    for (float& entry : x) entry = tests::random_number(generator_);
    return x;
  }
  std::vector<Input> random_inputs(int count) {
    std::vector<Input> inputs(static_cast<std::size_t>(count));
    for (Input& x : inputs) x = random_input();
    return inputs;
  }
  /// Kinds alternate: 0, 1, 0, 1, ...
  static std::vector<Neighbour<float>> neighbours(const std::vector<Input>& inputs) {
    std::vector<Neighbour<float>> result;
    for (std::size_t j = 0; j < inputs.size(); ++j)
      result.push_back({inputs[j].data(), static_cast<int>(j % 2)});
    return result;
  }
  /// Returns the sum in the order of arrival, as computed by code without a canonical order.
  float in_order_of_arrival(const std::vector<Neighbour<float>>& arrived) {
    const files::Evaluator<float> phi[2] = {files::Evaluator<float>(small_), files::Evaluator<float>(large_)};
    std::vector<float> sum = files::Evaluator<float>(ground_)({f_.own.begin(), f_.own.end()});
    for (const Neighbour<float>& one : arrived) {
      const std::vector<float> hidden = phi[one.kind](std::vector<float>(one.input, one.input + kInputs));
      for (int i = 0; i < kHidden; ++i) sum[i] += hidden[i];
    }
    return files::Evaluator<float>(rho_)(sum)[0];
  }
};

TEST_F(DeepSetTest, EveryOrderOfArrivalGivesTheSameBits) {
  for (int count = 1; count <= 6; ++count) {
    const std::vector<Input> inputs = random_inputs(count);
    const std::vector<Neighbour<float>> original = neighbours(inputs);
    std::set<std::uint32_t> results;
    std::set<std::uint32_t> results_without;
    std::vector<int> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 0);
    int permutations = 0;
    do {
      std::vector<Neighbour<float>> arrived;
      arrived.reserve(order.size());
      for (const int j : order) arrived.push_back(original[static_cast<std::size_t>(j)]);
      results.insert(bits(f_(arrived)));
      results_without.insert(bits(in_order_of_arrival(arrived)));
      ++permutations;
    } while (std::next_permutation(order.begin(), order.end()));
    EXPECT_EQ(results.size(), 1u) << count << " neighbours, " << permutations << " orders";
    if (count == 6) {
      EXPECT_EQ(permutations, 720);
      EXPECT_GT(results_without.size(), 1u) << "the canonical order is not needed for this example";
    }
  }
}

TEST_F(DeepSetTest, TheGroundIsSummedFirstThenKindsByIndex) {
  const std::vector<Input> inputs = random_inputs(2);
  const std::vector<Neighbour<float>> by_kind = {{inputs[0].data(), 0}, {inputs[1].data(), 1}};
  EXPECT_EQ(bits(f_({by_kind[1], by_kind[0]})), bits(in_order_of_arrival(by_kind)));
}

TEST_F(DeepSetTest, ItIsZeroAmongExactlyTheNeighboursThatSilentListsInAnyOrderAndElsewhereTheSame) {
  constexpr std::array<int, 4> kSilent = {1, 2, 0, 1};  // kinds {0, 1, 1} and {1}
  DeepSet<float> set = f_.set();
  set.silent = kSilent.data();
  set.num_silent = 2;
  const std::vector<Input> inputs = random_inputs(4);
  int silent = 0;
  for (int count = 0; count <= 4; ++count) {
    for (unsigned kinds = 0; kinds < 1u << count; ++kinds) {  // each neighbour takes every kind
      std::vector<Neighbour<float>> some;
      int ones = 0;
      for (int j = 0; j < count; ++j) {
        some.push_back({inputs[static_cast<std::size_t>(j)].data(), static_cast<int>(kinds >> j & 1)});
        ones += some.back().kind;
      }
      const bool is_silent = (count == 3 && ones == 2) || (count == 1 && ones == 1);
      silent += is_silent ? 1 : 0;
      EXPECT_EQ(bits(f_(set, some)), is_silent ? bits(0.0f) : bits(f_(some))) << count << " " << kinds;
    }
  }
  EXPECT_EQ(silent, 4);
  // A silent set still rejects invalid inputs.
  float y = 1;
  EXPECT_EQ(f_.status(set, {{inputs[0].data(), 2}}, f_.own.data(), y), DeepSetStatus::kUnknownKind);
  Input broken = inputs[0];
  broken[3] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(f_.status(set, {{broken.data(), 1}}, f_.own.data(), y), DeepSetStatus::kInputNotFinite);
}

TEST_F(DeepSetTest, EqualNeighboursAreInterchangeable) {
  const Input a = random_input();
  const Input same = a;
  const Input b = random_input();
  const float y = f_({{a.data(), 0}, {b.data(), 0}, {same.data(), 0}});
  EXPECT_EQ(bits(f_({{same.data(), 0}, {a.data(), 0}, {b.data(), 0}})), bits(y));
}

TEST_F(DeepSetTest, ZerosOfBothSignsHaveAnOrder) {
  Input plus = random_input();
  plus[0] = 0.0f;
  Input minus = plus;
  minus[0] = -0.0f;
  const float y = f_({{plus.data(), 0}, {minus.data(), 0}});
  EXPECT_EQ(bits(f_({{minus.data(), 0}, {plus.data(), 0}})), bits(y));
}

TEST_F(DeepSetTest, WithoutNeighboursOnlyTheGroundActs) {
  EXPECT_EQ(bits(f_({})), bits(in_order_of_arrival({})));
}

TEST_F(DeepSetTest, WithoutNeighboursAndGroundItIsRhoOfZero) {
  DeepSet<float> set = f_.set();
  set.ground = nullptr;
  float y = 1;
  EXPECT_EQ(f_.status(set, {}, nullptr, y), DeepSetStatus::kOk);
  EXPECT_EQ(y, files::Evaluator<float>(rho_)(std::vector<float>(kHidden, 0.0f))[0]);
}

TEST_F(DeepSetTest, ClampIsAppliedBeforePhi) {
  const Input lower = {-0.5f, -0.5f, -0.5f, -0.5f, -0.5f, -0.5f};
  const Input upper = {0.25f, 0.25f, 0.25f, 0.25f, 0.25f, 0.25f};
  DeepSet<float> clamped = f_.set();
  clamped.lower = lower.data();
  clamped.upper = upper.data();
  const Input far = {-3, 9, 0.125f, 1e30f, -1e30f, 0.25f};
  const Input near = {-0.5f, 0.25f, 0.125f, 0.25f, -0.5f, 0.25f};
  EXPECT_EQ(bits(f_(clamped, {{far.data(), 0}})), bits(f_({{near.data(), 0}})));
}

TEST_F(DeepSetTest, OrderIsThatOfClampedInputs) {
  // Without the clamp, `high` would come after `middle`; with it, before. The result is that of the clamped set.
  const Input lower = {-1, -1, -1, -1, -1, -1};
  const Input upper = {0.5f, 1, 1, 1, 1, 1};
  DeepSet<float> clamped = f_.set();
  clamped.lower = lower.data();
  clamped.upper = upper.data();
  int compared = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Input> inputs = random_inputs(4);
    for (Input& x : inputs) x[0] = std::abs(x[0]) + 0.25f;
    std::vector<Input> already = inputs;
    for (Input& x : already) x[0] = std::min(x[0], 0.5f);
    EXPECT_EQ(bits(f_(clamped, neighbours(inputs))), bits(f_(neighbours(already))));
    compared += inputs != already ? 1 : 0;
  }
  EXPECT_GT(compared, 100);
}

TEST_F(DeepSetTest, BadInputsGiveAStatusAndZero) {
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity()};
  const Input lower = {-1, -1, -1, -1, -1, -1};
  const Input upper = {1, 1, 1, 1, 1, 1};
  for (const bool is_clamped : {false, true}) {
    DeepSet<float> set = f_.set();
    if (is_clamped) set.lower = lower.data(), set.upper = upper.data();
    for (const float value : bad) {
      for (std::size_t i = 0; i < kInputs; ++i) {
        Input x = random_input();
        x[i] = value;
        float y = 1;
        EXPECT_EQ(f_.status(set, {{x.data(), 1}}, f_.own.data(), y), DeepSetStatus::kInputNotFinite);
        EXPECT_EQ(y, 0.0f);
      }
      for (std::size_t i = 0; i < f_.own.size(); ++i) {
        std::array<float, 4> own = f_.own;
        own[i] = value;
        float y = 1;
        EXPECT_EQ(f_.status(set, {}, own.data(), y), DeepSetStatus::kInputNotFinite);
        EXPECT_EQ(y, 0.0f);
      }
    }
  }
}

TEST_F(DeepSetTest, UnknownKindsGiveAStatusAndZero) {
  const Input x = random_input();
  for (const int kind : {-1, 2, std::numeric_limits<int>::max()}) {
    float y = 1;
    EXPECT_EQ(f_.status(f_.set(), {{x.data(), kind}}, f_.own.data(), y), DeepSetStatus::kUnknownKind);
    EXPECT_EQ(y, 0.0f);
  }
}

TEST_F(DeepSetTest, MoreNeighboursThanTheWorkspaceHoldsGiveAStatusAndZero) {
  const std::vector<Input> inputs = random_inputs(kCapacity + 1);
  std::vector<Neighbour<float>> all = neighbours(inputs);
  float y = 1;
  EXPECT_EQ(f_.status(f_.set(), all, f_.own.data(), y), DeepSetStatus::kTooManyNeighbours);
  EXPECT_EQ(y, 0.0f);
  y = 1;
  const DeepSet<float> set = f_.set();
  EXPECT_EQ(evaluate(set, f_.own.data(), all.data(), -1, &y, f_.workspace(set)),
            DeepSetStatus::kTooManyNeighbours);
  EXPECT_EQ(y, 0.0f);
  all.pop_back();
  EXPECT_EQ(f_.status(f_.set(), all, f_.own.data(), y), DeepSetStatus::kOk);
}

TEST_F(DeepSetTest, AnOverflowInsideGivesAStatusAndZero) {
  const Input x = {3e38f, 3e38f, 3e38f, 3e38f, 3e38f, 3e38f};
  const Input y0 = {-3e38f, 3e38f, -3e38f, 3e38f, -3e38f, 3e38f};
  float y = 1;
  EXPECT_EQ(f_.status(f_.set(), {{x.data(), 0}, {y0.data(), 1}}, f_.own.data(), y),
            DeepSetStatus::kOutputNotFinite);
  EXPECT_EQ(y, 0.0f);
}

/// A vector and a bound on the error of each of its float32 entries.
struct Enclosed {
  std::vector<double> value, error;
};

/// Higham, Accuracy and Stability of Numerical Algorithms, lemma 3.1: n roundings of relative size u <= 2^-24 change
/// a term by at most gamma(n) = n u / (1 - n u). Doubled where this test itself computes in double.
double gamma(int roundings) { return roundings * 0x1p-24 / (1 - roundings * 0x1p-24) * (1 + 1e-6); }

/// y_i = b_i + sum_j W_ij x_j: every term undergoes at most one product and `inputs` additions.
Enclosed propagate(const files::Weights& weights, Enclosed x) {
  for (std::size_t k = 0; k < weights.layers.size(); ++k) {
    const files::Layer& layer = weights.layers[k];
    Enclosed y;
    for (int i = 0; i < layer.outputs; ++i) {
      double value = layer.biases[i];
      double magnitude = std::abs(layer.biases[i]);
      double inherited = 0;
      for (int j = 0; j < layer.inputs; ++j) {
        const double w = layer.weights[i * layer.inputs + j];
        value += w * x.value[j];
        magnitude += std::abs(w) * (std::abs(x.value[j]) + x.error[j]);
        inherited += std::abs(w) * x.error[j];
      }
      const bool is_last = k + 1 == weights.layers.size();
      y.value.push_back(is_last ? value : std::max(value, 0.0));
      y.error.push_back(inherited + gamma(layer.inputs + 1) * magnitude);
    }
    x = y;
  }
  return x;
}

TEST_F(DeepSetTest, FloatAgreesWithDoubleUpToTheRoundingBound) {
  Fixture<double> exact{ground_, small_, large_, rho_};
  for (int trial = 0; trial < 100; ++trial) {
    const std::vector<Input> inputs = random_inputs(5);
    const std::vector<Neighbour<float>> all = neighbours(inputs);
    std::vector<std::array<double, kInputs>> wide(inputs.size());
    std::vector<Neighbour<double>> all_wide;
    const Enclosed ground =
        propagate(ground_, {{exact.own.begin(), exact.own.end()}, std::vector<double>(4, 0)});
    Enclosed sum = ground;
    std::vector<double> magnitude(kHidden, 0);
    for (int i = 0; i < kHidden; ++i) magnitude[i] = std::abs(sum.value[i]) + sum.error[i];
    for (std::size_t j = 0; j < inputs.size(); ++j) {
      std::copy(inputs[j].begin(), inputs[j].end(), wide[j].begin());
      all_wide.push_back({wide[j].data(), all[j].kind});
      const Enclosed hidden = propagate(all[j].kind == 0 ? small_ : large_,
                                        {{wide[j].begin(), wide[j].end()}, std::vector<double>(kInputs, 0)});
      for (int i = 0; i < kHidden; ++i) {
        sum.value[i] += hidden.value[i];
        sum.error[i] += hidden.error[i];
        magnitude[i] += std::abs(hidden.value[i]) + hidden.error[i];
      }
    }
    for (int i = 0; i < kHidden; ++i) sum.error[i] += gamma(static_cast<int>(inputs.size())) * magnitude[i];
    const Enclosed y = propagate(rho_, sum);

    const double as_double = exact(all_wide);
    const double as_float = static_cast<double>(f_(all));
    EXPECT_NEAR(as_double, y.value[0], 1e-10 * std::abs(y.value[0]) + 1e-9);
    EXPECT_LE(std::abs(as_float - as_double), y.error[0]);
    EXPECT_LE(y.error[0], 0.02) << "the bound says nothing";
    EXPECT_LE(std::abs(as_float - as_double), 1e-6);
  }
}

}  // namespace
}  // namespace swarmcert::nn
