// Filters compared with their defining properties: a Butterworth filter's gain at its cutoff, a delay's effect on a
// ramp.
#include "stability/simulation/sensors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "stability/simulation/radio.h"

namespace swarmcert::stability {
namespace {

constexpr double kRate_hz = 1000;

/// Returns the amplitude of the filtered sine of `frequency_hz` in steady state, from its mean square over whole
/// periods.
double gain_at(double frequency_hz, double cutoff_hz) {
  LowPass filter(cutoff_hz, kRate_hz);
  double squares = 0;
  for (int i = 0; i < 4000; ++i) {
    const double u = std::sin(2 * 3.14159265358979323846 * frequency_hz * i / kRate_hz);
    const double y = filter.filter({u, 0, -u}).x();
    if (i >= 2000) squares += y * y;
  }
  return std::sqrt(2 * squares / 2000);
}

TEST(Sensors, LowPassHasTheGainsOfAButterworthFilterOfSecondOrder) {
  // |H|^2 = 1 / (1 + (w / w_c)^4) in frequencies warped by the bilinear transform, w = tan(pi f / rate).
  for (const double cutoff_hz : {30.0, 80.0}) {
    for (const double f : {5.0, 30.0, 80.0, 200.0}) {
      const double ratio = std::tan(M_PI * f / kRate_hz) / std::tan(M_PI * cutoff_hz / kRate_hz);
      EXPECT_NEAR(gain_at(f, cutoff_hz), 1 / std::sqrt(1 + std::pow(ratio, 4)), 1e-9) << f;
    }
  }
}

TEST(Sensors, LowPassStartsWithoutTransient) {
  LowPass filter(30, kRate_hz);
  for (int i = 0; i < 100; ++i) EXPECT_NEAR(filter.filter({0, 0, 9.81}).z(), 9.81, 1e-12);
}

TEST(Sensors, DelayedSignalShowsARampAsLateAsItSays) {
  constexpr double kPeriod_s = 0.01, kDelay_s = 0.034, kGain = 0.5, kSlope = 3;
  DelayedSignal delayed(kDelay_s, kGain, kPeriod_s);
  for (int i = 0; i < 50; ++i) {
    const double t = i * kPeriod_s, u = kSlope * t;
    const double y = delayed.filter({u, 0, 0}).x();
    if (t < kDelay_s + kPeriod_s) continue;
    EXPECT_NEAR(y, u - kGain * kSlope * kDelay_s, 1e-12) << t;
  }
}

TEST(Sensors, MilliTruncatesTowardsZeroAndWrapsAsFirmwareDoes) {
  EXPECT_EQ(milli(1.2349), 1234);
  EXPECT_EQ(milli(-1.2349), -1234);
  EXPECT_EQ(milli(32.768), -32768);
}

/// Vehicle 0's knowledge of vehicle 1, which moves at 0.5 m/s along x, after a second of broadcasts every 10 ms.
struct Known {
  double x_m = 0, velocity_m_s = 0, weight = 0;
};

Known after_a_second(const RadioOptions& options) {
  Radio radio(2, 0.01, options);
  files::Random random(1);
  Eigen::Vector3d other = Eigen::Vector3d::Zero();
  std::uint32_t now_ms = 0;
  for (; now_ms <= 1000; now_ms += 10) {
    other.x() = 0.5e-3 * now_ms;
    radio.broadcast({Eigen::Vector3d(0, 0, -0.3), other}, now_ms, random);
  }
  Neighbour truth;
  Instant now;
  now.p_W_m = {0, 0, -0.3};
  now.neighbours = &truth;
  now.num_neighbours = 1;
  std::vector<Neighbour> neighbours;
  std::vector<double> weights;
  radio.look(0, now_ms - 10, &now, neighbours, weights);
  return {neighbours[0].dp_W_m.x(), neighbours[0].v_W_m_s.x(), weights[0]};
}

TEST(Radio, ShowsPositionsAsLateAsItsLatencyAndVelocitiesAsDifferences) {
  const Known fresh = after_a_second({});
  EXPECT_NEAR(fresh.x_m, 0.5, 1e-12);
  EXPECT_NEAR(fresh.velocity_m_s, 0.5, 1e-9);
  EXPECT_EQ(fresh.weight, 1);
  const Known late = after_a_second({0.04, 0});
  EXPECT_NEAR(late.x_m, 0.5 - 0.5 * 0.04, 1e-12);
  EXPECT_NEAR(late.velocity_m_s, 0.5, 1e-9);
}

TEST(Radio, KnowsNothingWhereEveryPositionIsLost) { EXPECT_EQ(after_a_second({0, 1}).weight, 0); }

}  // namespace
}  // namespace swarmcert::stability
