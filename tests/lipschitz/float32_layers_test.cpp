// Round-off of layers in float32 by the loop of the flight code and its propagation to the outputs, compared with exact
// arithmetic.
#include "lipschitz/values/float32_layers.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "lipschitz/networks.h"
#include "nn/base/random.h"
#include "nn/dense_layer.h"

namespace swarmcert {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using files::Random;
using lipschitz::Reach;
using lipschitz::ReachNetwork;

/// A layer of one output.
struct Sum {
  std::vector<float> weights;
  float bias = 0;

  lipschitz::ReachLayer layer() const {
    lipschitz::ReachLayer result;
    result.weights = Eigen::Map<const Eigen::RowVectorXf>(weights.data(), static_cast<Index>(weights.size()))
                         .cast<double>();
    result.bias = VectorXd::Constant(1, static_cast<double>(bias));
    result.bias_radius = VectorXd::Zero(1);
    return result;
  }
  /// Returns |float32 value - exact value| at h, computed by the loop of the flight code.
  double off(const std::vector<float>& h) const {
    const nn::DenseLayer<float> layer{weights.data(), &bias, 1, static_cast<int>(weights.size())};
    float computed = 0;
    nn::apply<1>(layer, h.data(), &computed, nn::Activation::kNone);
    mpq_class exact(static_cast<double>(bias));
    for (std::size_t j = 0; j < h.size(); ++j)
      exact += mpq_class(static_cast<double>(weights[j])) * mpq_class(static_cast<double>(h[j]));
    return mpq_class(abs(mpq_class(static_cast<double>(computed)) - exact)).get_d();
  }
};

Sum random_sum(int inputs, double scale, Random& random) {
  Sum sum;
  for (int j = 0; j < inputs; ++j) sum.weights.push_back(static_cast<float>(scale * random.symmetric()));
  sum.bias = static_cast<float>(scale * scale * random.symmetric());  // as large as a product
  return sum;
}

double bound(const Sum& sum, const VectorXd& lower, const VectorXd& upper) {
  return lipschitz::layer_rounding(sum.layer(), lower, upper)(0);
}

/// Climbs to points of increasing error, for sums of ordinary size and close to underflow.
TEST(LayerRounding, IsNeverExceededByWhatFlies) {
  Random random(5);
  for (const double scale : {1.0, 0x1p-70}) {
    double closest = 0;
    for (int round = 0; round < 60; ++round) {
      const int inputs = 1 + static_cast<int>(random.below(40));
      const Sum sum = random_sum(inputs, scale, random);
      VectorXd lower(inputs), upper(inputs);
      for (Index j = 0; j < inputs; ++j) {
        lower(j) = scale * random.symmetric();
        upper(j) = random.below(4) == 0 ? lower(j) : lower(j) + scale * random.uniform();
        if (random.below(4) == 0) lower(j) = upper(j) = 0;
      }
      const double at_most = bound(sum, lower, upper);
      std::vector<float> best;
      double furthest = -1;
      for (int step = 0; step < 400; ++step) {
        std::vector<float> h;
        for (Index j = 0; j < inputs; ++j) {
          const bool moves = best.empty() || random.below(4) == 0;
          auto x = moves ? static_cast<float>(lower(j) + random.uniform() * (upper(j) - lower(j)))
                         : best[static_cast<std::size_t>(j)];
          if (static_cast<double>(x) < lower(j)) x = std::nextafter(x, INFINITY);
          if (static_cast<double>(x) > upper(j)) x = std::nextafter(x, -INFINITY);
          h.push_back(x);
        }
        if (!((Eigen::Map<Eigen::VectorXf>(h.data(), inputs).cast<double>() - lower).minCoeff() >= 0))
          continue;
        const double off = sum.off(h);
        ASSERT_LE(off, at_most);
        if (off > furthest) furthest = off, best = h;
      }
      if (at_most > 0) closest = std::max(closest, furthest / at_most);
    }
    EXPECT_GT(closest, 0.2) << scale;  // some sums come close to the bound
  }
}

TEST(LayerRounding, CountsNeitherProductsWithZeroNorTheirAdditions) {
  Sum sum{{3, -5, 7}, 0.1f};
  const VectorXd zero = VectorXd::Zero(3);
  EXPECT_EQ(bound(sum, zero, zero), 0);
  VectorXd one = zero;
  one(1) = 1;
  const double with_one = bound(sum, zero, one);
  sum.weights = {3e6f, -5, 7e6f};
  EXPECT_EQ(bound(sum, zero, one), with_one);
}

TEST(HalfFloatStep, IsNeverExceededAndAttainedHalfwayBetweenFloats) {
  Random random(4);
  for (int sample = 0; sample < 20000; ++sample) {
    const double x = std::ldexp(random.symmetric(), static_cast<int>(random.below(280)) - 160);
    const double off = std::abs(static_cast<double>(static_cast<float>(x)) - x);
    ASSERT_LE(off, lipschitz::half_float_step(std::abs(x))) << x;
    const auto near = static_cast<float>(std::abs(x));
    const double next = static_cast<double>(std::nextafter(near, INFINITY)), here = static_cast<double>(near);
    EXPECT_EQ(lipschitz::half_float_step(here), (next - here) / 2);
  }
  EXPECT_EQ(lipschitz::half_float_step(0), 0x1p-150);
}

/// 1 - 1 + tiny: a bound for any order of summation allows errors relative to 1, a bound for this order does not.
TEST(LayerRounding, TakesPartialSumsAsTheyAreAdded) {
  const Sum sum{{-1, 0x1p-30f}, 1};
  const VectorXd ones = VectorXd::Ones(2);
  EXPECT_LE(bound(sum, ones, ones), 0x1p-50);  // the products are exact, the sums are 0 and 2^-30
  const Sum other{{0x1p-30f, -1}, 1};
  EXPECT_GE(bound(other, ones, ones), 0x1p-24);
  EXPECT_GE(bound(other, ones, ones), other.off({1, 1}));
  EXPECT_GT(other.off({1, 1}), 0);
}

TEST(LayerRounding, IsInfiniteWhereFloat32MightOverflow) {
  const Sum sum{{0x1p100f}, 0};
  EXPECT_TRUE(std::isinf(bound(sum, VectorXd::Zero(1), VectorXd::Constant(1, 0x1p27))));
  EXPECT_TRUE(std::isfinite(bound(sum, VectorXd::Zero(1), VectorXd::Constant(1, 0x1p20))));
}

TEST(LayerRounding, CountsNoProductWithAPowerOfTwoAndNoFirstAdditionToABiasOfZero) {
  const VectorXd ones = VectorXd::Ones(1);
  EXPECT_LE(bound({{4}, 0}, -ones, ones), 0x1p-149);
  EXPECT_GE(bound({{3}, 0}, -ones, ones), 0x1p-23);  // of the product alone, between 2 and 4
  EXPECT_LE(bound({{3}, 0}, -ones, ones), 1.001 * 0x1p-23);
  EXPECT_GE(bound({{3}, 2}, -ones, ones), 3 * 0x1p-23);  // and of the sum, between 4 and 8
}

/// h = (x, x, x, ...) with weights 1, -1, 1, ...: the sums alternate between x and 0, which intervals cannot represent.
TEST(LayerRounding, KnowsWhatTheTermsOfAPartialSumHaveInCommon) {
  constexpr Index kInputs = 20;
  Sum sum;
  for (Index j = 0; j < kInputs; ++j) sum.weights.push_back(j % 2 == 0 ? 1.0f : -1.0f);
  const VectorXd ones = VectorXd::Ones(kInputs);
  const lipschitz::AffineForms forms{MatrixXd::Ones(kInputs, 1), VectorXd::Zero(kInputs),
                                     VectorXd::Zero(kInputs)};
  const double u = 0x1p-24;
  const double with_forms = lipschitz::layer_rounding(sum.layer(), -ones, ones, &forms)(0);
  // Products are exact, and so are the first sum and every other one that follows.
  EXPECT_NEAR(with_forms, (kInputs / 2 - 1) * u, 1e-4 * u);
  double by_intervals = 0;
  for (Index j = 2; j <= kInputs; ++j) by_intervals += lipschitz::half_float_step(static_cast<double>(j));
  EXPECT_GE(bound(sum, -ones, ones), by_intervals);
}

/// The layers in exact arithmetic, up to the round-off of double, and by the loop of the flight code.
struct BothWays {
  std::vector<VectorXd> exact, computed;

  BothWays(const ReachNetwork& network, const VectorXd& x) {
    VectorXd h = x;
    std::vector<float> flown(x.data(), x.data() + x.size());
    for (const lipschitz::ReachLayer& layer : network) {
      const VectorXd y = layer.weights * h + layer.bias;
      exact.push_back(y);
      h = layer.has_relu ? VectorXd(y.cwiseMax(0.0)) : y;
      flown = flown_layer(layer, flown);
      computed.push_back(Eigen::Map<const Eigen::VectorXf>(flown.data(), y.size()).cast<double>());
      for (float& value : flown)
        if (layer.has_relu) value = std::max(value, 0.0f);
    }
  }

 private:
  static std::vector<float> flown_layer(const lipschitz::ReachLayer& layer, const std::vector<float>& h) {
    const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> weights =
        layer.weights.cast<float>();
    const Eigen::VectorXf biases = layer.bias.cast<float>();
    std::vector<float> y(static_cast<std::size_t>(biases.size()));
    nn::apply<1>(nn::DenseLayer<float>{weights.data(), biases.data(), static_cast<int>(weights.rows()),
                                       static_cast<int>(weights.cols())},
                 h.data(), y.data(), nn::Activation::kNone);
    return y;
  }
};

/// Returns a random network whose weights are float32 numbers.
ReachNetwork float32_network(std::mt19937& generator) {
  ReachNetwork network = lipschitz::reach_network(tests::random_network({3, 8, 10, 6, 2}, generator));
  for (lipschitz::ReachLayer& layer : network) {
    layer.weights = layer.weights.cast<float>().cast<double>();
    layer.bias = layer.bias.cast<float>().cast<double>();
  }
  return network;
}

TEST(LayerErrors, AreNeverExceededAndFormsHoldInEveryLayer) {
  std::mt19937 generator(8);
  Random random(9);
  double closest = 0;
  for (int round = 0; round < 40; ++round) {
    const ReachNetwork network = float32_network(generator);
    const double half = std::exp2(-static_cast<double>(random.below(12)));
    lipschitz::Box box;
    for (int k = 0; k < 3; ++k) {
      const double middle = random.symmetric();
      box.lower.push_back(middle - half);
      box.upper.push_back(middle + half * random.uniform());
    }
    const Reach reach(network, box);
    const lipschitz::LayerErrors errors = lipschitz::layer_errors(network, reach, VectorXd::Zero(3));
    std::vector<lipschitz::AffineForms> forms;
    lipschitz::AffineForms h = lipschitz::forms_of(box);
    for (std::size_t k = 0; k < network.size(); ++k) {
      forms.push_back(lipschitz::layer_forms(network[k], h));
      h = lipschitz::relu_forms(forms.back(), reach.before_relu(k));
    }
    for (int sample = 0; sample < 300; ++sample) {
      VectorXd x(3), xi(3);
      for (Index j = 0; j < 3; ++j) {
        const auto i = static_cast<std::size_t>(j);
        const double width = box.upper[i] - box.lower[i];
        x(j) =
            static_cast<double>(static_cast<float>(box.lower[i] + width * (0.01 + 0.98 * random.uniform())));
        xi(j) = (x(j) - box.lower[i] - width / 2) / (width / 2);
      }
      const BothWays values(network, x);
      for (std::size_t k = 0; k < network.size(); ++k) {
        const VectorXd off = (values.computed[k] - values.exact[k]).cwiseAbs();
        ASSERT_TRUE((off.array() <= errors.total[k].array() + 1e-14).all());
        closest = std::max(closest, (off.array() / errors.total[k].array()).maxCoeff());
        const VectorXd beside = values.exact[k] - forms[k].centre - forms[k].slopes * xi;
        ASSERT_TRUE((beside.cwiseAbs().array() <= forms[k].radius.array() + 1e-12).all());
        const lipschitz::Bounds both = lipschitz::within(reach.before_relu(k), forms[k]);
        ASSERT_TRUE((values.exact[k].array() >= both.lower.array() - 1e-12).all());
        ASSERT_TRUE((values.exact[k].array() <= both.upper.array() + 1e-12).all());
      }
    }
  }
  EXPECT_GT(closest, 0.3) << "the samples are not close to the bounds: the test shows nothing";
}

TEST(AffineForms, AreTheValuesAtAPointAndNotFiniteWhereTheBoundsAreNot) {
  std::mt19937 generator(10);
  const ReachNetwork network = float32_network(generator);
  const VectorXd x = VectorXd::LinSpaced(3, -0.5, 0.75);
  const lipschitz::Box point{{x(0), x(1), x(2)}, {x(0), x(1), x(2)}};
  const Reach reach(network, point);
  const BothWays values(network, x);
  lipschitz::AffineForms h = lipschitz::forms_of(point);
  for (std::size_t k = 0; k < network.size(); ++k) {
    const lipschitz::AffineForms y = lipschitz::layer_forms(network[k], h);
    EXPECT_LT((y.centre - values.exact[k]).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT(y.deviation().maxCoeff(), 1e-9);
    h = lipschitz::relu_forms(y, reach.before_relu(k));
  }
  lipschitz::Bounds bounds = reach.before_relu(0);
  bounds.lower(0) = -INFINITY;
  bounds.upper(0) = INFINITY;
  const lipschitz::AffineForms unknown =
      lipschitz::relu_forms(lipschitz::layer_forms(network[0], lipschitz::forms_of(point)), bounds);
  EXPECT_FALSE(unknown.all_finite());
}

/// Returns d y_K / d y_k at x for k = 0 .. K.
std::vector<RowVectorXd> derivatives(const ReachNetwork& network, VectorXd h) {
  std::vector<VectorXd> before;
  for (const lipschitz::ReachLayer& layer : network) {
    before.emplace_back(layer.weights * h + layer.bias);
    h = before.back().cwiseMax(0.0);
  }
  std::vector<RowVectorXd> result(network.size());
  RowVectorXd row = RowVectorXd::Ones(1);
  for (std::size_t k = network.size(); k-- > 0;) {
    if (k + 1 < network.size()) {
      row = (row * network[k + 1].weights).eval();
      for (Index i = 0; i < row.size(); ++i)
        if (before[k](i) < 0) row(i) = 0;
    }
    result[k] = row;
  }
  return result;
}

TEST(Sensitivities, AreNotBelowAnyDerivativeAndEqualItAtAPoint) {
  std::mt19937 generator(6);
  Random random(7);
  for (int round = 0; round < 10; ++round) {
    const ReachNetwork network = lipschitz::reach_network(tests::random_network({3, 8, 10, 6, 1}, generator));
    const lipschitz::Box box{{-0.5, -0.5, 0}, {0.25, 0.5, 1}};
    const Reach reach(network, box);
    const std::vector<MatrixXd> found =
        lipschitz::sensitivities(network, reach, lipschitz::layer_errors(network, reach, VectorXd::Zero(3)));
    ASSERT_EQ(found.size(), network.size());
    VectorXd x(3);
    for (int sample = 0; sample < 500; ++sample) {
      for (Index k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>(k);
        x(k) = box.lower[i] + random.uniform() * (box.upper[i] - box.lower[i]);
      }
      const std::vector<RowVectorXd> exact = derivatives(network, x);
      for (std::size_t k = 0; k < network.size(); ++k)
        ASSERT_TRUE((exact[k].cwiseAbs().array() <= found[k].row(0).array() + 1e-12).all());
    }
    const Reach point(network, {{x(0), x(1), x(2)}, {x(0), x(1), x(2)}});
    const std::vector<MatrixXd> there =
        lipschitz::sensitivities(network, point, lipschitz::layer_errors(network, point, VectorXd::Zero(3)));
    const std::vector<RowVectorXd> exact = derivatives(network, x);
    for (std::size_t k = 0; k < network.size(); ++k)
      EXPECT_LT((there[k].row(0) - exact[k].cwiseAbs()).cwiseAbs().maxCoeff(), 1e-9);
  }
}

}  // namespace
}  // namespace swarmcert
