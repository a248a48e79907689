#include "stability/bounds/uncertain/uncertain_norms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "stability/bounds/uncertain/uncertain_part.h"
#include "stability/stepped_loop.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;
using End = UncertainNorms::End;

/// The gains as flown, z and x.
const AxisLoop kLoop = {kMass_kg, 10, 5, 10, {}, 0};
const AxisLoop kSideways = {kMass_kg, 20, 10, 3, {0.1}, 0};

const UncertainPlant kDefault = {{0.95 * kMass_kg, 1.05 * kMass_kg}, {0.9, 1.1}, {0.046, 0.069}, {0, 0}};
const UncertainPlant kWide = {{0.85 * kMass_kg, 1.15 * kMass_kg}, {0.8, 1.2}, {0.02875, 0.115}, {0, 0.02}};

AxisLoop at(AxisLoop loop, double mass_kg, double scale, double lag_s, double delay_s) {
  const double k = scale * loop.mass_kg / mass_kg;
  loop.mass_kg = mass_kg;
  loop.Kp *= k;
  loop.Kd *= k;
  loop.Ki *= k;
  loop.lags_s.insert(loop.lags_s.begin(), lag_s);
  loop.delay_s = delay_s;
  return loop;
}

/// Draws random plants of a box; every third number is at an end of its interval.
class PlantsOf {
 public:
  explicit PlantsOf(const UncertainPlant& box) : box_(box) {}
  AxisLoop operator()(const AxisLoop& told) {
    return at(told, in(box_.mass_kg), in(box_.thrust_scale), in(box_.lag_s), in(box_.delay_s));
  }

 private:
  double in(const Interval& r) {
    const double share = unit_(random_);
    if (unit_(random_) < 1.0 / 3) return share < 0.5 ? r.lower : r.upper;
    return r.lower + share * (r.upper - r.lower);
  }
  UncertainPlant box_;
  std::mt19937 random_{4};
  std::uniform_real_distribution<double> unit_{0, 1};
};

void expect_below(const GainNorms& found, const UncertainNorms& norms) {
  EXPECT_LE(found.rate, norms.rate.upper);
  EXPECT_LE(found.amplitude, norms.amplitude.upper);
  EXPECT_LE(found.edge, norms.edge.upper);
  EXPECT_LE(found.impulse, norms.impulse.upper);
}

void expect_gap(const UncertainNorms& norms, double gap) {
  for (const UncertainGain* gain : {&norms.rate, &norms.amplitude, &norms.edge, &norms.impulse}) {
    EXPECT_GE(gain->upper, gain->lower);
    EXPECT_LE(gain->upper, (1 + gap) * gain->lower);
  }
}

/// Expects that each gain is attained again at the plant that is reported for it.
template <class NormsOf>
void expect_replay(const UncertainNorms& norms, const AxisLoop& told, const NormsOf& norms_of) {
  const auto replayed = [&](const UncertainGain& worst) {
    return norms_of(at(told, worst.mass_kg, worst.thrust_scale, worst.lag_s, worst.delay_s));
  };
  EXPECT_NEAR(replayed(norms.rate).rate, norms.rate.lower, 1e-8 * norms.rate.lower);
  EXPECT_NEAR(replayed(norms.amplitude).amplitude, norms.amplitude.lower, 1e-8 * norms.amplitude.lower);
  EXPECT_NEAR(replayed(norms.edge).edge, norms.edge.lower, 1e-8 * norms.edge.lower);
  EXPECT_NEAR(replayed(norms.impulse).impulse, norms.impulse.lower, 1e-8 * norms.impulse.lower);
}

struct Box {
  AxisLoop told;
  UncertainPlant plant;
  double gap;
};

TEST(UncertainNorms, NoContinuousLoopOfABoxExceedsItsSupremumAndItIsNear) {
  UncertainPlant short_lag = kDefault;
  short_lag.lag_s = {0.01, 0.02};
  AxisLoop no_integral = kLoop;
  no_integral.Ki = 0;
  const Box boxes[] = {{kLoop, kDefault, 0.02},
                       {kSideways, kDefault, 0.02},
                       {kLoop, kWide, 0.05},
                       {kLoop, short_lag, 0.05},
                       {no_integral, kDefault, 0.02}};
  for (const Box& box : boxes) {
    for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
      SCOPED_TRACE(testing::Message() << box.told.Kp << " " << box.plant.lag_s.upper);
      const UncertainNorms norms = uncertain_norms(box.told, box.plant, channel, {box.gap, 2000});
      EXPECT_EQ(norms.end, End::kGap);
      expect_gap(norms, box.gap);
      PlantsOf plants(box.plant);
      for (int i = 0; i < (box.plant.delay_s.upper > 0 ? 20 : 150) && !HasFailure(); ++i) {
        expect_below(continuous_norms(plants(box.told), channel), norms);
      }
      if (box.told.Ki > 0) {
        expect_replay(norms, box.told, [&](const AxisLoop& loop) { return continuous_norms(loop, channel); });
      }
    }
  }
}

TEST(UncertainNorms, NoSampledLoopOfABoxExceedsItsSupremumAndItIsNear) {
  UncertainPlant delayed = kDefault;
  delayed.delay_s = {0.004, 0.012};  // across a whole period
  UncertainPlant no_lag = {{0.033, 0.035}, {0.97, 1.03}, {0, 0.02}, {0, 0.005}};
  struct Rate {
    Box box;
    double period_s, step_s;
  };
  const Rate rates[] = {{{kLoop, kDefault, 0.02}, 0.01, 0.002},
                        {{kSideways, kDefault, 0.02}, 0.01, 0.002},
                        {{kLoop, kWide, 0.1}, 0.01, 0.002},
                        {{kLoop, delayed, 0.02}, 0.01, 0.01},
                        {{kLoop, no_lag, 0.25}, 0.01, 0.01}};
  for (const auto& [box, period_s, step_s] : rates) {
    for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
      const auto sampled = [&, period = period_s, step = step_s](const AxisLoop& loop) {
        return SampledLoop{loop, period, step};
      };
      const UncertainNorms norms = uncertain_norms(sampled(box.told), box.plant, channel, {box.gap, 6000});
      SCOPED_TRACE(testing::Message() << period_s << " s, " << box.told.Kp << ", " << norms.evaluations);
      EXPECT_EQ(norms.end, End::kGap);
      expect_gap(norms, box.gap);
      PlantsOf plants(box.plant);
      for (int i = 0; i < 150 && !HasFailure(); ++i) {
        const SampledLoop loop = sampled(plants(box.told));
        // Also between samples, which takes thirty times as long.
        expect_below(sampled_norms(loop, channel, i % 50 == 0 ? Instants::kAll : Instants::kSampling), norms);
      }
      expect_replay(norms, box.told, [&](const AxisLoop& loop) {
        return sampled_norms(sampled(loop), channel, Instants::kSampling);
      });
    }
  }
}

TEST(UncertainNorms, SmallerIntervalsTendToTheCertainNorms) {
  const AxisLoop certain = at(kLoop, kMass_kg, 1, 0.0575, 0.006);
  const GainNorms continuous = continuous_norms(certain, Channel::kForce);
  const GainNorms sampled = sampled_norms({certain, 0.01, 0.01}, Channel::kForce, Instants::kSampling);
  for (const double share : {0.04, 0.004, 0.0004, 0.0}) {
    const auto about = [share](double x) { return Interval{x * (1 - share), x * (1 + share)}; };
    const UncertainPlant box = {about(kMass_kg), about(1), about(0.0575), about(0.006)};
    // Without refinement: the bound of a single part.
    const double upper = uncertain_norms(kLoop, box, Channel::kForce, {0, 1}).amplitude.upper;
    const double sampled_upper =
        uncertain_norms(SampledLoop{kLoop, 0.01, 0.01}, box, Channel::kForce, {0, 1}).amplitude.upper;
    EXPECT_GE(upper, continuous.amplitude * (1 - 1e-11));
    EXPECT_GE(sampled_upper, sampled.amplitude * (1 - 1e-11));
    EXPECT_LE(upper, continuous.amplitude * (1 + 10 * share + 1e-9));
    EXPECT_LE(sampled_upper, sampled.amplitude * (1 + 10 * share + 5e-4));  // 5e-4: between samples
  }
}

TEST(UncertainNorms, APointIsItsOwnSupremum) {
  const UncertainPlant point = {{kMass_kg, kMass_kg}, {1, 1}, {0.05, 0.05}, {0, 0}};
  const UncertainNorms norms = uncertain_norms(kLoop, point, Channel::kForce);
  const double exact = continuous_norms(at(kLoop, kMass_kg, 1, 0.05, 0), Channel::kForce).amplitude;
  EXPECT_NEAR(norms.amplitude.lower, exact, 1e-9);
  EXPECT_NEAR(norms.amplitude.upper, exact, 1e-9);
}

TEST(UncertainNorms, ABoxWithAnUnstableCornerHasNoFiniteBound) {
  const UncertainPlant box = {{0.032, 0.036}, {0.9, 1.1}, {0.05, 0.5}, {0, 0}};
  EXPECT_TRUE(std::isinf(uncertain_norms(kLoop, box, Channel::kForce, {0.1, 200}).amplitude.upper));
}

TEST(UncertainNorms, BoundsHoldWhereverItEndsAndTheEndIsNamed) {
  const SampledLoop loop = {kLoop, 0.01, 0.002};
  const UncertainNorms full = uncertain_norms(loop, kDefault, Channel::kCommand, {0.01, 2000});
  ASSERT_EQ(full.end, End::kGap);
  for (const int budget : {20, 60, 150}) {
    const UncertainNorms part = uncertain_norms(loop, kDefault, Channel::kCommand, {0.01, budget});
    EXPECT_EQ(part.end, End::kBudget);
    EXPECT_GE(part.amplitude.upper, full.amplitude.lower);
    EXPECT_LE(part.amplitude.lower, full.amplitude.lower);
    EXPECT_GE(part.impulse.upper, full.impulse.lower);
  }
  int calls = 0;
  double last_gap = 0;
  const UncertainNorms stopped =
      uncertain_norms(loop, kDefault, Channel::kCommand, {0.01, 2000, [&](int, double gap) {
                                                            last_gap = gap;
                                                            return ++calls < 40;
                                                          }});
  EXPECT_EQ(stopped.end, End::kStopped);
  EXPECT_EQ(calls, 40);
  EXPECT_GT(last_gap, 0.01);
  EXPECT_GE(stopped.amplitude.upper, full.amplitude.lower);
}

/// A box around the loop as flown that is wide in one dimension only.
PlantBox wide_in(std::size_t dimension, PlantEdge edge) {
  constexpr double kCentre[] = {1, 0.05, 0.01};
  PlantBox box;
  box.edge = edge;
  for (std::size_t i = 0; i < 3; ++i) {
    const double share = i == dimension ? 0.08 : 0;
    box.from[i] = kCentre[i] * (1 - share);
    box.to[i] = kCentre[i] * (1 + share);
  }
  return box;
}

/// Difference between the midpoint of a function's values and the mean of its ends: sum and maximum.
struct Bend {
  double sum = 0, most = 0;
};

/// @param kernel returns samples of a response of the plant at p.
template <class Kernel>
Bend bend_of(const PlantBox& box, const Kernel& kernel) {
  const std::vector<double> from = kernel(box.from);
  const std::vector<double> middle = kernel(box.centre());
  const std::vector<double> to = kernel(box.to);
  const bool is_weighted = box.edge == PlantEdge::kLeastThrust;  // the bend is that of ratio times response
  const auto weight = [&](const PlantPoint& p) { return is_weighted ? p[0] : 1.0; };
  Bend bend;
  for (std::size_t i = 0; i < middle.size(); ++i) {
    const double off = std::abs(weight(box.centre()) * middle[i] -
                                (weight(box.from) * from[i] + weight(box.to) * to[i]) / 2);
    bend.sum += off;
    bend.most = std::max(bend.most, off);
  }
  return bend;
}

double bound_of_bend(const PlantBends& bends, std::size_t gain, std::size_t dimension, double norm) {
  return bends.absolute[gain][dimension] + bends.relative[gain][dimension] * norm;
}

TEST(UncertainNorms, ResponsesBendLessBetweenCornersThanBoundedAndNotMuchLess) {
  constexpr double kStep_s = 1e-3;
  constexpr int kCount = 15000;
  for (const Channel channel : {Channel::kForce, Channel::kCommand}) {
    for (const PlantEdge edge : {PlantEdge::kLeastMass, PlantEdge::kLeastThrust}) {
      for (std::size_t dimension = 0; dimension < 3; ++dimension) {
        SCOPED_TRACE(testing::Message() << "dimension " << dimension);
        const PlantBox box = wide_in(dimension, edge);
        const PlantBends bends = bends_over(kLoop, channel, box);
        const GainNorms norms = continuous_norms(plant_at(kLoop, box.to), channel);
        const Bend bend = bend_of(box, [&](const PlantPoint& p) {
          return sampled_response(impulse_transfer(plant_at(kLoop, p), channel), kStep_s, kCount);
        });
        const double in_sum = bound_of_bend(bends, 1, dimension, norms.amplitude * 1.2);
        const double at_most = bound_of_bend(bends, 3, dimension, norms.impulse * 1.2);
        EXPECT_LE(bend.sum * kStep_s, in_sum);
        EXPECT_LE(bend.most, at_most);
        EXPECT_GT(bend.sum * kStep_s, in_sum / 100);
        EXPECT_GT(bend.most, at_most / 300);
      }
    }
  }
}

TEST(UncertainNorms, KernelsOfSampledLoopsBendLessBetweenCornersThanBoundedAndNotMuchLess) {
  for (const PlantEdge edge : {PlantEdge::kLeastMass, PlantEdge::kLeastThrust}) {
    for (std::size_t dimension = 0; dimension < 3; ++dimension) {
      SCOPED_TRACE(testing::Message() << "dimension " << dimension);
      const PlantBox box = wide_in(dimension, edge);
      constexpr double kPeriod_s = 0.008;  // the delay stays between one and two periods
      const auto loop_at = [&](const PlantPoint& p) {
        return SampledLoop{plant_at(kLoop, p), kPeriod_s, kPeriod_s};
      };
      const PlantBends bends = bends_over(SampledLoop{kLoop, kPeriod_s, kPeriod_s}, Channel::kForce, box);
      // Errors measured after an impulse of force, stepped through time: values of the kernel, one per period.
      const Bend bend = bend_of(box, [&](const PlantPoint& p) {
        constexpr int kSteps = 20;  // of 0.4 ms: the delays are whole numbers of them
        SteppedLoop stepped(loop_at(p), kSteps);
        stepped.place(0, 1);
        std::vector<double> kernel;
        for (int i = 0; i < 1500 * kSteps; ++i) {
          const double e = stepped.step(0, 0);
          if ((i + 1) % kSteps == 0) kernel.push_back(e);
        }
        return kernel;
      });
      EXPECT_LE(bend.sum * kPeriod_s, bends.absolute[1][dimension]);
      EXPECT_LE(bend.most, bends.absolute[3][dimension]);
      EXPECT_GT(bend.sum * kPeriod_s, bends.absolute[1][dimension] / 300);
      EXPECT_GT(bend.most, bends.absolute[3][dimension] / 1000);
    }
  }
}

}  // namespace
}  // namespace swarmcert::stability
