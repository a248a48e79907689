/// Lower bounds by two points for networks with activations other than ReLU: enclosures, search and check.
#include <cmath>
#include <optional>

#include "lipschitz/base/rounding.h"
#include "lipschitz/boxes.h"
#include "lipschitz/checker/check.h"
#include "lipschitz/checker/witness.h"
#include "lipschitz/lower/lower_bound.h"
#include "lipschitz/lower/slope_estimate.h"
#include "lipschitz/lower/slope_search.h"
#include "lipschitz/networks.h"
#include "nn/base/content_hash.h"
#include "nn/base/json.h"
#include "nn/weights/functions.h"

namespace swarmcert {
namespace {

using files::Activation;
using files::Json;
using files::Network;
using files::Weights;
using lipschitz::Box;
using lipschitz::Certification;
using lipschitz::CertifiedBound;
using lipschitz::CertifyOptions;
using lipschitz::SlopePoints;

struct PairedNetwork {
  std::vector<int> sizes;
  std::vector<Activation> between;  ///< behind each layer but the last
  std::optional<Activation> end;
};

std::vector<PairedNetwork> paired_networks() {
  using A = Activation;
  std::vector<PairedNetwork> all;
  for (const A activation : {A::kTanh, A::kSigmoid, A::kSoftplus, A::kElu, A::kSelu, A::kSilu, A::kGelu,
                             A::kMaxMinHalves, A::kMaxMinPairs, files::group_sort(3)})
    all.push_back({{3, 12, 6, 2}, {activation, activation}, {}});
  all.push_back({{3, 10, 8, 2}, {A::kTanh, A::kRelu}, {}});
  all.push_back({{4, 8, 6, 2}, {A::kRelu, A::kRelu}, A::kTanh});
  all.push_back({{3, 8, 6, 6, 2}, {A::kGelu, files::group_sort(2), A::kSigmoid}, {}});
  all.push_back({{2, 2}, {}, A::kSilu});
  return all;
}

Weights made(const PairedNetwork& one, std::mt19937& generator) {
  Weights weights = tests::random_network(one.sizes, generator);
  weights.set_activations(one.between);
  if (one.end) weights.end_in(*one.end);
  return weights;
}

Certification certified_pairs(const Network& network, lipschitz::Domain domain = {},
                              lipschitz::UpperMethod method = lipschitz::UpperMethod::kAuto) {
  CertifyOptions options;
  options.domain = std::move(domain);
  options.method = method;
  options.lower.rounds = 4;
  options.jobs = 1;
  return certify(network, options);
}

/// Returns |f(x) - f(y)| / |x - y| in double.
double quotient(const Weights& weights, const SlopePoints& pair) {
  const files::Evaluator<double> f(weights);
  const std::vector<double> fx = f({pair.x.begin(), pair.x.end()}), fy = f({pair.y.begin(), pair.y.end()});
  double rise = 0, run = 0;
  for (std::size_t i = 0; i < fx.size(); ++i) rise = std::hypot(rise, fx[i] - fy[i]);
  for (std::size_t k = 0; k < pair.x.size(); ++k)
    run = std::hypot(run, static_cast<double>(pair.x[k]) - static_cast<double>(pair.y[k]));
  return rise / run;
}

/// tanh(1/2) and tanh(1/4) with 32 digits are from Python's decimal.
TEST(PointPairs, AreAsSteepAsKnownDigitsUpToTheWidthOfTheEnclosures) {
  Weights weights = tests::weights({tests::layer(1, 1, {1}), tests::layer(1, 1, {1})});
  weights.set_activations({Activation::kTanh});
  const mpq_class square = lipschitz::slope_squared(tests::slope_of(weights), {{0.5F}, {0.25F}, {}});
  mpz_class digits("46211715726000975850231848364367"), less("24491866240370912927780113149103"), unit = 1;
  mpz_ui_pow_ui(unit.get_mpz_t(), 10, 32);
  const mpq_class known = 4 * mpq_class(digits - less) / unit, off(1, mpz_class(1) << 60);
  EXPECT_LE(square, (known + off) * (known + off));
  EXPECT_GE(square, (known - off) * (known - off));
}

/// The smaller of two numbers minus the larger one, behind a layer that is sorted.
TEST(PointPairs, OfLayersThatAreSortedAreExact) {
  Weights weights = tests::weights({tests::layer(2, 2, {1, 0, 0, 1}), tests::layer(1, 2, {1, -1})});
  weights.set_activations({files::group_sort(2)});
  EXPECT_EQ(lipschitz::slope_squared(tests::slope_of(weights), {{1, 0}, {0, 4}, {}}), mpq_class(9, 17));
  EXPECT_EQ(lipschitz::slope_squared(tests::slope_of(weights), {{3, 1}, {1, 3}, {}}), mpq_class(0));
}

TEST(PointPairs, AreBelowEveryProvedBoundAndAsSteepAsTheirValuesInDouble) {
  std::mt19937 generator(31);
  for (const PairedNetwork& one : paired_networks()) {
    for (const double radius : {0.0, 0.02, 1.0}) {
      const Network network = tests::plain(made(one, generator));
      lipschitz::Domain domain;
      if (radius > 0) domain["network"] = tests::cube(one.sizes.front(), radius);
      const CertifiedBound bound = certified_pairs(network, domain).bounds.front();
      const std::string where = network.plain->activation_names() + " " + std::to_string(radius);
      ASSERT_TRUE(bound.lower.witness) << where;
      const double lower = bound.lower.witness->slope.value();
      EXPECT_LE(lower, bound.upper.value()) << where;
      const double in_double = quotient(*network.plain, *bound.lower.witness);
      EXPECT_LE(lower, in_double * (1 + 1e-8)) << where;
      EXPECT_GE(lower, in_double * (1 - 1e-8)) << where;
      for (std::size_t k = 0; radius > 0 && k < bound.lower.witness->x.size(); ++k) {
        for (const std::vector<float>* const point : {&bound.lower.witness->x, &bound.lower.witness->y}) {
          EXPECT_GE(static_cast<double>((*point)[k]), domain["network"].lower[k]) << where;
          EXPECT_LE(static_cast<double>((*point)[k]), domain["network"].upper[k]) << where;
        }
      }
    }
  }
}

/// Behind a rotation all neurons are steepest at 0, so the bound is the norm of the next layer times that slope. For
/// points at distance h <= 1e-4 from 0, tanh(t) / t and similar quotients are 1 - O(h^2).
TEST(PointPairs, AttainTheBoundWhereAllNeuronsAreSteepestAtOnePlace) {
  for (const Activation activation : {Activation::kTanh, Activation::kSigmoid, files::group_sort(2)}) {
    Weights weights =
        tests::weights({tests::layer(2, 2, {0.6, -0.8, 0.8, 0.6}), tests::layer(2, 2, {3, 0, 0, 2})});
    weights.set_activations({activation});
    const CertifiedBound bound = certified_pairs(tests::plain(weights)).bounds.front();
    const double known = 3 * files::function_of(activation).steepest();
    EXPECT_GE(bound.lower.witness->slope.value(), known * (1 - 1e-6)) << files::function_of(activation).op;
    EXPECT_LE(bound.lower.witness->slope.value(), known) << files::function_of(activation).op;
  }
}

TEST(PointPairs, MoveInTheBlockOnlyAndCountInItsScale) {
  std::mt19937 generator(32);
  Weights weights = tests::random_network({3, 8, 2}, generator);
  weights.set_activations({Activation::kTanh});
  CertifyOptions options;
  options.blocks = {"x1"};
  options.scale = {1, 2, 8};
  options.lower.rounds = 4;
  const Network network = tests::plain(weights);
  int blocks = 0, scaled = 0;
  for (const CertifiedBound& bound : certify(network, options).bounds) {
    ASSERT_TRUE(bound.lower.witness);
    const lipschitz::SlopeWitness& pair = *bound.lower.witness;
    EXPECT_LE(pair.slope.value(), bound.upper.value());
    if (bound.block == "x1") {
      EXPECT_EQ(pair.x[0], pair.y[0]);
      EXPECT_EQ(pair.x[2], pair.y[2]);
      ++blocks;
    } else if (!bound.scale.empty()) {
      EXPECT_GT(pair.slope.value(), quotient(weights, pair)) << "the scale is at least 1";
      ++scaled;
    }
  }
  EXPECT_EQ(blocks, 1);
  EXPECT_EQ(scaled, 1);
}

TEST(PointPairs, AreTheSameForTheSameSeedAndNoneWithoutRounds) {
  std::mt19937 generator(33);
  const Network network = tests::plain(made(paired_networks()[5], generator));
  lipschitz::Claim claim;
  claim.function = "network";
  lipschitz::LowerBoundOptions options;
  options.rounds = 3;
  const lipschitz::FoundSlope first = lower_bound(network, claim, {}, options),
                              second = lower_bound(network, claim, {}, options);
  EXPECT_EQ(first.witness->x, second.witness->x);
  EXPECT_EQ(first.witness->y, second.witness->y);
  EXPECT_EQ(first.rounds, 3);
  options.rounds = 0;
  EXPECT_FALSE(lower_bound(network, claim, {}, options).witness);
}

TEST(PointPairs, AreNoneWhereTheBoxHoldsNoTwoFloat32PointsAndInTheBoxWhereTheClampIsNot) {
  std::mt19937 generator(34);
  Network network = tests::plain(made({{2, 5, 1}, {Activation::kTanh}, {}}, generator));
  const auto pair = [&](const Box& box) {
    return certified_pairs(network, {{"network", box}}).bounds.front().lower.witness;
  };
  const double tenth = 0.1;  // not a float32 number
  EXPECT_FALSE(pair({{tenth, 0}, {tenth, 1}}));
  EXPECT_FALSE(pair({{0.5, 0.25}, {0.5, 0.25}}));
  ASSERT_TRUE(pair({{0.5, 0}, {0.5, 1}}));
  EXPECT_EQ(pair({{0.5, 0}, {0.5, 1}})->x[0], 0.5F);
  network.clamp = files::InputClamp{{-1, -1}, {1, 1}};
  const auto beyond = pair({{2, 0}, {3, 1}});  // the clamp maps x[0] to 1
  ASSERT_TRUE(beyond);
  EXPECT_EQ(beyond->x[0], 2);
  EXPECT_EQ(beyond->y[0], 2);
}

/// A deep set with a ground of another activation: the pair contains all terms, and the checker verifies them.
TEST(PointPairs, OfADeepSetHoldTheOtherTerms) {
  std::mt19937 generator(35);
  const auto with = [&](const std::vector<int>& sizes, Activation activation) {
    return made({sizes, std::vector<Activation>(sizes.size() - 2, activation), {}}, generator);
  };
  Network network = tests::deep_set(with({5, 6, 4}, Activation::kRelu), with({4, 5, 1}, Activation::kSilu));
  network.phi["ground"] = with({files::kGroundInputs, 5, 4}, Activation::kTanh);
  const Json found = lipschitz::certificate(network, certified_pairs(network));
  const check::CheckResult result = check::check(found, network);
  EXPECT_TRUE(result.accepted) << result.reason;
  EXPECT_EQ(result.lower_bounds, 5);  // two phi, rho, two sets
  for (const Json& bound : found["bounds"]) {
    if (bound["function"] != "set:default:default") continue;
    EXPECT_EQ(bound["lower_witness"]["others"][0]["network"], "phi:ground");
  }
}

TEST(PointPairs, OfReluNetworksAloneAreSearchedByRegionsAndEvaluatedInIntegers) {
  std::mt19937 generator(36);
  const Network network = tests::plain(made(paired_networks()[0], generator));
  EXPECT_FALSE(lipschitz::has_relu_only(network, "network"));
  EXPECT_THROW(search_slope(lipschitz::slope_function(network, "network", {})), std::invalid_argument);
  EXPECT_THROW(lipschitz::value(network, "network", {"network"}, {{0, 0, 0}}), std::invalid_argument);
}

std::string refusal(Json changed, const Network& network) {
  changed["content_sha256"] = files::content_sha256(changed);
  const check::CheckResult result = check::check(changed, network);
  return result.accepted ? "accepted" : result.reason;
}

TEST(PointPairCertificate, IsRefusedWithAnyLowerBoundAboveItsPairAndPointsThatDoNotFit) {
  std::mt19937 generator(37);
  for (const PairedNetwork& one : paired_networks()) {
    const Network network = tests::plain(made(one, generator));
    const lipschitz::Domain domain = {{"network", tests::cube(one.sizes.front(), 0.25)}};
    const Json found =
        lipschitz::certificate(network, certified_pairs(network, domain, lipschitz::UpperMethod::kProduct));
    const std::string where = network.plain->activation_names();
    ASSERT_EQ(refusal(found, network), "accepted") << where;
    const auto changed = [&](const auto& change) {
      Json other = found;
      change(other["bounds"][0]);
      return refusal(other, network);
    };
    const auto with_lower = [](double lower) {
      return [lower](Json& bound) {
        bound["lower"] = lower;
        bound["lower_hex"] = files::hex_float(lower);
      };
    };
    const double lower = found["bounds"][0]["lower"];
    EXPECT_NE(changed(with_lower(std::nextafter(lower, 1e9))).find("claims more than"), std::string::npos)
        << where;
    EXPECT_EQ(changed(with_lower(std::nextafter(lower, 0))), "accepted") << where;
    EXPECT_NE(changed([](Json& bound) {
                bound["lower_witness"]["y"] = bound["lower_witness"]["x"];
              }).find("x == y"),
              std::string::npos);
    EXPECT_NE(
        changed([](Json& bound) { bound["lower_witness"]["x"][0] = "0x1p+3"; }).find("outside of the box"),
        std::string::npos);
    EXPECT_NE(
        changed([](Json& bound) { bound["lower_witness"]["x"][0] = "0x1.999999999999ap-4"; }).find("float32"),
        std::string::npos);
    EXPECT_NE(changed([](Json& bound) { bound["lower_witness"] = nullptr; }).find("lower has no witness"),
              std::string::npos);
  }
}

/// A slope attained with one activation is refused for a flatter activation.
TEST(PointPairCertificate, IsRefusedForAnotherActivation) {
  std::mt19937 generator(38);
  Network network = tests::plain(made({{2, 6, 1}, {Activation::kTanh}, {}}, generator));
  const Json found =
      lipschitz::certificate(network, certified_pairs(network, {}, lipschitz::UpperMethod::kProduct));
  Json changed = found;
  changed["network"]["weights"]["network"]["chain"][1]["op"] = "sigmoid";
  network.plain->set_activations({Activation::kSigmoid});
  EXPECT_NE(refusal(changed, network).find("claims more than the slope"), std::string::npos);
}

TEST(NearestFloat, IsInTheIntervalAndNothingWhereItHoldsNone) {
  EXPECT_EQ(lipschitz::nearest_float(0.1, -1, 1), 0.1F);
  EXPECT_EQ(lipschitz::nearest_float(5, -1, 1), 1.0F);
  const double tenth = 0.1;
  EXPECT_LE(static_cast<double>(*lipschitz::nearest_float(tenth, 0, tenth)), tenth);
  EXPECT_GE(static_cast<double>(*lipschitz::nearest_float(tenth, tenth, 1)), tenth);
  EXPECT_FALSE(lipschitz::nearest_float(tenth, tenth, tenth));
}

}  // namespace
}  // namespace swarmcert
