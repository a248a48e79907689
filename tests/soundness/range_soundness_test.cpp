/// No value is outside its range, no jump above its bound, and no float32 evaluation error above its bound.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <random>

#include "data.h"
#include "lipschitz/certify.h"
#include "lipschitz/networks.h"
#include "lipschitz/values/float32_error.h"
#include "lipschitz/values/range.h"
#include "nn/base/random.h"
#include "nn/weights/functions.h"

namespace swarmcert {
namespace {

using files::Network;
using files::Random;
using lipschitz::Box;

const Box kBox{{-1, -1, -1, -2, -2, -2}, {1, 1, 1, 2, 2, 2}};
const Box kGroundBox{{-1, -2, -2, -2}, {1, 2, 2, 2}};

lipschitz::Domain domain_of(const Network& network) {
  lipschitz::Domain domain;
  for (const auto& [kind, phi] : network.phi) domain["phi:" + kind] = kind == "ground" ? kGroundBox : kBox;
  if (network.plain) domain["network"] = kBox;
  return domain;
}

struct Proved {
  std::vector<lipschitz::CertifiedRange> ranges;
  std::vector<lipschitz::Float32Error> errors;
};

Proved prove(const Network& network, int neighbours, int nodes) {
  lipschitz::CertifyOptions certify;
  certify.lower.rounds = 0;
  std::map<files::FunctionId, double> bounds;
  std::map<std::string, double> rho;
  for (const lipschitz::CertifiedBound& bound : lipschitz::certify(network, certify).bounds) {
    bounds[bound.function] = bound.upper.value();
    if (bound.function.is_rho()) rho[bound.function.kind()] = bound.upper.value();
  }
  lipschitz::RangeOptions range;
  range.neighbours = neighbours;
  range.nodes = nodes;
  lipschitz::Float32Options float32;
  float32.neighbours = neighbours;
  float32.nodes = nodes;
  return {lipschitz::ranges(network, domain_of(network), rho, range),
          lipschitz::float32_errors(network, domain_of(network), bounds, float32)};
}

/// Returns a point of the box, sometimes on its boundary, where extremes are likely.
template <typename Scalar>
std::vector<Scalar> point(const Box& box, Random& random) {
  std::vector<Scalar> x;
  const bool corner = random.uniform() < 0.5;
  for (std::size_t k = 0; k < box.lower.size(); ++k) {
    const double t =
        corner && random.uniform() < 0.7 ? (random.uniform() < 0.5 ? 0.0 : 1.0) : random.uniform();
    x.push_back(static_cast<Scalar>(box.lower[k] + t * (box.upper[k] - box.lower[k])));
  }
  return x;
}

/// Compares random neighbours with ranges and errors: f in double, and in float32 by the flight code.
void try_points(const Network& network, const Proved& proved, const files::FunctionId& function,
                int neighbours, int samples) {
  const std::vector<files::FunctionId> names = function.parts();
  const auto parts = files::parts(network);
  const files::Evaluator<double> phi(*parts.at(names[0])), rho(*parts.at(names[1]));
  const files::Evaluator<float> phi32(*parts.at(names[0])), rho32(*parts.at(names[1]));
  std::optional<files::Evaluator<double>> ground;
  std::optional<files::Evaluator<float>> ground32;
  if (network.phi.count("ground") == 1) {
    ground.emplace(network.phi.at("ground"));
    ground32.emplace(network.phi.at("ground"));
  }
  const lipschitz::CertifiedRange* range = nullptr;
  for (const auto& one : proved.ranges)
    if (one.function == function && one.neighbours_at_most == neighbours) range = &one;
  const lipschitz::Float32Error* error = nullptr;
  for (const auto& one : proved.errors)
    if (one.function == function && one.neighbours_at_most == neighbours) error = &one;
  ASSERT_TRUE(range != nullptr && error != nullptr);
  EXPECT_LE(range->lower, range->least.value);
  EXPECT_LE(range->greatest.value, range->upper);
  Random random(static_cast<std::uint64_t>(neighbours));
  double largest_error = 0;
  double least = 1e300;
  double greatest = -1e300;
  double jump = 0;
  for (int sample = 0; sample < samples; ++sample) {
    const int count = static_cast<int>(random.below(static_cast<std::uint64_t>(neighbours) + 1));
    std::vector<double> sum(static_cast<std::size_t>(phi.mlp().outputs()), 0.0);
    std::vector<float> sum32(sum.size(), 0.0f);
    if (ground) {
      const std::vector<float> own = point<float>(kGroundBox, random);
      const std::vector<double> g = (*ground)({own.begin(), own.end()});
      const std::vector<float> g32 = (*ground32)(own);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += g[i], sum32[i] = g32[i];
    }
    double before = rho(sum)[0];
    for (int j = 0; j < count; ++j) {
      const std::vector<float> x = point<float>(kBox, random);
      const std::vector<double> h = phi({x.begin(), x.end()});
      const std::vector<float> h32 = phi32(x);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += h[i], sum32[i] += h32[i];
      const double after = rho(sum)[0];
      jump = std::max(jump, std::abs(after - before));
      before = after;
    }
    const double value = before;
    least = std::min(least, value);
    greatest = std::max(greatest, value);
    const double off = std::abs(static_cast<double>(rho32(sum32)[0]) - value);
    largest_error = std::max(largest_error, off);
    ASSERT_LE(off, error->evaluation.value() + 1e-11);
  }
  EXPECT_GE(least, range->lower);
  EXPECT_LE(greatest, range->upper);
  EXPECT_LE(jump, range->jump);
  std::printf(
      "%s, up to %d neighbours: sampled %.4g .. %.4g, attained %.4g .. %.4g, proved %.4g .. %.4g; jump %.3g "
      "of %.3g; float32 off by %.3g of %.3g\n",
      function.name().c_str(), neighbours, least, greatest, range->least.value, range->greatest.value,
      range->lower, range->upper, jump, range->jump, largest_error, error->evaluation.value());
}

TEST(RangeSoundness, RandomSetsStayWithinTheirRange) {
  std::mt19937 generator(4);
  for (int round = 0; round < 3; ++round) {
    Network network;
    network.phi["large"] = tests::random_network({6, 7, 5, 4}, generator);
    if (round > 0) network.phi["ground"] = tests::random_network({4, 5, 4}, generator);
    network.rho["small"] = tests::random_network({4, 6, 1}, generator);
    const Proved proved = prove(network, 3, 60);
    for (int n = 1; n <= 3; ++n) try_points(network, proved, "set:large:small", n, 3000);
  }
}

/// Returns the largest sign f found by moving single neighbours (and the input of the ground term, if any) from a
/// random start.
double climbed_value(const Network& network, int neighbours, double sign, Random& random) {
  const bool has_ground = network.phi.count("ground") == 1;
  const files::Evaluator<double> phi(network.phi.at("large")), rho(network.rho.at("small"));
  const files::Evaluator<double> ground(network.phi.at(has_ground ? "ground" : "large"));
  std::vector<std::vector<double>> best;
  for (int j = 0; j < neighbours; ++j) best.push_back(point<double>(kBox, random));
  if (has_ground) best.push_back(point<double>(kGroundBox, random));
  const auto is_ground = [&](std::size_t j) {
    return has_ground && j == static_cast<std::size_t>(neighbours);
  };
  const auto value = [&](const std::vector<std::vector<double>>& x) {
    std::vector<double> sum(static_cast<std::size_t>(phi.mlp().outputs()), 0.0);
    for (std::size_t j = 0; j < x.size(); ++j) {
      const std::vector<double> term = is_ground(j) ? ground(x[j]) : phi(x[j]);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += term[i];
    }
    return sign * rho(sum)[0];
  };
  double largest = value(best);
  for (int tried = 0; tried < 600; ++tried) {
    std::vector<std::vector<double>> x = best;
    const std::size_t j = random.below(x.size());
    const Box& box = is_ground(j) ? kGroundBox : kBox;
    const double scale = std::exp2(-8.0 * tried / 600);
    for (std::size_t k = 0; k < x[j].size(); ++k)
      x[j][k] = std::clamp(x[j][k] + scale * box.upper[k] * random.symmetric(), box.lower[k], box.upper[k]);
    if (const double found = value(x); found > largest) largest = found, best = std::move(x);
  }
  return largest;
}

TEST(RangeSoundness, NoClimbOverDistinctNeighboursLeavesARangeThatPartsOfTheBoxMadeTighter) {
  std::mt19937 generator(14);
  Random random(15);
  for (int round = 0; round < 4; ++round) {
    Network network;
    network.phi["large"] = tests::random_network({6, 9, 7, 4}, generator);
    if (round % 2 == 0) network.phi["ground"] = tests::random_network({4, 6, 4}, generator);
    network.rho["small"] = tests::random_network({4, 8, 6, 1}, generator);
    lipschitz::RangeOptions options;
    options.neighbours = 3;
    options.nodes = 1;
    const auto whole = lipschitz::ranges(network, domain_of(network), {{"small", 1e9}}, options);
    options.nodes = 1000;
    const auto ranges = lipschitz::ranges(network, domain_of(network), {{"small", 1e9}}, options);
    for (std::size_t n = 1; n <= 3; ++n) {
      const lipschitz::CertifiedRange& range = ranges[n - 1];
      // The boxes of the inputs were split, for all forms used by the bound.
      EXPECT_LT(range.upper - range.lower, 0.8 * (whole[n - 1].upper - whole[n - 1].lower));
      double least = 1e300, greatest = -1e300;
      for (int climb = 0; climb < 15; ++climb) {
        greatest = std::max(greatest, climbed_value(network, static_cast<int>(n), 1, random));
        least = std::min(least, -climbed_value(network, static_cast<int>(n), -1, random));
      }
      EXPECT_LE(greatest, range.upper + 1e-12);
      EXPECT_GE(least, range.lower - 1e-12);
      std::printf(
          "%zu neighbours%s: climbed to %.4g .. %.4g, proved %.4g .. %.4g, undivided %.4g .. "
          "%.4g\n",
          n, round % 2 == 0 ? " and the ground" : "", least, greatest, range.lower, range.upper,
          whole[n - 1].lower, whole[n - 1].upper);
    }
  }
}

TEST(RangeSoundness, AClampMakesTheRangeHoldForEveryInput) {
  std::mt19937 generator(5);
  Network network = tests::deep_set(tests::random_network({6, 6, 4}, generator),
                                    tests::random_network({4, 5, 1}, generator));
  network.clamp = files::InputClamp{{-0.5, -0.5, -0.5, -1, -1, -1}, {0.5, 0.5, 0.5, 1, 1, 1}};
  const auto domain = lipschitz::clamp_domain(network);
  ASSERT_EQ(domain.at("phi:default").upper[3], 1);
  const auto ranges = lipschitz::ranges(network, domain, {{"default", 10.0}}, {});
  Random random(6);
  for (int sample = 0; sample < 2000; ++sample) {
    std::vector<float> x;
    for (int k = 0; k < 6; ++k) x.push_back(static_cast<float>(1000 * random.symmetric()));
    const mpq_class value = lipschitz::value(network, "set:default:default", {"phi:default"}, {x})[0];
    EXPECT_LE(value, mpq_class(ranges[0].upper));
    EXPECT_GE(value, mpq_class(ranges[0].lower));
  }
}

/// The range of an affine network is known: sum of |w_k| times half widths.
TEST(RangeSoundness, AnAffineNetworkHasItsExactRange) {
  const Network network = tests::plain(tests::weights({tests::layer(1, 6, {1, -2, 3, 0.5, 0, -1})}));
  const auto ranges = lipschitz::ranges(network, domain_of(network), {}, {});
  EXPECT_NEAR(ranges[0].upper, 1 + 2 + 3 + 1 + 0 + 2, 1e-9);
  EXPECT_NEAR(ranges[0].lower, -9, 1e-9);
  EXPECT_EQ(ranges[0].greatest.value, 9);
  EXPECT_EQ(ranges[0].least.value, -9);
}

/// A local search reaches much further than samples: from the worst of many points, with steps that shrink on failure.
double furthest_off(const Network& network, const files::FunctionId& function, Random& random) {
  const std::vector<files::FunctionId> names = function.parts();
  const auto parts = files::parts(network);
  const files::Evaluator<double> phi(*parts.at(names[0])), rho(*parts.at(names[1]));
  const files::Evaluator<float> phi32(*parts.at(names[0])), rho32(*parts.at(names[1]));
  const auto off = [&](const std::vector<float>& x) {
    return std::abs(static_cast<double>(rho32(phi32(x))[0]) - rho(phi({x.begin(), x.end()}))[0]);
  };
  std::vector<float> best = point<float>(kBox, random);
  for (int sample = 0; sample < 300; ++sample) {
    const std::vector<float> x = point<float>(kBox, random);
    if (off(x) > off(best)) best = x;
  }
  double step = 0.3;
  for (int tried = 0; tried < 3000; ++tried) {
    std::vector<float> x = best;
    for (std::size_t k = 0; k < x.size(); ++k) {
      if (random.uniform() < 0.5) continue;
      const double moved = static_cast<double>(x[k]) + step * kBox.upper[k] * random.symmetric();
      x[k] = static_cast<float>(std::clamp(moved, kBox.lower[k], kBox.upper[k]));
    }
    if (off(x) > off(best))
      best = x;
    else
      step = step < 1e-7 ? 1e-2 : 0.995 * step;
  }
  return off(best);
}

TEST(RangeSoundness, NoClimbFindsAFloat32EvaluationFurtherOffThanItsBound) {
  std::mt19937 generator(8);
  Random random(9);
  for (int round = 0; round < 4; ++round) {
    const Network network = tests::deep_set(tests::random_network({6, 8, 5, 4}, generator),
                                            tests::random_network({4, 6, 1}, generator));
    const double bound = prove(network, 1, 300).errors[0].evaluation.value();
    double found = 0;
    for (int climb = 0; climb < 3; ++climb)
      found = std::max(found, furthest_off(network, "set:default:default", random));
    std::printf("float32 off by %.3g of %.3g\n", found, bound);
    EXPECT_LE(found, bound + 1e-14);  // f is evaluated in double here
    EXPECT_LE(bound, 40 * found);
  }
}

TEST(RangeSoundness, AFloat32ErrorWhoseSearchIsStoppedIsLargerAndFinite) {
  std::mt19937 generator(8);
  const Network network = tests::deep_set(tests::random_network({6, 8, 5, 4}, generator),
                                          tests::random_network({4, 6, 1}, generator));
  const std::map<files::FunctionId, double> bounds = {{"set:default:default", 1}};
  lipschitz::Float32Options options;
  const auto evaluation = [&] {
    return lipschitz::float32_errors(network, domain_of(network), bounds, options).at(0).evaluation.value();
  };
  const double searched = evaluation();
  const std::atomic<bool> cancelled = true;
  options.stop = lipschitz::Stop(&cancelled);
  const double stopped = evaluation();
  EXPECT_GT(stopped, 1.5 * searched);
  EXPECT_TRUE(std::isfinite(stopped));
}

TEST(RangeSoundness, FlownNetworksAreWithinRangeAndFloat32IsWithinTwoHundredthsOfAGram) {
  SWARMCERT_NEEDS_DATA();
  const auto weights = [](const std::string& name) {
    return files::load_weights(tests::data_path("weights/zip_f32/" + name));
  };
  const Network network = tests::deep_set(weights("phi_L.pth"), weights("rho_L.pth"));
  const Proved proved = prove(network, 3, 60);
  EXPECT_LE(proved.errors[0].total.value(), 0.02);  // gf, one neighbour
  for (const int n : {1, 2, 3}) try_points(network, proved, "set:default:default", n, 1000);
}

TEST(RangeSoundness, Float64WeightsHaveNoFloat32Error) {
  std::mt19937 generator(7);
  Network network = tests::plain(tests::random_network({6, 3, 1}, generator));
  network.plain->precision = files::Precision::kFloat64;
  EXPECT_THROW(lipschitz::float32_errors(network, domain_of(network), {{"network", 1.0}}, {}),
               std::invalid_argument);
}

}  // namespace
}  // namespace swarmcert
