// Expected norms: closed forms, e.g. 1 / (m a^3) of a triple pole at -a, and SciPy's DOP853 at a tolerance of 1e-12.
#include "stability/bounds/loops/axis_loop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

constexpr double kMotorLag_s = 1 / 17.4;

AxisLoop pid(double Kp, double Kd, double Ki, double lag_s = 0) { return {kMass_kg, Kp, Kd, Ki, {lag_s}, 0}; }

/// PID gains of s = e' + 2 l e + l^2 int e, force -k s.
AxisLoop composite(double l, double k, double lag_s = 0) {
  return pid(2 * k * l / kMass_kg + l * l, k / kMass_kg + 2 * l, k * l * l / kMass_kg, lag_s);
}

void expect_near(double found, double expected, double relative, const std::string& what) {
  EXPECT_NEAR(found, expected, relative * std::abs(expected)) << what;
}

void expect_norms(const AxisLoop& loop, Channel channel, const GainNorms& expected, double relative) {
  const GainNorms found = continuous_norms(loop, channel);
  expect_near(found.rate, expected.rate, relative, "rate");
  expect_near(found.amplitude, expected.amplitude, relative, "amplitude");
  expect_near(found.edge, expected.edge, relative, "edge");
  expect_near(found.impulse, expected.impulse, relative, "impulse");
}

TEST(AxisLoop, NormsOfTheReferenceTable) {
  const AxisLoop z10 = pid(10, 5, 10), z2 = pid(10, 5, 2);
  const AxisLoop z10_lag = pid(10, 5, 10, kMotorLag_s), z2_lag = pid(10, 5, 2, kMotorLag_s);
  const auto both = [](const AxisLoop& loop, const GainNorms& norms) {
    expect_norms(loop, Channel::kForce, norms, 1e-12);
    expect_norms(loop, Channel::kCommand, norms, 1e-12);
  };
  both(z10, {3.3355994424839928, 4.996850736188977, 2.3070034028059307, 3.8971221387337525});
  both(z2, {14.705882352941176, 5.501897906649084, 2.750948953324542, 3.9559191680230144});
  both(pid(20, 10, 3), {9.80392156862745, 2.6312942804175314, 1.3156471402087657, 2.238900036544028});
  both(pid(12, 8, 8), {3.873454897074157, 3.6649733233234096, 1.783788979076786, 2.8072168107076245});
  expect_norms(z10_lag, Channel::kCommand,
               {3.2720513715606994, 5.167393622819461, 2.4285904137657313, 4.512189658821116}, 1e-12);
  expect_norms(z10_lag, Channel::kForce,
               {3.2744238323274697, 5.197537623447221, 2.4425507988747635, 4.652041227458445}, 1e-12);
  expect_norms(z2_lag, Channel::kForce,
               {14.705882352941176, 5.576787810112013, 2.7883939050560067, 4.686499723003938}, 1e-12);
  expect_norms(composite(4, .136, kMotorLag_s), Channel::kForce,
               {0.459640506737959, 1.1242585194435126, 0.5620846616036054, 2.4804345861755665}, 1e-10);
  expect_norms(composite(4, .136, kMotorLag_s), Channel::kCommand,
               {0.45963913321899275, 1.0910967934013016, 0.5455045485226978, 2.1874088955198268}, 1e-10);
}

TEST(AxisLoop, CompositeGainsReachTheBallWhateverTheirPoles) {
  expect_near(continuous_norms(composite(4, .136), Channel::kForce).rate, 0.45955882352941174, 1e-12, "A1");
  expect_near(continuous_norms(composite(2, .2), Channel::kForce).rate, 1.25, 1e-12, "A2");
  expect_near(continuous_norms(composite(1, .5), Channel::kForce).rate, 2.0, 1e-12, "A3");
  const auto a1 = rate_gains(composite(4, .136)), a2 = rate_gains(composite(2, .2)),
             a3 = rate_gains(composite(1, .5));
  expect_near(a1.velocity, 0.9951123767397978, 1e-12, "A1");
  expect_near(a2.velocity, 1.7168458388077408, 1e-12, "A2");
  expect_near(a3.velocity, 1.4677864975468304, 1e-12, "A3");
  expect_near(a1.acceleration, 4.55900746433278, 1e-12, "A1");
  expect_near(a2.acceleration, 5.4937769487792085, 1e-12, "A2");
  expect_near(a3.acceleration, 3.4428113592496765, 1e-12, "A3");
}

TEST(AxisLoop, TriplePoleHasItsClosedForm) {
  const double a = 3, root2 = std::sqrt(2.0), m = kMass_kg;
  const auto p = [](double x) { return (x - x * x / 2) * std::exp(-x); };
  const GainNorms norms = continuous_norms(composite(a, a * m), Channel::kForce);
  expect_near(norms.rate, 1 / (m * a * a * a), 1e-12, "rate");
  expect_near(norms.amplitude, 4 * std::exp(-2.0) / (m * a * a), 1e-12, "amplitude");
  expect_near(norms.edge, 2 * std::exp(-2.0) / (m * a * a), 1e-12, "edge");
  expect_near(norms.impulse, p(2 - root2) / (m * a), 1e-12, "impulse");
  expect_near(rate_gains(composite(a, a * m)).acceleration, 2 * (p(2 - root2) - p(2 + root2)) / (m * a),
              1e-12, "h''");
}

TEST(AxisLoop, ConstantGainIsNoBoundWherePolesAreComplex) {
  const GainNorms plan = continuous_norms(pid(8, 5, 25), Channel::kForce);
  expect_near(plan.rate, 5.946585563577961, 1e-12, "rate");
  EXPECT_GT(plan.rate, 5 / (kMass_kg * 25));
  expect_near(plan.amplitude, 13.750201294378549, 1e-12, "amplitude");
  const GainNorms stiff = continuous_norms(pid(16, 10, 50), Channel::kForce);
  expect_near(stiff.rate, 1.5166483845285046, 1e-12, "rate");
  expect_near(stiff.amplitude, 3.5076279296008126, 1e-12, "amplitude");
}

TEST(AxisLoop, LagFloorEffortAndLimitsOfTheReference) {
  const double tau = kMotorLag_s;
  const AxisLoop loops[] = {composite(4, .136, tau), composite(2, .2, tau), pid(10, 5, 10, tau),
                            pid(10, 5, 2, tau),      pid(20, 10, 3, tau),   pid(12, 8, 8, tau)};
  const double floors[] = {0.06270671226444263, 0.10173105886631073, 0.2969766449896242,
                           0.31988629213235625, 0.15076528498402805, 0.21196215906294535};
  for (int i = 0; i < 6; ++i) expect_near(lag_floor(loops[i]).rate, floors[i], 1e-10, std::to_string(i));
  expect_near(lag_floor(loops[0]).impulse, 0.9919844469932523, 1e-10, "A1");
  expect_near(lag_floor(loops[2]).impulse, 1.2003998306515078, 1e-10, "Z10");
  expect_near(lag_floor(loops[3]).impulse, 1.2006481014017532, 1e-10, "Z2");
  expect_near(lag_floor(loops[4]).impulse, 1.0454130788417815, 1e-10, "XY");
  expect_near(lag_floor(loops[5]).impulse, 1.099903671511607, 1e-10, "D");
  expect_near(effort_gain(composite(4, .136)), 1.4601400468320445, 1e-10, "A1");
  expect_near(effort_gain(loops[0]), 2.226779571754574, 1e-10, "A1 lag");
  expect_near(effort_gain(pid(10, 5, 10)), 1.6626542404938, 1e-10, "Z10");
  expect_near(effort_gain(loops[2]), 1.8597421810706758, 1e-10, "Z10 lag");
  expect_near(effort_gain(pid(20, 10, 3)), 1.2443103223815202, 1e-10, "XY");
  expect_near(effort_gain(loops[4]), 1.6229079068666041, 1e-10, "XY lag");
  expect_near(effort_gain(pid(12, 8, 8)), 1.3088765781842802, 1e-10, "D");
  expect_near(effort_gain(loops[5]), 1.520321568066687, 1e-10, "D lag");
  expect_near(lag_limit(composite(4, .136)), 0.2222222222222222, 1e-12, "A1");
  expect_near(lag_limit(pid(10, 5, 10)), 0.4, 1e-12, "Z");
  expect_near(lag_limit(pid(20, 10, 3)), 0.4925, 1e-12, "XY");
  expect_near(lag_limit(pid(8, 5, 25)), 0.234375, 1e-12, "planning");
}

TEST(AxisLoop, StabilityEndsAtTheLagLimitAndAtTheDelayLimit) {
  for (const AxisLoop& loop : {pid(10, 5, 10), pid(20, 10, 3, kMotorLag_s)}) {
    AxisLoop lagged = loop;
    lagged.lags_s.push_back(lag_limit(loop) * 0.999);
    EXPECT_TRUE(is_stable(lagged));
    lagged.lags_s.back() = lag_limit(loop) * 1.001;
    EXPECT_FALSE(is_stable(lagged));
    EXPECT_TRUE(std::isinf(continuous_norms(lagged, Channel::kForce).amplitude));
    AxisLoop late = loop;
    late.delay_s = 0.97 * delay_limit(loop);
    EXPECT_TRUE(is_stable(late));
    EXPECT_TRUE(std::isfinite(continuous_norms(late, Channel::kForce).amplitude));
    late.delay_s = 1.001 * delay_limit(loop);
    EXPECT_FALSE(is_stable(late));
  }
}

TEST(AxisLoop, AVeryShortDelayChangesNormsInProportion) {
  const GainNorms without = continuous_norms(pid(10, 5, 10, kMotorLag_s), Channel::kForce);
  AxisLoop late = pid(10, 5, 10, kMotorLag_s);
  double change[2];
  for (int i = 0; i < 2; ++i) {
    late.delay_s = i == 0 ? 1e-3 : 2e-3;
    change[i] = continuous_norms(late, Channel::kForce).amplitude - without.amplitude;
  }
  EXPECT_NEAR(change[1] / change[0], 2, 0.02);
  EXPECT_LT(std::abs(change[0]), 0.01 * without.amplitude);
}

/// A delay is approximated by a chain of n lags of T/n, with an error of order 1/n: extrapolated from n = 16 and 32.
TEST(AxisLoop, ADelayIsTheLimitOfManyLags) {
  AxisLoop late = pid(10, 5, 10);
  late.delay_s = 0.05;
  const GainNorms exact = continuous_norms(late, Channel::kCommand);
  double chain[2];
  for (int i = 0; i < 2; ++i) {
    const int n = i == 0 ? 16 : 32;
    AxisLoop lags = pid(10, 5, 10);
    lags.lags_s.assign(static_cast<std::size_t>(n), 0.05 / n);
    chain[i] = continuous_norms(lags, Channel::kCommand).amplitude;
  }
  EXPECT_NEAR(2 * chain[1] - chain[0], exact.amplitude, 1e-4 * exact.amplitude);
}

TEST(AxisLoop, ADelayedLoopWithASlowIntegratorIsSummedToItsEnd) {
  // The slow mode has time constants from 10 s to two days: its integral is added in closed form and must match the sum
  // of the pieces. If h does not change its sign, the error under a ramp is 1/(m Ki) for any lag and delay.
  for (const double Ki : {2.0, 0.6, 0.01, 1e-4}) {
    const AxisLoop loop = {0.034, 20, 10, Ki, {0.0575, 0.1}, 0.004};
    const GainNorms norms = continuous_norms(loop, Channel::kForce);
    EXPECT_NEAR(norms.rate, 1 / (loop.mass_kg * Ki), 1e-9 / (loop.mass_kg * Ki)) << Ki;
    if (Ki < 0.1) continue;  // the grid would need hours of flight
    // Compared with a plain sum over 500 s, where e^-15 is left: independent of the closed form of the tail.
    constexpr double kStep_s = 2e-3;
    double area = 0, peak = 0;
    for (const double y : sampled_response(impulse_transfer(loop, Channel::kForce), kStep_s, 250'000)) {
      area += std::abs(y) * kStep_s;
      peak = std::max(peak, std::abs(y));
    }
    EXPECT_NEAR(norms.amplitude, area, 1e-3 * area) << Ki;
    EXPECT_NEAR(norms.impulse, peak, 1e-3 * peak) << Ki;
  }
}

TEST(AxisLoop, WithoutIntegralARampHasNoBoundAndTheRestHas) {
  const GainNorms norms = continuous_norms(pid(10, 5, 0), Channel::kForce);
  EXPECT_TRUE(std::isinf(norms.rate));
  // A second-order system whose step response 1/(m Kp) has an overshoot of exp(-pi zeta / sqrt(1 - zeta^2)).
  const double zeta = 5 / (2 * std::sqrt(10.0));
  const double overshoot = std::exp(-std::acos(-1.0) * zeta / std::sqrt(1 - zeta * zeta));
  expect_near(norms.edge, (1 + overshoot) / (kMass_kg * 10), 1e-12, "edge");
  // Total variation of this step response: the sum of its swings.
  expect_near(norms.amplitude, (1 + overshoot) / (1 - overshoot) / (kMass_kg * 10), 1e-12, "amplitude");
}

TEST(AxisLoop, AClampedIntegratorLeavesAResidual) {
  EXPECT_NEAR(clamp_residual(pid(10, 5, 10), 0.0883, 0.1), 0.1597058823529412, 1e-15);
  EXPECT_EQ(clamp_residual(pid(10, 5, 10), 0.0883, INFINITY), 0);
}

/// A sum over a fine grid, which does not locate zeros, agrees for random loops with any pole pattern.
TEST(AxisLoop, NormsAgreeWithGridSumsOnRandomLoops) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  int compared = 0;
  int oscillating = 0;
  while (compared < 16) {
    const double Kp = std::exp(3.5 * unit(random)), Kd = std::exp(3 * unit(random)),
                 Ki = std::exp(4 * unit(random) - 1);
    AxisLoop loop = pid(Kp, Kd, Ki, 0.1 * unit(random));
    loop.lags_s.push_back(0.1 * unit(random));
    if (!is_stable(loop)) continue;
    double slowest = 1e9;
    for (const auto& pole : poles(sum(step_transfer(loop, Channel::kForce).denominator,
                                      step_transfer(loop, Channel::kForce).feedback)))
      slowest = std::min(slowest, -pole.real());
    if (slowest < 0.02) continue;
    ++compared;
    const Channel channel = compared % 2 == 0 ? Channel::kForce : Channel::kCommand;
    const double horizon_s = 30 / slowest;
    const int count = 200001;
    const std::vector<double> h =
        sampled_response(step_transfer(loop, channel), horizon_s / (count - 1), count);
    double rate = 0, amplitude = 0, edge = 0;
    int swings = 0;
    for (std::size_t i = 1; i < h.size(); ++i) {
      rate += (std::abs(h[i]) + std::abs(h[i - 1])) / 2 * horizon_s / (count - 1);
      amplitude += std::abs(h[i] - h[i - 1]);
      edge = std::max(edge, std::abs(h[i]));
      swings += h[i] * h[i - 1] < 0;
    }
    oscillating += swings > 2;
    const GainNorms norms = continuous_norms(loop, channel);
    SCOPED_TRACE("Kp " + std::to_string(Kp) + " Kd " + std::to_string(Kd) + " Ki " + std::to_string(Ki));
    EXPECT_NEAR(norms.rate, rate, 5e-5 * rate);
    EXPECT_NEAR(norms.amplitude, amplitude, 5e-5 * amplitude);
    EXPECT_NEAR(norms.edge, edge, 5e-5 * edge);
  }
  EXPECT_GT(oscillating, 2);
}

}  // namespace
}  // namespace swarmcert::stability
