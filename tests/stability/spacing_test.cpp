// The keep-out region, row by row, compared with the bounds from which it is computed.
#include "stability/bounds/swarms/spacing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "stability/stepped_loop.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

DownwashField field() {
  DownwashField result;
  result.amplitude_N = 0.02;
  result.decay = 1.5;
  result.spread_m = 0.08;
  result.spread_slope = 0.1;
  return result;
}

FlownLoop flown(double largest_thrust_N) {
  const Gains gains = parse_gains(
      "schema = \"swarmcert/gains/1\"\n[position]\nKp = 10\nKd = 5\nKi = 10\nintegrator_limit = 100\n",
      "gains.toml");
  return {gains, {tests::kMass_kg, 1, largest_thrust_N}};
}

DisturbanceSource nothing() {
  DisturbanceSource source;
  declare_no_class(source);
  return source;
}

Spacing spacing_of(const SpacingQuestion& question, double largest_thrust_N = 0.6) {
  return spacing(flown(largest_thrust_N), field(), nothing(), question);
}

TEST(Spacing, FieldFallsAsItsFormulaAndIsConstantWhereItIsNearest) {
  EXPECT_NEAR(field().peak_N(0.3), 0.02, 1e-15);
  EXPECT_NEAR(field().peak_N(0.6), 0.02 * std::pow(0.5, 1.5), 1e-15);
  EXPECT_EQ(field().peak_N(0.01), field().peak_N(field().nearest_m));
  EXPECT_NEAR(field().spread_at_m(0.5), 0.13, 1e-15);
}

TEST(Spacing, AVehicleMayStayExactlyWhereItsErrorIsSmallEnoughAndItsThrustSuffices) {
  SpacingQuestion question;
  question.max_error_m = 0.06;
  question.steps = 9;
  for (const double thrust_N : {0.36, 0.6}) {
    int stays = 0;
    const Spacing found = spacing_of(question, thrust_N);
    ASSERT_EQ(found.shape.size(), 9U);
    for (std::size_t i = 0; i < found.shape.size(); ++i) {
      const SpacingRow& row = found.shape[i];
      EXPECT_TRUE(!row.may_stay || row.stay_error_m <= question.max_error_m);
      EXPECT_EQ(std::isfinite(row.least_speed_m_s), row.thrust_margin_N >= 0);
      EXPECT_EQ(row.keep_out_radius_m == 0, row.may_stay);
      EXPECT_EQ(row.least_speed_m_s == 0, row.may_stay);
      EXPECT_LE(row.peak_force_N, found.shape[i > 0 ? i - 1 : 0].peak_force_N);
      stays += row.may_stay;
    }
    EXPECT_GT(stays, 0);
    EXPECT_LT(stays, 9);
  }
}

TEST(Spacing, ProfileWithATailFallsToItsShareAndHasItsIntegralAlongALine) {
  for (const double tail : {0.0, 0.3, 1.0}) {
    DownwashField one = field();
    one.tail = tail;
    const auto profile = [tail](double u) {
      return tail > 0 ? std::pow(1 + tail * u * u / 2, -1 / tail) : std::exp(-u * u / 2);
    };
    EXPECT_NEAR(profile(one.spreads_at(0.2)), 0.2, 1e-12);
    double area = 0;
    constexpr double kStep = 1e-2, kEnd = 2e3;
    for (double u = kStep / 2; u < kEnd; u += kStep) area += 2 * kStep * profile(u);
    EXPECT_NEAR(one.line_integral(), area, 3e-3) << tail;
  }
}

/// The lower vehicle crosses back and forth at the least speed, turns outside the radius at once, and waits there for
/// the least time, where the force is as large as it may be.
TEST(Spacing, NoSequenceOfPassesExceedsTheLimit) {
  SpacingQuestion question;
  question.max_error_m = 0.06;
  question.steps = 9;
  for (const char* const text : {"", "rate_hz = 100\nintegrator_step_s = 0.002\n"}) {
    const Gains gains = parse_gains(
        std::string("schema = \"swarmcert/gains/1\"\n[position]\nKp = 10\nKd = 5\nKi = 10\n") + text,
        "gains.toml");
    const FlownLoop loop = {gains, {tests::kMass_kg, 1, 0.6}};
    int crossings = 0;
    for (const auto& [dwell_s, beside_N] : {std::pair(0.3, 0.0), std::pair(2.0, 0.0), std::pair(2.0, 5e-3)}) {
      question.dwell_s = dwell_s;
      DisturbanceSource beside = nothing();
      beside.axis[2] = {};
      beside.axis[2].amplitude_N = beside_N;
      for (const SpacingRow& row : spacing(loop, field(), beside, question).shape) {
        if (!(row.least_speed_m_s > 0) || !std::isfinite(row.least_speed_m_s)) continue;
        ++crossings;
        const double spread_m = field().spread_at_m(row.height_gap_m + question.max_error_m);
        const double R = row.keep_out_radius_m, pass_s = 2 * R / row.least_speed_m_s,
                     turn_s = pass_s + dwell_s;
        const double outside_N = row.peak_force_N * std::exp(-R * R / (2 * spread_m * spread_m));
        SteppedLoop flight =
            loop.is_sampled() ? SteppedLoop(*loop.sampled(2), 4) : SteppedLoop(*loop.continuous(2), 0.0025);
        flight.reset();
        double most_m = 0;
        for (int k = 0; k * flight.step_s() < 12 * turn_s; ++k) {
          const double at_s = std::fmod(k * flight.step_s(), turn_s), r = -R + at_s * row.least_speed_m_s;
          const double force_N =
              beside_N +
              (at_s < pass_s ? row.peak_force_N * std::exp(-r * r / (2 * spread_m * spread_m)) : outside_N);
          most_m = std::max(most_m, std::abs(flight.step(force_N, force_N)));
        }
        EXPECT_LE(most_m, question.max_error_m) << row.height_gap_m;
        EXPECT_GT(most_m, 0.25 * question.max_error_m) << row.height_gap_m;
      }
    }
    EXPECT_GT(crossings, 0);
  }
}

TEST(Spacing, WhatDisturbsTheVehicleBesideTheFieldTakesItsShareOfErrorAndThrust) {
  SpacingQuestion question;
  question.max_error_m = 0.06;
  question.steps = 9;
  const FlownLoop loop = flown(0.6);
  DisturbanceSource beside = nothing();
  beside.bias_N[0] = 0.05;  // sideways: thrust, but no vertical error
  beside.bias_N[2] = 8e-3;
  const Spacing alone = spacing(loop, field(), nothing(), question),
                both = spacing(loop, field(), beside, question);
  const double own_m = axis_bounds(loop, flown_gains(loop, 2, Channel::kForce), beside, {}).bounds.least();
  ASSERT_GT(own_m, 0);
  for (std::size_t i = 0; i < both.shape.size(); ++i) {
    EXPECT_NEAR(both.shape[i].stay_error_m, alone.shape[i].stay_error_m + own_m, 1e-12);
    EXPECT_GE(both.shape[i].least_speed_m_s, alone.shape[i].least_speed_m_s);
  }
  EXPECT_GT(both.least_gap_to_stay_m, alone.least_gap_to_stay_m);
  const double up_N = saturation(loop, beside, {}).feedback_N[2];
  EXPECT_LE(both.shape.back().thrust_margin_N, alone.shape.back().thrust_margin_N - up_N);
  beside.thrust_ratio_error = 0.1;
  EXPECT_THROW(spacing(loop, field(), beside, question), std::invalid_argument);
}

TEST(Spacing, MoreNeighboursAndALargerGuardNeverComeCloser) {
  SpacingQuestion question;
  question.max_error_m = 0.06;
  question.steps = 9;
  double least = spacing_of(question).least_gap_to_stay_m;
  EXPECT_GT(least, 0.15);
  for (int neighbours = 2; neighbours <= 3; ++neighbours) {
    question.neighbours = neighbours;
    const double gap = spacing_of(question).least_gap_to_stay_m;
    EXPECT_GE(gap, least);
    least = gap;
  }
  question.guard = 1.5;
  EXPECT_GE(spacing_of(question).least_gap_to_stay_m, least);
}

}  // namespace
}  // namespace swarmcert::stability
