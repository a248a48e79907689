/// Bounds and certificates of networks with MaxMin or GroupSort between their layers.
#include <algorithm>
#include <cmath>

#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/lower/slope_estimate.h"
#include "lipschitz/networks.h"
#include "lipschitz/upper/bent_bound.h"
#include "nn/base/content_hash.h"
#include "nn/base/input_error.h"
#include "nn/weights/activation.h"

namespace swarmcert {
namespace {

using files::Activation;
using files::Json;
using files::Network;

const Activation kSorting[] = {Activation::kMaxMinHalves, Activation::kMaxMinPairs, files::group_sort(2),
                               files::group_sort(4), files::group_sort(8)};

files::Weights sorting(files::Weights weights, Activation activation) {
  tests::set_activation(weights, activation);
  return weights;
}

lipschitz::CertifyOptions few_rounds() {
  lipschitz::CertifyOptions options;
  options.lower.rounds = 1;
  options.jobs = 1;
  return options;
}

double distance(const std::vector<double>& x, const std::vector<double>& y) {
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - y[i]) * (x[i] - y[i]);
  return std::sqrt(sum);
}

TEST(Sorting, ActivationsAreThoseOfTheirDefinitions) {
  const std::vector<double> t = {3, -1, 4, 1, -5, 9, 2, -6};
  const auto expect = [&t](Activation activation, const std::vector<double>& expected) {
    EXPECT_EQ(files::activated(activation, t), expected) << files::function_of(activation).op;
  };
  expect(Activation::kMaxMinHalves, {3, 9, 4, 1, -5, -1, 2, -6});
  expect(Activation::kMaxMinPairs, {3, 4, 9, 2, -1, 1, -5, -6});
  expect(files::group_sort(2), {-1, 3, 1, 4, -5, 9, -6, 2});
  expect(files::group_sort(4), {-1, 1, 3, 4, -6, -5, 2, 9});
  expect(files::group_sort(8), {-6, -5, -1, 1, 2, 3, 4, 9});
  EXPECT_THROW(files::activated(files::group_sort(3), t), std::invalid_argument);
  EXPECT_THROW(files::group_sort(1), std::invalid_argument);
  EXPECT_THROW(files::group_sort(files::kLargestGroup + 1), std::invalid_argument);
}

TEST(Sorting, BoundsOfGroupsAreBelowTheProductAndAboveEverySampledSlope) {
  std::mt19937 generator(5);
  int slopes = 0;
  for (const Activation activation : kSorting) {
    const Network network =
        tests::plain(sorting(tests::random_network({3, 8, 16, 8, 2}, generator), activation));
    const auto found = certify(network, few_rounds());
    ASSERT_EQ(found.bounds.size(), 1U);
    const lipschitz::CertifiedBound& bound = found.bounds.front();
    EXPECT_EQ(bound.method, lipschitz::UpperMethod::kSdp) << files::function_of(activation).op;
    EXPECT_LT(bound.upper.value(), 0.95 * bound.product.value()) << files::function_of(activation).op;
    const files::Evaluator<double> f(*network.plain);
    for (int s = 0; s < 20000; ++s, ++slopes) {
      const double radius = std::exp2(-static_cast<double>(generator() % 12));
      std::vector<double> x(3), y(3);
      for (std::size_t i = 0; i < 3; ++i) {
        x[i] = 3 * static_cast<double>(tests::random_number(generator));
        y[i] = x[i] + radius * static_cast<double>(tests::random_number(generator));
      }
      ASSERT_LE(distance(f(x), f(y)), bound.upper.value() * distance(x, y) * (1 + 1e-9));
    }
    const double steepest = lipschitz::slope_estimate(network, bound, {}).value();  // climbs
    EXPECT_GT(steepest, 0.1 * bound.upper.value());
    EXPECT_LE(steepest, bound.upper.value() * (1 + 1e-9)) << files::function_of(activation).op;
  }
  EXPECT_EQ(slopes, 100000);
}

TEST(Sorting, TheProductIsAttainedByOrthogonalLayersAndBelowTheBoundThatReluGives) {
  const double c = 0.6, s = 0.8;
  const std::vector<double> turned = {c, -s, s, c};
  const files::Weights weights = tests::weights(
      {tests::layer(2, 2, turned), tests::layer(2, 2, turned), tests::layer(2, 2, {c, s, -s, c})});
  const Network network = tests::plain(sorting(weights, files::group_sort(2)));
  const auto found = certify(network, few_rounds());
  EXPECT_NEAR(found.bounds.front().upper.value(), 1, 1e-9);
  EXPECT_NEAR(lipschitz::slope_estimate(network, found.bounds.front(), {}).value(), 1, 1e-6);
  // max(a, b) = b + relu(a - b), min(a, b) = a - relu(a - b), where x = relu(x) - relu(-x).
  std::vector<double> into;
  for (const auto& [a, b] : {std::pair{1, -1}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}})
    for (std::size_t j = 0; j < 2; ++j) into.push_back(a * turned[j] + b * turned[2 + j]);
  const files::Weights relu =
      tests::weights({tests::layer(5, 2, into), tests::layer(2, 5, {-1, 1, -1, 0, 0, 1, 0, 0, 1, -1})});
  EXPECT_GT(certify(tests::plain(relu), few_rounds()).bounds.front().upper.value(), 1.2);
}

/// Increments of the inputs and of each hidden layer between two inputs, in the places of the chain.
std::vector<double> increments(const files::Weights& weights, const std::vector<double>& x,
                               const std::vector<double>& y) {
  std::vector<double> all;
  std::vector<double> a = x, b = y;
  for (std::size_t i = 0; i < x.size(); ++i) all.push_back(x[i] - y[i]);
  for (std::size_t k = 0; k + 1 < weights.layers.size(); ++k) {
    const files::Layer& layer = weights.layers[k];
    for (std::vector<double>* const h : {&a, &b}) {
      std::vector<double> next = layer.biases;
      for (int i = 0; i < layer.outputs; ++i)
        for (int j = 0; j < layer.inputs; ++j)
          next[static_cast<std::size_t>(i)] += layer.weights[static_cast<std::size_t>(i * layer.inputs + j)] *
                                               (*h)[static_cast<std::size_t>(j)];
      *h = files::activated(layer.activation, next);
    }
    for (std::size_t i = 0; i < a.size(); ++i) all.push_back(a[i] - b[i]);
  }
  return all;
}

double form(const check::SymmetricMatrix& p, const std::vector<double>& z) {
  double sum = 0;
  for (int i = 0; i < p.size(); ++i)
    for (int j = p.first(i); j <= i; ++j)
      sum += (i == j ? 1 : 2) * check::to_double(p.at(i, j)) * z[static_cast<std::size_t>(i)] *
             z[static_cast<std::size_t>(j)];
  return sum;
}

TEST(Sorting, SquaresOfSumsVanishAndDistancesOfGroupsOnlyTakeFromTheForm) {
  std::mt19937 generator(8);
  const Network network =
      tests::plain(sorting(tests::random_network({3, 8, 12, 2}, generator), files::group_sort(4)));
  const check::BentChain chain = check::bent_chain(network, files::FunctionId("network"));
  ASSERT_EQ(chain.multipliers(), 2u * 2 + 2 * 3);
  const std::vector<double> alike = {1, 1, 0, 0, 1, 1, 1, 0, 0, 0};
  const std::vector<double> pinned = {1, 1, 5, 7, 1, 1, 1, 9, 0, 3}, none(10, 0);
  const auto matrix = [&chain](const std::vector<double>& t) {
    return check::lipschitz_lmi(chain, 4.0, {t.begin(), t.end()});
  };
  for (int s = 0; s < 200; ++s) {
    std::vector<double> x(3), y(3);
    for (std::size_t i = 0; i < 3; ++i) {
      x[i] = 3 * static_cast<double>(tests::random_number(generator));
      y[i] = 3 * static_cast<double>(tests::random_number(generator));
    }
    const std::vector<double> z = increments(*network.plain, x, y);
    const double own = form(matrix(alike), z), size = 1 + std::fabs(own);
    EXPECT_NEAR(form(matrix(pinned), z), own, 1e-9 * size);
    EXPECT_LE(own, form(matrix(none), z) + 1e-9 * size);
  }
}

/// The same bound from differences and sums of pairs, of which the slopes are in [-1, 1] and 1.
TEST(Sorting, TheBoundOfPairsIsThatOfTheirDifferencesAndSums) {
  std::mt19937 generator(9);
  const files::Weights weights = tests::random_network({3, 6, 8, 2}, generator);
  const Network network = tests::plain(sorting(weights, files::group_sort(2)));
  check::BentChain pairs = check::bent_chain(network, files::FunctionId("network"));
  const double found = lipschitz::bent_bound(pairs).proof->upper.value();
  pairs.groups.clear();
  for (std::size_t k = 0; k + 1 < pairs.stages.size(); ++k) {
    check::Matrix &m = pairs.stages[k], &next = pairs.stages[k + 1];
    for (int i = 0; i < m.rows; i += 2) {
      for (int j = 0; j < m.cols; ++j) {
        const check::Dyadic a = m(i, j), b = m(i + 1, j);
        m(i, j) = a - b;
        m(i + 1, j) = a + b;
      }
      for (int j = 0; j < next.rows; ++j) {
        const check::Dyadic a = next(j, i) * check::Dyadic(0.5), b = next(j, i + 1) * check::Dyadic(0.5);
        next(j, i) = a - b;
        next(j, i + 1) = a + b;
      }
    }
  }
  for (std::size_t i = 1; i < pairs.slopes.size(); i += 2) pairs.slopes[i] = {1 - 0x1p-24, 1.0};
  const double by_slopes = lipschitz::bent_bound(pairs).proof->upper.value();
  EXPECT_LE(found, by_slopes * (1 + 1e-6)) << "the slope of a sum is not exactly 1 there";
  EXPECT_NEAR(found, by_slopes, 2e-3 * by_slopes);
}

Json certificate_of(const Network& network) {
  return lipschitz::certificate(network, certify(network, few_rounds()));
}

bool accepted(Json certificate, const Network& network) {
  certificate["content_sha256"] = files::content_sha256(certificate);
  return check::check(certificate, network).accepted;
}

TEST(Sorting, CheckerAcceptsGroupsAndNothingBetter) {
  std::mt19937 generator(6);
  const files::Weights weights = tests::random_network({3, 4, 8, 2}, generator);
  const Network relu = tests::plain(weights);
  const auto slopes = certificate_of(relu)["bounds"];
  ASSERT_EQ(slopes.at(0)["upper_method"], "sdp");
  int refused = 0;
  for (const Activation activation : {Activation::kMaxMinHalves, files::group_sort(4)}) {
    const Network network = tests::plain(sorting(weights, activation));
    const Json certificate = certificate_of(network);
    EXPECT_TRUE(accepted(certificate, network));
    const auto refuses = [&](const auto& change) {
      Json changed = certificate;
      change(changed);
      EXPECT_FALSE(accepted(changed, network)) << changed["bounds"].dump();
      ++refused;
    };
    refuses([&](Json& changed) { changed["bounds"] = slopes; });
    refuses([&](Json& changed) {
      changed["bounds"] = slopes;
      for (const char* const key : {"lower", "lower_hex", "lower_witness"})
        changed["bounds"][0][key] = nullptr;
    });
    refuses([&](Json& changed) { changed["bounds"][0]["upper_method"] = "product"; });
    refuses([&](Json& changed) { changed["statement"] = certificate_of(relu)["statement"]; });
    refuses([&](Json& changed) {
      for (Json& step : changed["network"]["weights"]["network"]["chain"])
        if (step["op"] != "linear") step["op"] = "relu";
    });
    EXPECT_THROW(check::stages(network, "network"), std::domain_error);
  }
  EXPECT_EQ(refused, 10);
}

TEST(Sorting, WidthsMustBeMultiplesOfTheGroup) {
  std::mt19937 generator(7);
  files::Weights weights = tests::random_network({3, 6, 4, 2}, generator);
  weights.order_source = files::OrderSource::kNames;
  weights.activation_source = files::ActivationSource::kDefault;
  EXPECT_NO_THROW(files::with_activation(weights, "groupsort:2"));
  EXPECT_THROW(files::with_activation(weights, "groupsort:4"), files::InputError);
  EXPECT_FALSE(files::is_activation("maxmin"));
  EXPECT_FALSE(files::is_activation("groupsort"));
  EXPECT_FALSE(files::is_activation("groupsort:02"));
}

}  // namespace
}  // namespace swarmcert
