// The gains that `bound` reports, compared with loops stepped through time.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "stability/bounds/loops/axis_loop.h"
#include "stepped_loop.h"

namespace swarmcert::stability {
namespace {

/// Gains from an equidistantly sampled kernel.
GainNorms summed(const std::vector<double>& kernel, double step_s, bool integrates) {
  GainNorms gains;
  double S = 0;
  for (std::size_t i = 0; i < kernel.size(); ++i) {
    gains.impulse = std::max(gains.impulse, std::abs(kernel[i]));
    if (i == 0) continue;
    const double before = S;
    S += (kernel[i] + kernel[i - 1]) / 2 * step_s;
    gains.amplitude += (std::abs(kernel[i]) + std::abs(kernel[i - 1])) / 2 * step_s;
    gains.edge = std::max(gains.edge, std::abs(S));
    gains.rate += (std::abs(S) + std::abs(before)) / 2 * step_s;
  }
  if (!integrates) gains.rate = std::numeric_limits<double>::infinity();
  return gains;
}

/// One loop of the sweep: lags, delays, weak and strong integrals, short integrator steps.
struct Drawn {
  SampledLoop loop;
  double slowest_s = 0;  ///< duration of the stepping
};

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}

  Drawn next() {
    while (true) {
      AxisLoop plant;
      plant.mass_kg = log_between(0.02, 1.5);
      plant.Kp = log_between(2, 40);
      plant.Kd = log_between(1.5, 15);
      plant.Ki = unit() < 0.15 ? 0 : plant.Kp * log_between(0.15, 1.5);
      if (unit() < 0.6) plant.lags_s.push_back(log_between(0.01, 0.08));
      if (unit() < 0.3) plant.lags_s.push_back(log_between(0.01, 0.1));
      const double rates_hz[] = {50, 100, 250, 500};
      const double period_s = 1 / rates_hz[static_cast<int>(4 * unit())];
      if (unit() < 0.4) plant.delay_s = period_s * static_cast<int>(1 + 8 * unit()) / 4;
      const double shares[] = {1, 1, 0.2, 0.5};
      SampledLoop loop = {plant, period_s, period_s * shares[static_cast<int>(4 * unit())]};
      const double radius = spectral_radius(loop);
      if (!(radius < 1) || !is_stable(plant) || !(lag_limit(plant) > 0.01)) continue;
      const double time_s = -period_s / std::log(radius);
      if (time_s > 8) continue;
      return {loop, 25 * std::max({time_s, plant.Ki > 0 ? plant.Kp / plant.Ki : 1.0, 2 / plant.Kd, 0.5})};
    }
  }

 private:
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  double log_between(double a, double b) { return a * std::pow(b / a, unit()); }
  std::mt19937 random_;
};

/// Difference relative to the larger of the two.
double apart(double a, double b) {
  if (std::isinf(a) && std::isinf(b)) return 0;
  return std::abs(a - b) / std::max(std::abs(a), std::abs(b));
}

void expect_same(const GainNorms& found, const GainNorms& stepped, double tolerance) {
  EXPECT_LT(apart(found.rate, stepped.rate), tolerance) << found.rate << " " << stepped.rate;
  EXPECT_LT(apart(found.amplitude, stepped.amplitude), tolerance)
      << found.amplitude << " " << stepped.amplitude;
  EXPECT_LT(apart(found.edge, stepped.edge), tolerance) << found.edge << " " << stepped.edge;
  EXPECT_LT(apart(found.impulse, stepped.impulse), tolerance) << found.impulse << " " << stepped.impulse;
}

void check_continuous(const Drawn& drawn) {
  const AxisLoop& plant = drawn.loop.plant;
  const bool integrates = plant.Ki > 0;
  const double step_s = drawn.loop.period_s / 4 / std::ceil(drawn.loop.period_s / 4 / 5e-4);
  const auto most = static_cast<std::size_t>(40 * drawn.slowest_s / step_s);
  const auto window = static_cast<std::size_t>(2 / step_s);
  SteppedLoop loop(plant, step_s);
  std::vector<double> kernel;
  loop.place(0, 1 / plant.mass_kg);
  kernel.push_back(0);
  // Until the kernel has decayed, which may take longer than for the sampled loop, whose integral may be weaker.
  double peak = 0, recent = 0;
  while (kernel.size() < most) {
    kernel.push_back(loop.step(0, 0));
    peak = std::max(peak, std::abs(kernel.back()));
    recent = std::max(recent, std::abs(kernel.back()));
    if (kernel.size() % window != 0) continue;
    if (static_cast<double>(kernel.size()) * step_s > drawn.slowest_s && recent < 1e-9 * peak) break;
    recent = 0;
  }
  expect_same(continuous_norms(plant, Channel::kForce), summed(kernel, step_s, integrates), 1e-4);
}

void check_sampled(const Drawn& drawn) {
  const SampledLoop& sampled = drawn.loop;
  const AxisLoop& plant = sampled.plant;
  const double h = sampled.period_s;
  const auto periods = static_cast<std::size_t>(drawn.slowest_s / h);
  constexpr int kSteps = 4;   // the delay is a whole number of them
  constexpr int kPhases = 8;  // of the force's impulse within a period
  SteppedLoop loop(sampled, kSteps);
  // Until the next sample the vehicle drifts: e = u/m, e' = 1/m, with u the time from the impulse to the sample.
  std::vector<std::vector<double>> errors;
  for (int i = 0; i <= kPhases; ++i) {
    loop.reset();
    loop.place(h * i / kPhases / plant.mass_kg, 1 / plant.mass_kg);
    std::vector<double> at = {h * i / kPhases / plant.mass_kg};
    while (at.size() < periods) {
      double e = 0;
      for (int k = 0; k < kSteps; ++k) e = loop.step(0, 0);
      at.push_back(e);
    }
    errors.push_back(std::move(at));
  }
  // Ordered by the time from the impulse to the sample; jumps where the impulse passes a sample.
  GainNorms force;
  double S = 0;
  for (std::size_t k = 0; k < periods; ++k) {
    for (int i = 0; i <= kPhases; ++i) {
      const double here = errors[static_cast<std::size_t>(i)][k];
      force.impulse = std::max(force.impulse, std::abs(here));
      if (i == 0) continue;
      const double last = errors[static_cast<std::size_t>(i) - 1][k];
      const double before = S;
      S += (here + last) / 2 * h / kPhases;
      force.amplitude += (std::abs(here) + std::abs(last)) / 2 * h / kPhases;
      force.edge = std::max(force.edge, std::abs(S));
      force.rate += (std::abs(S) + std::abs(before)) / 2 * h / kPhases;
    }
  }
  GainNorms command;
  loop.reset();
  S = 0;
  for (std::size_t k = 0; k < periods; ++k) {
    double e = 0;
    for (int i = 0; i < kSteps; ++i) e = loop.step(0, 0, k == 0 ? 1 : 0);
    S += e;
    command.amplitude += std::abs(e);
    command.impulse = std::max(command.impulse, std::abs(e) / h);
    command.edge = std::max(command.edge, std::abs(S));
    command.rate += std::abs(S) * h;
  }
  if (plant.Ki == 0) force.rate = command.rate = std::numeric_limits<double>::infinity();
  expect_same(sampled_norms(sampled, Channel::kForce, Instants::kSampling), force, 2e-4);
  expect_same(sampled_norms(sampled, Channel::kCommand, Instants::kSampling), command, 1e-5);
}

void sweep(unsigned seed, int count) {
  Draw draw(seed);
  int with_delay = 0, with_short_step = 0, without_integral = 0;
  for (int i = 0; i < count; ++i) {
    const Drawn drawn = draw.next();
    const AxisLoop& plant = drawn.loop.plant;
    SCOPED_TRACE(testing::Message() << "Kp " << plant.Kp << " Kd " << plant.Kd << " Ki " << plant.Ki
                                    << " delay " << plant.delay_s << " lags " << plant.lags_s.size()
                                    << " period " << drawn.loop.period_s << " step "
                                    << drawn.loop.integrator_step_s);
    with_delay += plant.delay_s > 0;
    with_short_step += drawn.loop.integrator_step_s < drawn.loop.period_s;
    without_integral += plant.Ki == 0;
    check_continuous(drawn);
    check_sampled(drawn);
  }
  EXPECT_GT(with_delay, count / 8);
  EXPECT_GT(with_short_step, count / 8);
  EXPECT_GT(without_integral, 0);
}

TEST(GainsByStepping, AgreeForLoopsOfManyKinds) { sweep(3, 16); }

TEST(GainsByStepping, AgreeForTwoHundredLoops_slow) { sweep(4, 200); }

}  // namespace
}  // namespace swarmcert::stability
