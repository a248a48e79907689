#include "stability/checker/gain_bounds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace swarmcert::check {
namespace {

/// Both poles at -2 and no integral: the response to an impulse of force is t e^(-2t)/m. In units of time of 1/2 s the
/// companion matrix is [0 1; -1 -2], and A'P + PA = -I.
LoopWitness double_pole() {
  LoopWitness loop;
  loop.input = "force";
  loop.mass_kg = 0.5, loop.Kp = 4, loop.Kd = 4;
  loop.time_exponent = 1, loop.step_exponent = 6, loop.steps = 1500;
  loop.decay = 0.25;
  loop.P = {{1.5, 0.5}, {0.5, 0.5}};
  return loop;
}

TEST(GainBounds, LieJustAboveTheClosedForm) {
  const GainBounds gains = upper_gains(double_pole());
  const auto is_just_above = [](const mpq_class& bound, double exact) {
    EXPECT_GE(bound.get_d(), exact * (1 - 1e-15));
    EXPECT_LE(bound.get_d(), exact * 1.001);
  };
  EXPECT_FALSE(gains.rate.has_value());
  is_just_above(gains.amplitude, 1 / (4 * 0.5));
  is_just_above(gains.edge, 1 / (4 * 0.5));
  is_just_above(gains.impulse, std::exp(-1.0) / (2 * 0.5));
}

TEST(GainBounds, RemainBoundsWhereTheTailBeginsEarly) {
  LoopWitness loop = double_pole();
  loop.steps = 30;
  const GainBounds early = upper_gains(loop);
  EXPECT_GE(early.amplitude, mpq_class(1, 2));
  EXPECT_GE(early.edge, mpq_class(1, 2));
  EXPECT_GE(early.impulse.get_d(), std::exp(-1.0));
}

TEST(GainBounds, RefuseAWitnessThatShowsNothing) {
  const auto refuses = [](auto change) {
    LoopWitness loop = double_pole();
    change(loop);
    EXPECT_THROW(upper_gains(loop), std::runtime_error);
  };
  refuses([](LoopWitness& loop) { loop.decay = 0.3; });  // 2 decay P exceeds I
  refuses([](LoopWitness& loop) { loop.P[0][0] = -1.5; });
  refuses([](LoopWitness& loop) { loop.P[0][1] = 0.4; });
  refuses([](LoopWitness& loop) { loop.P.pop_back(); });
  refuses([](LoopWitness& loop) { loop.P[1].push_back(1); });
  refuses([](LoopWitness& loop) { loop.step_exponent = 2; });  // cells of 1/4, where |A| is 3
  refuses([](LoopWitness& loop) { loop.steps = 0; });
  refuses([](LoopWitness& loop) { loop.steps = 1L << 40; });
  refuses([](LoopWitness& loop) { loop.Kp = -4; });
  refuses([](LoopWitness& loop) { loop.mass_kg = std::nan(""); });
  refuses([](LoopWitness& loop) { loop.input = "torque"; });
  refuses([](LoopWitness& loop) { loop.lags_s = {0.01}; });  // P is of another size
}

}  // namespace
}  // namespace swarmcert::check
