// The error found by the search is the error of the flight code at the stated points.
#include "lipschitz/float32_search.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "lipschitz/checker/witness.h"
#include "lipschitz/networks.h"
#include "nn/base/random.h"
#include "nn/deep_set.h"

namespace swarmcert {
namespace {

using files::Network;
using lipschitz::Attained;
using lipschitz::Box;

const Box kStates{{-1, -1, -1, -2, -2, -2}, {1, 1, 1, 2, 2, 2}};

Network set_with_ground(std::mt19937& generator) {
  Network network = tests::deep_set(tests::random_network({6, 9, 8, 5}, generator),
                                    tests::random_network({5, 8, 1}, generator));
  network.phi["ground"] = tests::random_network({6, 7, 5}, generator);
  return network;
}

/// Evaluates with nn/deep_set.h; the first point is the ground's.
float flown(const Network& network, const std::vector<std::vector<float>>& points) {
  const files::Evaluator<float> phi(network.phi.at("default")), ground(network.phi.at("ground")),
      rho(network.rho.at("default"));
  const nn::Mlp<float> phi_mlp = phi.mlp(), ground_mlp = ground.mlp();
  const nn::DeepSet<float> set{&ground_mlp, &phi_mlp, 1, rho.mlp(), nullptr, nullptr};
  std::vector<nn::Neighbour<float>> neighbours;
  for (std::size_t j = 1; j < points.size(); ++j) neighbours.push_back({points[j].data(), 0});
  const auto count = static_cast<int>(neighbours.size());
  std::vector<float> inputs(neighbours.size() * 6), sum(5),
      scratch(static_cast<std::size_t>(scratch_size(set)));
  std::vector<int> order(neighbours.size());
  float output = 0;
  const auto status = nn::evaluate(
      set, points[0].data(), neighbours.data(), count, &output,
      nn::DeepSetWorkspace<float>{inputs.data(), order.data(), count, sum.data(), scratch.data()});
  EXPECT_EQ(status, nn::DeepSetStatus::kOk);
  return output;
}

double exactly_off(const Network& network, const files::FunctionId& function, const Attained& found,
                   float flies) {
  const mpq_class exact = lipschitz::value(network, function, found.networks, found.points)[0];
  return mpq_class(abs(mpq_class(static_cast<double>(flies)) - exact)).get_d();
}

TEST(Float32Search, StatesTheErrorOfWhatFliesAtItsPointsOfTheBox) {
  std::mt19937 generator(31);
  const Network network = set_with_ground(generator);
  const lipschitz::Domain domain{{"phi:default", kStates}, {"phi:ground", kStates}};
  for (const int neighbours : {1, 3}) {
    const Attained found =
        lipschitz::float32_error_found(network, domain, "set:default:default", neighbours, {2, 1});
    ASSERT_EQ(found.points.size(), static_cast<std::size_t>(neighbours) + 1);
    ASSERT_TRUE(found.networks.front().is_ground_phi());
    for (const std::vector<float>& point : found.points)
      for (std::size_t k = 0; k < point.size(); ++k)
        EXPECT_LE(std::abs(static_cast<double>(point[k])), kStates.upper[k]);
    const double off = exactly_off(network, "set:default:default", found, flown(network, found.points));
    EXPECT_GT(found.value, 0);
    EXPECT_LE(found.value, off * (1 + 1e-15));
    EXPECT_GE(found.value, off * (1 - 1e-14));
  }
}

TEST(Float32Search, GoesFurtherThanTenTimesAsManyRandomPoints) {
  std::mt19937 generator(32);
  files::Random random(33);
  for (int round = 0; round < 4; ++round) {
    const Network network = tests::plain(tests::random_network({6, 12, 10, 1}, generator));
    const files::Evaluator<float> f32(*network.plain);
    const files::Evaluator<double> f(*network.plain);
    double sampled = 0;
    for (int sample = 0; sample < 150000; ++sample) {
      std::vector<float> x;
      for (std::size_t k = 0; k < 6; ++k)
        x.push_back(static_cast<float>(kStates.upper[k] * random.symmetric()));
      const double off = static_cast<double>(f32(x)[0]) - f({x.begin(), x.end()})[0];
      sampled = std::max(sampled, std::abs(off));
    }
    const Attained found =
        lipschitz::float32_error_found(network, {{"network", kStates}}, "network", 1, {1, 1});
    EXPECT_GT(found.value, sampled);
  }
}

TEST(Float32Search, IsTheSameForTheSameSeedAndSaysNothingWhereTheBoxHoldsNoFloat) {
  std::mt19937 generator(34);
  const Network network = tests::plain(tests::random_network({2, 4, 1}, generator));
  const lipschitz::Domain domain{{"network", Box{{-1, 0}, {1, 1}}}};
  const Attained one = lipschitz::float32_error_found(network, domain, "network", 1, {1, 7});
  const Attained other = lipschitz::float32_error_found(network, domain, "network", 1, {1, 7});
  EXPECT_EQ(one.value, other.value);
  EXPECT_EQ(one.points, other.points);
  const lipschitz::Domain none{{"network", Box{{-1, 0.1}, {1, 0.1}}}};
  EXPECT_TRUE(lipschitz::float32_error_found(network, none, "network", 1, {1, 7}).points.empty());
}

}  // namespace
}  // namespace swarmcert
