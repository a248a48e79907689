/// The force of a rotor as a polynomial of its speed, drafted from flights.
#include "analysis/identification/thrust_curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace swarmcert::identification {
namespace {

constexpr double kLinearShare = 0.6, kSquareShare = 1.6;

/// The command at which a rotor gives `load` of its share of the weight.
double command_of(double load, double linear, double square) {
  return (std::sqrt(linear * linear + 4 * square * load) - linear) / (2 * square);
}

/// A flight whose loads are commanded, plus gusts that the commands follow if `follows` is 1.
LoadBlocks flight(unsigned seed, double linear, double square, double commanded, double gust,
                  double follows) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  LoadBlocks blocks;
  double wanted = 0, push = 0;
  for (int i = 0; i < 300; ++i) {
    wanted += 0.2 * (commanded * 3 * normal(random) - wanted);
    push += 0.2 * (gust * 3 * normal(random) - push);
    const double u = command_of(std::max(1 + wanted - follows * push, 0.2), linear, square);
    blocks.powers.emplace_back(1, u, u * u);
    blocks.load.push_back(linear * u + square * u * u + push + 0.003 * normal(random));
  }
  return blocks;
}

TEST(ThrustCurve, IsAPolynomialWhereFlightsConfirmIt) {
  std::vector<LoadBlocks> flights;
  for (unsigned seed = 1; seed <= 3; ++seed)
    flights.push_back(flight(seed, kLinearShare, kSquareShare, 0.1, 0.005, 0));
  for (const std::size_t count : {1u, 3u}) {
    flights.resize(count, flights[0]);
    const ThrustCurve curve = thrust_curve(flights, 2);
    ASSERT_TRUE(curve.is_found()) << curve.why;
    EXPECT_NEAR(curve.shares[1], kLinearShare, 0.1) << curve.why;
    EXPECT_NEAR(curve.shares[2], kSquareShare, 0.1) << curve.why;
    flights.push_back(flight(2, kLinearShare, kSquareShare, 0.1, 0.005, 0));
  }
}

TEST(ThrustCurve, StaysThePowerAloneWhereMoreTermsGainNothing) {
  for (unsigned seed = 1; seed < 40; seed += 2) {
    const ThrustCurve curve =
        thrust_curve({flight(seed, 0, 2.2, 0.1, 0.02, 0), flight(seed + 1, 0, 2.2, 0.1, 0.02, 0)}, 2);
    EXPECT_FALSE(curve.is_found()) << seed << ": " << curve.shares.transpose() << "\n" << curve.why;
    EXPECT_NE(curve.why.find("held-out error"), std::string::npos) << curve.why;
  }
}

TEST(ThrustCurve, IsNotThatOfAControllerWhichFollowsGusts) {
  // The load hardly varies while the commands do: a regression finds a thrust that does not depend on the command.
  const ThrustCurve curve =
      thrust_curve({flight(1, 0, 2.2, 0.01, 0.1, 1), flight(2, 0, 2.2, 0.01, 0.1, 1)}, 2);
  EXPECT_FALSE(curve.is_found()) << curve.shares.transpose();
  EXPECT_NE(curve.why.find("too little to tell"), std::string::npos) << curve.why;
}

}  // namespace
}  // namespace swarmcert::identification
