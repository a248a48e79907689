#include "stability/bounds/loops/attitude_cascade.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "stability/bounds/loops/axis_loop.h"
#include "stability/model.h"

namespace swarmcert::stability {
namespace {

/// Gains that flew, with a limit cycle: position 9/7/0, KR 7e-3 N m, Kw 1.125e-3 N m s, KI 40e-3 N m/s, inertia
/// 16.57e-6 kg m^2.
constexpr double kInertia = 16.57e-6;
Cascade flown() {
  return {9, 7, 0, 1.5, AttitudeLoop{7e-3 / kInertia, 1.125e-3 / kInertia, 40e-3 / kInertia}, 0.0575};
}

TEST(AttitudeCascade, WithoutAttitudeItIsTheAxisLoop) {
  for (const double Ki : {0.0, 10.0}) {
    const Cascade loop{10, 5, Ki, 1, std::nullopt, 1 / 17.4};
    const AxisLoop axis{1, 10, 5, Ki, {1 / 17.4}, 0};
    const ResponseNorms force = response_norms(cascade_transfer(loop, CascadeInput::kAcceleration));
    const GainNorms expected = continuous_norms(axis, Channel::kForce);
    EXPECT_NEAR(force.integral_abs, expected.amplitude, 1e-9 * expected.amplitude);
    EXPECT_NEAR(force.step_max_abs, expected.edge, 1e-9 * expected.edge);
    const ResponseNorms velocity = response_norms(cascade_transfer(loop, CascadeInput::kVelocityError));
    const GainNorms of_estimate = continuous_norms(axis, Estimate::kVelocity);
    EXPECT_NEAR(velocity.integral_abs, of_estimate.amplitude, 1e-9 * of_estimate.amplitude);
  }
}

TEST(AttitudeCascade, AStiffAttitudeLoopIsAsGoodAsNone) {
  const Cascade direct{10, 5, 3, 1, std::nullopt, 0};
  const Cascade stiff{10, 5, 3, 1, AttitudeLoop{4e6, 4e3, 0}, 0};
  const auto amplitude = [](const Cascade& loop) {
    return response_norms(cascade_transfer(loop, CascadeInput::kAcceleration)).integral_abs;
  };
  EXPECT_NEAR(amplitude(stiff), amplitude(direct), 0.01 * amplitude(direct));
}

TEST(AttitudeCascade, ASteadyTorqueLeavesTheErrorOfItsTilt) {
  // Without integrators, a torque per inertia alpha causes a tilt of alpha/(KR/J ratio), and ratio Kp e balances the
  // resulting acceleration.
  const Cascade loop{9, 7, 0, 1.5, AttitudeLoop{500, 60, 0}, 0.03};
  const double steady =
      std::abs(response_norms(cascade_transfer(loop, CascadeInput::kAngularAcceleration)).integral);
  EXPECT_NEAR(steady, 9.81 / (1.5 * 500) / (1.5 * 9), 1e-9);
}

TEST(AttitudeCascade, AnIntegratorOfTheAttitudeRemovesIt) {
  Cascade loop{9, 7, 0, 1.5, AttitudeLoop{500, 60, 1000}, 0.03};
  ASSERT_TRUE(is_stable(loop));
  EXPECT_NEAR(response_norms(cascade_transfer(loop, CascadeInput::kAngularAcceleration)).integral, 0, 1e-9);
}

TEST(AttitudeCascade, AtItsMarginsTheLoopStopsBeingStable) {
  const Cascade loop = flown();
  const CascadeMargins margins = cascade_margins(loop);
  ASSERT_GT(margins.gain, 1);
  ASSERT_TRUE(std::isfinite(margins.gain));
  const auto at = [&loop](double factor) {
    Cascade changed = loop;
    changed.ratio *= factor;
    return is_stable(changed);
  };
  EXPECT_TRUE(at(0.999 * margins.gain));
  EXPECT_FALSE(at(1.001 * margins.gain));
  ASSERT_GT(margins.low_gain, 0);
  EXPECT_TRUE(at(1.001 * margins.low_gain));
  EXPECT_FALSE(at(0.999 * margins.low_gain));
  EXPECT_GT(margins.delay_s, 0);
  EXPECT_GT(margins.damping, 0);
  EXPECT_LT(margins.damping, 1);
  EXPECT_EQ(nearness_to_limit_cycle(margins), Nearness::kClose);
}

TEST(AttitudeCascade, AnUnstableLoopHasNoMargins) {
  Cascade loop = flown();
  loop.attitude->Kw_J_s /= 100;
  ASSERT_FALSE(is_stable(loop));
  EXPECT_EQ(cascade_margins(loop).delay_s, 0);
  EXPECT_EQ(cascade_margins(loop).gain, 0);
  EXPECT_TRUE(std::isinf(response_norms(cascade_transfer(loop, CascadeInput::kAcceleration)).integral_abs));
}

TEST(AttitudeCascade, ALagOfTheBodyRatesStandsInTheLoopWhereTheyAreMeasured) {
  using Complex = std::complex<double>;
  const auto at = [](const Polynomial& p, Complex s) {
    Complex value = 0;
    for (std::size_t k = p.size(); k-- > 0;) value = value * s + p[k];
    return value;
  };
  for (const double KI : {0.0, 900.0}) {
    for (const double Ki : {0.0, 4.0}) {
      const Cascade loop{9, 7, Ki, 1.3, AttitudeLoop{500, 60, KI}, 0.03, 0.012};
      for (const double hz : {0.1, 0.7, 2.0, 9.0}) {
        const Complex s(0, 2 * M_PI * hz);
        const Complex law = 500.0 + KI / s, rate = 60.0 * s / (0.012 * s + 1.0), pid = 9.0 + 7.0 * s + Ki / s;
        const Complex tilts = s * s * (0.03 * s + 1.0) + 1.3 * (rate + law);
        const Complex follows = 1.3 * law / tilts;
        const Complex moves = 1.0 / (s * s + 1.3 * follows * pid);
        const TransferFunction force = cascade_transfer(loop, CascadeInput::kAcceleration);
        EXPECT_LT(std::abs(at(force.numerator, s) / at(force.denominator, s) - moves),
                  1e-9 * std::abs(moves));
        const TransferFunction velocity = cascade_transfer(loop, CascadeInput::kVelocityError);
        const Complex errs = moves * 1.3 * follows * 7.0;
        EXPECT_LT(std::abs(at(velocity.numerator, s) / at(velocity.denominator, s) - errs),
                  1e-9 * std::abs(errs));
        const TransferFunction torque = cascade_transfer(loop, CascadeInput::kAngularAcceleration);
        const Complex tilted = moves * kGravity_m_s2 * (0.03 * s + 1.0) / tilts;
        EXPECT_LT(std::abs(at(torque.numerator, s) / at(torque.denominator, s) - tilted),
                  1e-9 * std::abs(tilted));
      }
    }
  }
  Cascade late{9, 7, 0, 1.3, AttitudeLoop{500, 60, 0}, 0.03};
  const double prompt = cascade_margins(late).damping;
  late.body_rate_lag_s = 0.01;
  EXPECT_LT(cascade_margins(late).damping, prompt);
  late.body_rate_lag_s = 0.2;
  EXPECT_FALSE(is_stable(late));
}

TEST(AttitudeCascade, RefusesATorqueWithoutAnAttitudeLoop) {
  EXPECT_THROW(cascade_transfer({9, 7, 0, 1, std::nullopt, 0}, CascadeInput::kAngularAcceleration),
               std::invalid_argument);
}

}  // namespace
}  // namespace swarmcert::stability
