// Random and adversarial inputs of every disturbance class: none may exceed its bound.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <random>
#include <string>

#include "stability/bounds/disturbance_bounds.h"
#include "stability/bounds/sampled_bounds.h"
#include "stability/vehicle.h"
#include "stepped_loop.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

constexpr double kInputStep_s = 0.0025;
constexpr int kInputSteps = 2400;  // 6 s

/// A piecewise linear force with jumps between steps.
struct Input {
  std::vector<double> from, to;
  Input() : from(kInputSteps), to(kInputSteps) {}
  void constant(int step, double value) {
    from[static_cast<std::size_t>(step)] = to[static_cast<std::size_t>(step)] = value;
  }
};

/// Draws inputs of one class with the largest allowed magnitude. Every other one follows the sign of the kernel back
/// from a random time, with random mistakes; without mistakes it would be the worst input.
class Inputs {
 public:
  Inputs(unsigned seed, std::vector<double> kernel) : random_(seed), kernel_(std::move(kernel)) {}

  Input amplitude(double E) {
    const std::vector<double> sign = signs(kernel_);
    Input f;
    for (int i = 0; i < kInputSteps; ++i) f.constant(i, E * sign[static_cast<std::size_t>(i)]);
    return f;
  }
  Input rate(double d) {
    return integrated(d, std::numeric_limits<double>::infinity(), signs(step_of_kernel()));
  }
  Input amplitude_and_rate(double E, double d) { return integrated(d, E, signs(kernel_)); }

  /// Jumps and ramps whose sum is the variation.
  Input edges(double variation) {
    Input f;
    const int jumps = 1 + static_cast<int>(4 * unit() * unit());
    std::vector<double> share = shares(jumps);
    std::vector<std::pair<int, double>> events;
    for (const double s : share)
      events.emplace_back(static_cast<int>(kInputSteps * unit()), (unit() < 0.5 ? -1 : 1) * s);
    std::sort(events.begin(), events.end());
    double value = 0;
    std::size_t next = 0;
    for (int i = 0; i < kInputSteps; ++i) {
      while (next < events.size() && events[next].first <= i) value += variation * events[next++].second;
      f.constant(i, value);
    }
    return f;
  }

  /// `passes` passes with int |f| dt = J each, at most `length` steps long, `period` steps apart.
  Input impulses(double J, int passes, int period, int length) {
    Input f;
    const int first = static_cast<int>((kInputSteps - passes * period) * unit());
    for (int k = 0; k < passes; ++k) {
      const int start = first + k * period;
      const int used = 1 + static_cast<int>(length * unit() * unit());
      const double tilt = unit() < 0.5 ? 1 : 2 * unit() - 1;  // part of it may push in the opposite direction
      double total = 0;
      for (int i = 0; i < used && start + i < kInputSteps; ++i) {
        const double value = (i < used * std::abs(tilt) ? 1 : -1) * (0.2 + unit());
        f.constant(start + i, value);
        total += std::abs(value) * kInputStep_s;
      }
      const double sign = unit() < 0.5 ? -1 : 1;
      for (int i = 0; i < used && start + i < kInputSteps; ++i) {
        f.constant(start + i, sign * f.from[static_cast<std::size_t>(start + i)] * J / total);
      }
    }
    return f;
  }

 private:
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  std::vector<double> shares(int count) {
    std::vector<double> parts(static_cast<std::size_t>(count));
    double total = 0;
    for (double& part : parts) total += part = 0.05 + unit();
    for (double& part : parts) part /= total;
    return parts;
  }

  std::vector<double> step_of_kernel() const {
    std::vector<double> step(kernel_.size());
    double total = 0;
    for (std::size_t i = 0; i < step.size(); ++i) step[i] = total += kernel_[i] * kInputStep_s;
    return step;
  }

  std::vector<double> signs(const std::vector<double>& kernel) {
    std::vector<double> sign(kInputSteps);
    const double switches = 0.2 + 6 * unit();  // per second
    const bool follows = unit() < 0.5;
    const double mistakes = unit() < 0.3 ? 0 : 0.2 * unit();
    double value = unit() < 0.5 ? -1 : 1;
    for (int i = 0; i < kInputSteps; ++i) {
      if (follows) {
        const double k = kernel[static_cast<std::size_t>(kInputSteps - 1 - i)];
        value = k < 0 ? -1 : 1;
        if (unit() < mistakes) value = -value;
      } else if (unit() < switches * kInputStep_s) {
        value = -value;
      }
      sign[static_cast<std::size_t>(i)] = value;
    }
    return sign;
  }

  /// The force whose rate is d times the signs, clamped to +-E.
  static Input integrated(double d, double E, const std::vector<double>& sign) {
    Input f;
    double value = 0;
    for (std::size_t i = 0; i < sign.size(); ++i) {
      f.from[i] = value;
      value = std::clamp(value + d * sign[i] * kInputStep_s, -E, E);
      f.to[i] = value;
    }
    return f;
  }

  std::mt19937 random_;
  std::vector<double> kernel_;
};

double largest_error(SteppedLoop& loop, const Input& f) {
  loop.reset();
  double most = 0;
  for (std::size_t i = 0; i < kInputSteps; ++i)
    most = std::max(most, std::abs(loop.step(f.from[i], f.to[i])));
  return most;
}

/// Returns the largest error relative to its bound, by class.
std::map<std::string, double> largest_ratios(
    SteppedLoop loop, unsigned seed, int runs,
    const std::function<DisturbanceBounds(const Disturbance&)>& bounds) {
  constexpr double E = 0.1, d = 0.3, variation = 0.15, J = 0.02;
  constexpr int kPasses = 4, kPeriod = 500, kLength = 160;
  Disturbance known;
  known.amplitude_N = E;
  known.rate_N_s = d;
  known.variation_N = variation;
  known.impulse_N_s = J;
  const DisturbanceBounds one = bounds(known);
  known.passes = kPasses;
  known.pass_period_s = kPeriod * kInputStep_s;
  known.pass_length_s = kLength * kInputStep_s;
  const DisturbanceBounds several = bounds(known);

  std::vector<double> kernel(kInputSteps);
  loop.reset();
  loop.place(0, 1 / kMass_kg);
  for (double& k : kernel) k = loop.step(0, 0);
  Inputs inputs(seed, kernel);
  std::map<std::string, double> worst;
  for (int i = 0; i < runs; ++i) {
    const auto hold = [&](const std::string& name, const Input& f, double bound) {
      double& most = worst[name];
      most = std::max(most, largest_error(loop, f) / bound);
    };
    hold("rate", inputs.rate(d), one.by_rate);
    hold("amplitude", inputs.amplitude(E), one.by_amplitude);
    hold("edges", inputs.edges(variation), one.by_edges);
    hold("impulse", inputs.impulses(J, 1, kPeriod, kLength), one.by_impulse);
    hold("amplitude and rate", inputs.amplitude_and_rate(E, d), one.by_both);
    hold("several passes", inputs.impulses(J, kPasses, kPeriod, kLength), several.by_impulse);
  }
  return worst;
}

void check(int runs) {
  const AxisLoop z = {kMass_kg, 10, 5, 10, {1 / 17.4}, 0};
  const AxisLoop xy = {kMass_kg, 20, 10, 12, {1 / 17.4, 0.03}, 0};
  AxisLoop late = z;
  late.delay_s = 0.015;
  const SampledLoop at_100Hz = {late, 0.01, 0.01};
  const SampledLoop at_400Hz = {xy, 0.0025, 0.0025};
  const SampledLoop short_step = {{kMass_kg, 10, 5, 10, {1 / 17.4}, 0}, 0.01, 0.002};
  const auto show = [](const char* name, const std::map<std::string, double>& ratios) {
    for (const auto& [kind, ratio] : ratios) {
      // The bound holds in real arithmetic; the loop is stepped in doubles.
      EXPECT_LE(ratio, 1 + 1e-7) << name << ": " << kind;
      EXPECT_GT(ratio, kind == "several passes" ? 0.3 : 0.55) << name << ": " << kind << " did not try hard";
      testing::Test::RecordProperty(std::string(name) + " " + kind, std::to_string(ratio));
      if (testing::FLAGS_gtest_filter.find("slow") != std::string::npos) {
        std::printf("  %-11s %-19s %.6f\n", name, kind.c_str(), ratio);
      }
    }
  };
  for (const AxisLoop* loop : {&z, &xy}) {
    show("continuous", largest_ratios({*loop, kInputStep_s}, 1, runs, [&](const Disturbance& known) {
           return disturbance_bounds(*loop, Channel::kForce, known);
         }));
  }
  for (const SampledLoop* loop : {&at_100Hz, &at_400Hz, &short_step}) {
    const GainNorms gains = sampled_norms(*loop, Channel::kForce, Instants::kAll);
    const int steps = static_cast<int>(std::lround(loop->period_s / kInputStep_s));
    show("sampled", largest_ratios({*loop, steps}, 2, runs, [&](const Disturbance& known) {
           return disturbance_bounds(*loop, Channel::kForce, gains, known);
         }));
  }
}

TEST(RandomInputs, StayBelowTheBoundOfTheirClass) { check(300); }

TEST(RandomInputs, TenThousandOfEachClassStayBelowItsBound_slow) { check(10'000); }

}  // namespace
}  // namespace swarmcert::stability
