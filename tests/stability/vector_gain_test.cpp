// Expected gains: the largest int |H(t)' eta| dt over unit vectors eta by Simpson's rule; a simulation attains it.
#include "stability/bounds/loops/vector_gain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "stability/bounds/theorem.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

Matrix3 diagonal(double x, double y, double z) { return {{x, 0, 0}, {0, y, 0}, {0, 0, z}}; }

void expect_gain(const Matrix3& Lambda, const Matrix3& K, double expected) {
  const VectorGain gain = vector_peak_gain(Lambda, K, kMass_kg);
  EXPECT_LE(gain.lower, expected + 1e-10);
  EXPECT_GE(gain.upper, expected - 1e-10);
  EXPECT_TRUE(gain.is_exact()) << gain.lower << " .. " << gain.upper;
}

TEST(VectorGain, EnclosesTheReference) {
  expect_gain(diagonal(4, 4, 4), diagonal(.136, .136, .136), 0.45955882352941174);
  expect_gain(diagonal(2, 2, 4), diagonal(.1, .1, .2), 2.5);
  expect_gain(diagonal(2, 2, 4), diagonal(.2, .2, .05), 1.2503991779);
}

TEST(VectorGain, ARotatingDisturbanceBeatsEveryAxis) {
  const VectorGain gain = vector_peak_gain(diagonal(2, 2, 4), diagonal(.2, .2, .05), kMass_kg);
  EXPECT_GT(gain.lower, 1.25 + 3e-4);  // the gain of each axis alone is 1.25
  const double z = gain.direction[2] * gain.direction[2];
  EXPECT_NEAR(z, 0.452, 2e-3);
}

Matrix3 rotated(const Matrix3& m, double angle, bool about_z) {
  const double c = std::cos(angle), s = std::sin(angle);
  const Matrix3 R =
      about_z ? Matrix3{{c, -s, 0}, {s, c, 0}, {0, 0, 1}} : Matrix3{{1, 0, 0}, {0, c, -s}, {0, s, c}};
  Matrix3 result{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t a = 0; a < 3; ++a) {
        for (std::size_t b = 0; b < 3; ++b) result[i][j] += R[i][a] * m[a][b] * R[j][b];
      }
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < i; ++j) result[i][j] = result[j][i];
  }
  return result;
}

TEST(VectorGain, DoesNotDependOnTheFrame) {
  const VectorGain gain = vector_peak_gain(rotated(diagonal(2, 2, 4), 0.7, false),
                                           rotated(diagonal(.2, .2, .05), 0.7, false), kMass_kg);
  EXPECT_LE(gain.lower, 1.2503991779 + 1e-9);
  EXPECT_GE(gain.upper, 1.2503991779 - 1e-9);
  EXPECT_TRUE(gain.is_exact());
}

TEST(VectorGain, MatricesThatDoNotCommuteStayBelowTheTheorem) {
  const Matrix3 Lambda = rotated(diagonal(1.5, 3, 6), 0.5, true);
  const Matrix3 K = rotated(diagonal(.3, .05, .1), 0.4, false);
  const VectorGain gain = vector_peak_gain(Lambda, K, kMass_kg);
  EXPECT_LE(gain.upper, 1 / (1.5 * 1.5 * .05));
  EXPECT_LE(gain.lower, gain.upper);
  EXPECT_TRUE(gain.is_exact()) << gain.lower << " .. " << gain.upper;
}

/// Returns the largest |e| of the theorem's loop under a disturbance rate given per step (classical Runge-Kutta).
double simulated(const Matrix3& Lambda, const Matrix3& K, const std::vector<std::array<double, 3>>& rate,
                 double step_s) {
  using State = std::array<double, 9>;
  const auto slope = [&](const State& x, const std::array<double, 3>& w) {
    State d{};
    for (int i = 0; i < 3; ++i) {
      d[i] = x[3 + i];
      d[3 + i] = x[6 + i];
      d[6 + i] = w[i] / kMass_kg;
      for (int j = 0; j < 3; ++j) {
        d[i] -= Lambda[i][j] * x[j];
        d[3 + i] -= Lambda[i][j] * x[3 + j];
        d[6 + i] -= K[i][j] / kMass_kg * x[6 + j];
      }
    }
    return d;
  };
  const auto plus = [](State x, const State& d, double h) {
    for (int i = 0; i < 9; ++i) x[i] += h * d[i];
    return x;
  };
  State x{};
  double worst = 0;
  for (const auto& w : rate) {
    const State a = slope(x, w), b = slope(plus(x, a, step_s / 2), w), c = slope(plus(x, b, step_s / 2), w);
    const State d = slope(plus(x, c, step_s), w);
    for (int i = 0; i < 9; ++i) x[i] += step_s / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
    worst = std::max(worst, std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]));
  }
  return worst;
}

TEST(VectorGain, NoRandomDisturbanceExceedsItAndARampReachesTheIsotropicBall) {
  const Matrix3 Lambda = diagonal(2, 2, 4), K = diagonal(.2, .2, .05);
  const double upper = vector_peak_gain(Lambda, K, kMass_kg).upper;
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  double best = 0;
  for (int run = 0; run < 300; ++run) {
    std::vector<std::array<double, 3>> rate(1000);
    std::array<double, 3> w{};
    const auto hold = static_cast<unsigned>(1 + random() % 400);
    for (std::size_t i = 0; i < rate.size(); ++i) {
      if (i % hold == 0) {
        double norm = 0;
        for (double& c : w) c = normal(random), norm += c * c;
        for (double& c : w) c /= std::sqrt(norm);
      }
      rate[i] = w;
    }
    best = std::max(best, simulated(Lambda, K, rate, 0.01));
  }
  EXPECT_LE(best, upper);
  EXPECT_GT(best, 0.5 * upper);
  const std::vector<std::array<double, 3>> ramp(1000, {0.6, 0, 0.8});
  const double ball = 0.45955882352941174;
  const double reached = simulated(diagonal(4, 4, 4), diagonal(.136, .136, .136), ramp, 0.01);
  EXPECT_GE(reached, 0.999 * ball);
  EXPECT_LE(reached, ball * (1 + 1e-9));
}

/// A non-symmetric Lambda can exceed d/(l^2 k); check_theorem() rejects it (theorem_test.cpp).
TEST(VectorGain, ANonSymmetricLambdaExceedsTheBallThatItsEigenvaluesSuggest) {
  const Matrix3 Lambda = {{2, 8, 0}, {0, 2, 0}, {0, 0, 2}};  // eigenvalues 2
  const std::vector<std::array<double, 3>> ramp(4000, {0, 1, 0});
  EXPECT_GT(simulated(Lambda, diagonal(.2, .2, .2), ramp, 0.005), 1.5 / (4 * .2));
}

}  // namespace
}  // namespace swarmcert::stability
