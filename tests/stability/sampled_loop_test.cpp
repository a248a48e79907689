// Expected norms: an independent program that sums the response by SciPy's matrix exponential, at the worst sampling
// phase.
#include "stability/bounds/loops/sampled_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <random>

#include "stability/bounds/tracking_bounds.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

SampledLoop sampled(double Kp, double Kd, double Ki, double rate_hz, double step_s = 0, double delay_s = 0,
                    double lag_s = 0) {
  return {{kMass_kg, Kp, Kd, Ki, {lag_s}, delay_s}, 1 / rate_hz, step_s > 0 ? step_s : 1 / rate_hz};
}

TEST(SampledLoop, NormsOfTheReferenceTable) {
  struct Row {
    double Kp, Kd, Ki;
    double GainNorms::*which;
    double at_1kHz, at_500Hz, at_500Hz_late, at_100Hz, at_100Hz_short_step;
  };
  const Row rows[] = {
      {48, 12, 64, &GainNorms::rate, .45955882, .45955882, .45955883, .45955882, 2.29779412},
      {48, 12, 64, &GainNorms::amplitude, .995112641, .995113432, .998348170, .995138042, 1.147289127},
      {10, 5, 10, &GainNorms::rate, 3.333246329, 3.330897826, 3.326691089, 3.312277050, 14.705882353},
      {10, 5, 10, &GainNorms::amplitude, 4.995020814, 4.993197363, 5.002062719, 4.978843651, 5.501886995},
      // The last number is the sum up to 1000 s; the sum up to 200 s is 2.830861031.
      {20, 10, 3, &GainNorms::amplitude, 2.631073843, 2.630853459, 2.630350672, 2.629092073, 2.834290230},
  };
  for (const Row& row : rows) {
    SCOPED_TRACE(testing::Message() << "Kp " << row.Kp);
    const auto gain = [&row](double rate_hz, double step_s, double delay_s) {
      return sampled_norms(sampled(row.Kp, row.Kd, row.Ki, rate_hz, step_s, delay_s), Channel::kForce,
                           Instants::kSampling).*
             row.which;
    };
    EXPECT_NEAR(gain(1000, 0, 0), row.at_1kHz, 1e-8);
    EXPECT_NEAR(gain(500, 0, 0), row.at_500Hz, 1e-8);
    EXPECT_NEAR(gain(500, 0, 0.004), row.at_500Hz_late, 1e-8);
    EXPECT_NEAR(gain(100, 0, 0), row.at_100Hz, 1e-7);  // the reference's quadrature errs by 8e-8 for Z
    EXPECT_NEAR(gain(100, 0.002, 0), row.at_100Hz_short_step, 1e-7);
  }
}

TEST(SampledLoop, SpectralRadiiOfTheReference) {
  EXPECT_NEAR(spectral_radius(sampled(48, 12, 64, 500)), .9928204588, 1e-9);
  EXPECT_NEAR(spectral_radius(sampled(10, 5, 10, 500)), .9976433756, 1e-9);
  EXPECT_NEAR(spectral_radius(sampled(20, 10, 3, 500)), .9996739496, 1e-9);
}

/// Public firmware runs the loop at 100 Hz with an integrator step of 2 ms: the theorem's ball is five times larger.
TEST(SampledLoop, AShortIntegratorStepWeakensTheIntegralGain) {
  const SampledLoop fork = sampled(48, 12, 64, 100, 0.002);
  EXPECT_NEAR(effective_Ki(fork), 64.0 / 5, 1e-12);
  const double ball = 1 / (kMass_kg * 64);
  EXPECT_NEAR(sampled_norms(fork, Channel::kForce, Instants::kSampling).rate, 5 * ball, 1e-8);
}

TEST(SampledLoop, ErrorsBetweenSamplesAreHardlyLarger) {
  const SampledLoop loop = sampled(10, 5, 10, 100);
  const GainNorms at_samples = sampled_norms(loop, Channel::kForce, Instants::kSampling);
  const GainNorms all = sampled_norms(loop, Channel::kForce, Instants::kAll);
  EXPECT_GE(all.rate, at_samples.rate);
  EXPECT_GT(all.amplitude, at_samples.amplitude);
  EXPECT_LT(all.amplitude, at_samples.amplitude * (1 + 1e-6));
}

/// The numbers for the shipped gains in sampled_loop.h.
TEST(SampledLoop, ErrorsBetweenSamplesOfTheShippedGainsAreLargerByWhatTheHeaderStates) {
  const std::filesystem::path folder = std::filesystem::path(SWARMCERT_SOURCE_DIR) / "controller/gains";
  double rate = 0, amplitude = 0, edge = 0, impulse = 0;
  int loops = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    if (file.path().extension() != ".toml") continue;
    const Gains gains = load_gains(file.path().string());
    for (const int axis : {0, 2}) {
      const std::optional<SampledLoop> loop = FlownLoop{gains, {kMass_kg}}.sampled(axis);
      if (!loop) continue;
      ++loops;
      for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
        const GainNorms at = sampled_norms(*loop, channel, Instants::kSampling);
        const GainNorms all = sampled_norms(*loop, channel, Instants::kAll);
        rate = std::max(rate, all.rate / at.rate - 1);
        amplitude = std::max(amplitude, all.amplitude / at.amplitude - 1);
        edge = std::max(edge, all.edge / at.edge - 1);
        impulse = std::max(impulse, all.impulse / at.impulse - 1);
      }
    }
  }
  EXPECT_GE(loops, 8);
  EXPECT_LE(rate, 1e-7);
  EXPECT_LE(amplitude, 1e-4);
  EXPECT_LE(edge, 1e-4);
  EXPECT_LE(impulse, 4e-4);
  EXPECT_GT(amplitude, 5e-5) << "the header states the order of magnitude";
  EXPECT_GT(impulse, 2e-4);
}

TEST(SampledLoop, TendsToTheContinuousLoop) {
  const AxisLoop plant = {kMass_kg, 10, 5, 10, {1 / 17.4, 0.03}, 0.013};
  for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
    const GainNorms exact = continuous_norms(plant, channel);
    // Holding a command for a period delays it by half a period, which is subtracted from the delay.
    AxisLoop early = plant;
    early.delay_s -= 0.00025;
    const GainNorms fast = sampled_norms({early, 0.0005, 0.0005}, channel, Instants::kSampling);
    EXPECT_NEAR(fast.amplitude, exact.amplitude, 1e-3 * exact.amplitude);
    EXPECT_NEAR(fast.rate, exact.rate, 2e-3 * exact.rate);
    EXPECT_NEAR(fast.edge, exact.edge, 1e-3 * exact.edge);
    EXPECT_NEAR(fast.impulse, exact.impulse, 5e-3 * exact.impulse);
  }
}

/// Returns the largest |e| of the sampled loop, without lag or delay, under a force given per quarter of a period.
double simulated_error(const SampledLoop& loop, const std::vector<double>& force_N) {
  const double h = loop.period_s / 4, m = loop.plant.mass_kg;
  double p = 0, v = 0, integral = 0, command = 0, worst = 0;
  for (std::size_t i = 0; i < force_N.size(); ++i) {
    if (i % 4 == 0) {
      integral += loop.integrator_step_s * p;
      command = -(loop.plant.Kp * p + loop.plant.Kd * v + loop.plant.Ki * integral);
    }
    const double a = command + force_N[i] / m;
    p += v * h + a * h * h / 2;
    v += a * h;
    worst = std::max(worst, std::abs(p));
  }
  return worst;
}

TEST(SampledLoop, NoRandomForceExceedsTheAmplitudeBoundAndBangBangNearsIt) {
  const SampledLoop loop = sampled(10, 5, 10, 100);
  const double bound = sampled_norms(loop, Channel::kForce, Instants::kAll).amplitude;
  // The signs of the response to a pulse, backwards: the worst force.
  const std::size_t count = 4 * 2000;
  std::vector<double> kernel;
  {
    const double h = loop.period_s / 4;
    double p = 0, v = h / kMass_kg, integral = 0, command = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (i % 4 == 0) {
        integral += loop.integrator_step_s * p;
        command = -(loop.plant.Kp * p + loop.plant.Kd * v + loop.plant.Ki * integral);
      }
      p += v * h + command * h * h / 2;
      v += command * h;
      kernel.push_back(p);
    }
  }
  std::vector<double> force(count);
  for (std::size_t i = 0; i < count; ++i) force[i] = kernel[count - 1 - i] > 0 ? 1 : -1;
  const double reached = simulated_error(loop, force);
  EXPECT_LE(reached, bound * (1 + 1e-12));
  EXPECT_GE(reached, 0.999 * bound);
  std::mt19937 random(3);
  for (int run = 0; run < 2000; ++run) {
    const int hold = 1 + static_cast<int>(random() % 400);
    double level = 1;
    for (std::size_t i = 0; i < force.size(); ++i) {
      if (i % static_cast<std::size_t>(hold) == 0) level = static_cast<double>(random() % 2001) / 1000.0 - 1;
      force[i] = run % 2 == 0 ? level : (level > 0 ? 1 : -1);
    }
    ASSERT_LE(simulated_error(loop, force), bound);
  }
}

TEST(SampledLoop, NoiseDeviationAgreesWithAMonteCarloRun) {
  const SampledLoop loop = sampled(10, 5, 10, 500);
  const NoiseDeviation expected = noise_deviation(loop, 0.001, 0.02);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  double p = 0, v = 0, integral = 0, sum_p = 0, sum_u = 0;
  const int count = 2'000'000;
  for (int i = 0; i < count; ++i) {
    const double mp = p + 0.001 * normal(random), mv = v + 0.02 * normal(random);
    integral += loop.integrator_step_s * mp;
    const double u = -(10 * mp + 5 * mv + 10 * integral);
    sum_p += p * p;
    sum_u += u * u;
    p += v * 0.002 + u * 2e-6;
    v += u * 0.002;
  }
  EXPECT_NEAR(std::sqrt(sum_p / count), expected.error_m, 0.05 * expected.error_m);
  EXPECT_NEAR(std::sqrt(sum_u / count), expected.command_m_s2, 0.01 * expected.command_m_s2);
}

TEST(SampledLoop, WithoutIntegralTheRestIsFiniteAndNearTheContinuousLoop) {
  const GainNorms norms = sampled_norms(sampled(10, 5, 0, 500), Channel::kForce, Instants::kSampling);
  const GainNorms exact = continuous_norms({kMass_kg, 10, 5, 0, {}, 0}, Channel::kForce);
  EXPECT_TRUE(std::isinf(norms.rate));
  EXPECT_NEAR(norms.amplitude, exact.amplitude, 0.01 * exact.amplitude);
  EXPECT_NEAR(norms.edge, exact.edge, 0.01 * exact.edge);
  EXPECT_TRUE(std::isfinite(noise_deviation(sampled(10, 5, 0, 500), 1e-3, 0.05).command_m_s2));
}

/// One slow mode remains for hours: its geometric series is summed. The rate gain is at least that of a ramp, 1/(m Ki),
/// with equality for a response of one sign.
TEST(SampledLoop, AVerySlowIntegratorCostsNoTimeAndHasItsClosedForm) {
  for (const double Ki : {1e-3, 1e-6}) {
    for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
      const GainNorms norms = sampled_norms(sampled(12, 8, Ki, 500), channel, Instants::kSampling);
      const GainNorms exact = continuous_norms({kMass_kg, 12, 8, Ki, {}, 0}, channel);
      EXPECT_NEAR(norms.rate * kMass_kg * Ki, 1, 1e-6);
      EXPECT_NEAR(norms.amplitude, exact.amplitude, 5e-3 * exact.amplitude);
      EXPECT_NEAR(norms.edge, exact.edge, 5e-3 * exact.edge);
    }
  }
}

/// The same results with and without the geometric series: a plain sum over a million periods.
TEST(SampledLoop, TheSeriesOfTheLastModeEqualsThePlainSum) {
  const SampledLoop loop = sampled(9, 4, 0.3, 200, 0.002);
  const GainNorms norms = sampled_norms(loop, Channel::kCommand, Instants::kSampling);
  double p = 0, v = 0, integral = 0, late = 1 / kMass_kg, step = 0, rate = 0, amplitude = 0, edge = 0;
  const double T = loop.period_s;
  for (int k = 0; k < 1'000'000; ++k) {  // an error of the command of 1 N in the first period
    integral += loop.integrator_step_s * p;
    const double u = -(9 * p + 4 * v + 0.3 * integral) + late;
    late = 0;
    p += v * T + u * T * T / 2;
    v += u * T;
    step += p;
    amplitude += std::abs(p);
    rate += std::abs(step) * T;
    edge = std::max(edge, std::abs(step));
  }
  EXPECT_NEAR(norms.amplitude, amplitude, 1e-9 * amplitude);
  EXPECT_NEAR(norms.rate, rate, 1e-7 * rate);
  EXPECT_NEAR(norms.edge, edge, 1e-9 * edge);
}

TEST(SampledLoop, AnUnstableLoopHasNoFiniteGain) {
  EXPECT_TRUE(std::isinf(sampled_norms(sampled(10, 5, 10, 2), Channel::kForce, Instants::kAll).amplitude));
  EXPECT_TRUE(std::isinf(noise_deviation(sampled(10, 5, 10, 2), 1, 1).error_m));
}

}  // namespace
}  // namespace swarmcert::stability
