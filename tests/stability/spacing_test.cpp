// The keep-out region, row by row, compared with the bounds from which it is computed.
#include "stability/bounds/swarms/spacing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "stability/bounds/loops/axis_loop.h"
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

Spacing spacing_of(const SpacingQuestion& question, double largest_thrust_N = 0.6) {
  const AxisLoop loop = {tests::kMass_kg, 10, 5, 10, {}, 0};
  const GainNorms gains = continuous_norms(loop, Channel::kForce);
  SpacingVehicle vehicle;
  vehicle.effort_gain = 1;
  vehicle.largest_thrust_N = largest_thrust_N;
  vehicle.integrator_limit_m_s = 100;
  return spacing(loop, gains, vehicle, field(), question);
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
      EXPECT_EQ(row.may_stay, row.stay_error_m <= question.max_error_m && row.thrust_margin_N >= 0);
      EXPECT_EQ(row.keep_out_radius_m == 0, row.may_stay);
      EXPECT_EQ(row.least_speed_m_s == 0, row.may_stay);
      EXPECT_LE(row.peak_force_N, found.shape[i > 0 ? i - 1 : 0].peak_force_N);
      stays += row.may_stay;
    }
    EXPECT_GT(stays, 0);
    EXPECT_LT(stays, 9);
  }
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
