#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "controller/rounding/bounded.h"
#include "controller/rounding/rounding_bounds.h"
#include "random_vectors.h"

namespace swarmcert::controller {
namespace {

using tests::cast;
using tests::uniform;

RoundedLaw crazyflie(bool composite, bool robust, ThrustRule rule) {
  RoundedLaw law;
  law.mass_kg = 0.034;
  law.is_composite = composite;
  // Intentionally coupled axes.
  law.composite = {{{4, 0.3, 0}, {0.3, 4, 0}, {0, 0, 3}}, {{.136, .01, 0}, {.01, .136, 0}, {0, 0, .2}}};
  law.pid = {{20, 20, 10}, {10, 10, 5}, {3, 3, 10}};
  law.integrator = {{0.1, 0.1, 0.1}, 0.01};
  law.thrust_rule = rule;
  law.is_robust = robust;
  law.lee = {{7e-3, 7e-3, 8e-3}, {1.15e-3, 1.15e-3, 2e-3}};
  law.robust = {{10, 10, 4}, {5e-4, 5e-4, 1e-3}, {2.5e-4, 2.5e-4, 5e-4}, {2, 2, 2}};
  law.inertia_kg_m2 = diagonal(Vector3<double>{16.571710e-6, 16.655602e-6, 29.261652e-6});
  return law;
}

/// The inputs of the laws, in double.
struct RoundedSituation {
  Vector3<double> p, p_d, v, v_d, integral, a_d, effect, omega, omega_R, omega_dot_R, rate_integral;
  double yaw_rad;
  Vector3<double> error_axis;
  double error_angle_rad;
};

struct Outcome {
  Vector3<double> force, torque, integral, rate_integral;
  double thrust;
};

template <typename Scalar>
Outcome evaluate(const RoundedLaw& law, const RoundedSituation& s, const Matrix3<double>& R_WB) {
  const auto mass = static_cast<Scalar>(law.mass_kg);
  const TrackingError<Scalar> error{cast<Scalar>(s.p) - cast<Scalar>(s.p_d),
                                    cast<Scalar>(s.v) - cast<Scalar>(s.v_d)};
  const FeedForward<Scalar> forward{cast<Scalar>(s.a_d), cast<Scalar>(s.effect)};
  const Vector3<Scalar> integral = cast<Scalar>(s.integral);
  const Vector3<Scalar> force =
      law.is_composite
          ? desired_force(CompositeGains<Scalar>{cast<Scalar>(law.composite.Lambda_1_s),
                                                 cast<Scalar>(law.composite.K_kg_s)},
                          mass, error, integral, forward)
          : desired_force(PidGains<Scalar>{cast<Scalar>(law.pid.Kp_1_s2), cast<Scalar>(law.pid.Kd_1_s),
                                           cast<Scalar>(law.pid.Ki_1_s3)},
                          mass, error, integral, forward);
  const Matrix3<Scalar> R_WR = desired_attitude(force, heading_of_yaw(static_cast<Scalar>(s.yaw_rad)),
                                                identity<Scalar>(), Scalar(0.01f))
                                   .R_WR;
  const AttitudeState<Scalar> state{cast<Scalar>(R_WB), cast<Scalar>(s.omega)};
  const AttitudeError<Scalar> attitude =
      attitude_error(state, {R_WR, cast<Scalar>(s.omega_R), cast<Scalar>(s.omega_dot_R)});
  const Matrix3<Scalar> inertia = cast<Scalar>(law.inertia_kg_m2);
  Outcome outcome;
  if (law.is_robust) {
    const RobustGains<Scalar> gains{cast<Scalar>(law.robust.Lambda_1_s),
                                    cast<Scalar>(law.robust.K_omega_N_m_s), cast<Scalar>(law.robust.K_I_N_m),
                                    cast<Scalar>(law.robust.integral_limit_rad)};
    const ReferenceRate<Scalar> rate =
        reference_rate(gains.Lambda_1_s, modified_rodrigues(attitude.R_RB), attitude);
    outcome.torque =
        cast<double>(robust_torque(gains, inertia, state.omega_B_rad_s, rate, cast<Scalar>(s.rate_integral)));
    // Both instances start from the same integral.
    outcome.rate_integral =
        cast<double>(integrate_rate(gains, cast<Scalar>(cast<float>(s.rate_integral)), state.omega_B_rad_s,
                                    rate.omega_r_rad_s, static_cast<Scalar>(law.attitude_step_s)));
  } else {
    outcome.torque = cast<double>(
        lee_torque(LeeGains<Scalar>{cast<Scalar>(law.lee.k_R_N_m), cast<Scalar>(law.lee.k_omega_N_m_s)},
                   inertia, state, attitude));
  }
  const Integrator<Scalar> integrator{cast<Scalar>(law.integrator.limit_m_s),
                                      static_cast<Scalar>(law.integrator.step_s)};
  outcome.integral =
      cast<double>(integrate(integrator, cast<Scalar>(cast<float>(s.integral)), error.position_m));
  outcome.force = cast<double>(force);
  outcome.thrust = static_cast<double>(collective_thrust(law.thrust_rule, force, state.R_WB));
  return outcome;
}

RoundedSituation random_situation(std::mt19937& g, const FlightEnvelope& e, const RoundedLaw& law) {
  using tests::random_vector;
  RoundedSituation s;
  s.p_d = random_vector(g, e.position_m - e.position_error_m);
  s.p = s.p_d + random_vector(g, e.position_error_m);
  s.v_d = random_vector(g, e.velocity_m_s - e.velocity_error_m_s);
  s.v = s.v_d + random_vector(g, e.velocity_error_m_s);
  s.integral = random_vector(g, std::fmin(e.integral_m_s, law.integrator.limit_m_s.x));
  s.a_d = random_vector(g, e.acceleration_m_s2);
  s.effect = random_vector(g, e.effect_N);
  s.omega = random_vector(g, e.rate_rad_s);
  s.omega_R = random_vector(g, e.reference_rate_rad_s);
  s.omega_dot_R = random_vector(g, e.reference_rate_derivative_rad_s2);
  s.rate_integral = random_vector(g, 2);
  s.yaw_rad = uniform(g, -3.14159265, 3.14159265);
  s.error_axis = tests::random_unit_vector(g);
  s.error_angle_rad = uniform(g, 0, e.attitude_error_rad);
  return s;
}

bool is_within_envelope(const Vector3<double>& force, const FlightEnvelope& e) {
  const double size = norm(force);
  return size >= e.least_force_N && size <= e.largest_force_N && force.z >= size * std::cos(e.tilt_rad);
}

class RoundingTest : public testing::TestWithParam<std::tuple<bool, bool, ThrustRule>> {};

// Bounds hold for every tested state, and are small enough to be useful in the error budget.
TEST_P(RoundingTest, NoStateExceedsTheBoundsAndTheyAreNotAbsurdlyLoose) {
  const auto [composite, robust, rule] = GetParam();
  const RoundedLaw law = crazyflie(composite, robust, rule);
  // Normal flight: an envelope narrower than the default, so that random states fill it.
  FlightEnvelope e;
  e.position_m = 3, e.velocity_m_s = 2, e.position_error_m = 0.3, e.velocity_error_m_s = 0.5,
  e.acceleration_m_s2 = 3;
  const RoundingBounds bounds = rounding_bounds(law, e);
  ASSERT_TRUE(bounds.applies) << bounds.why_not;

  std::mt19937 generator(40);
  Outcome worst{};
  int tried = 0;
  for (int i = 0; i < 60000; ++i) {
    const RoundedSituation s = random_situation(generator, e, law);
    const Vector3<double> force = evaluate<double>(law, s, identity<double>()).force;
    if (!is_within_envelope(force, e)) continue;
    ++tried;
    const Matrix3<double> desired =
        desired_attitude(force, heading_of_yaw(s.yaw_rad), identity<double>(), 0.01).R_WR;
    const Matrix3<double> R_WB = desired * tests::rotation(s.error_axis, s.error_angle_rad);
    const Outcome f = evaluate<float>(law, s, R_WB), d = evaluate<double>(law, s, R_WB);
    const auto raise = [](Vector3<double>& most, const Vector3<double>& a, const Vector3<double>& b,
                          const Vector3<double>& bound) {
      const Vector3<double> gap{std::fabs(a.x - b.x), std::fabs(a.y - b.y), std::fabs(a.z - b.z)};
      EXPECT_TRUE(gap.x <= bound.x && gap.y <= bound.y && gap.z <= bound.z);
      most = {std::fmax(most.x, gap.x), std::fmax(most.y, gap.y), std::fmax(most.z, gap.z)};
    };
    raise(worst.force, f.force, d.force, bounds.force_N);
    raise(worst.torque, f.torque, d.torque, bounds.torque_N_m);
    raise(worst.integral, f.integral, d.integral, bounds.integral_m_s);
    if (robust) raise(worst.rate_integral, f.rate_integral, d.rate_integral, bounds.rate_integral_rad);
    EXPECT_LE(std::fabs(f.thrust - d.thrust), bounds.thrust_N);
    worst.thrust = std::fmax(worst.thrust, std::fabs(f.thrust - d.thrust));
  }
  EXPECT_GT(tried, 20000);
  // Rounding errors of some 200 operations (for a torque) add up like the square root of their number, bounds linearly.
  EXPECT_LE(bounds.force_N.z, 10 * worst.force.z);
  EXPECT_LE(bounds.thrust_N, 30 * worst.thrust);
  EXPECT_LE(tests::largest_entry(bounds.torque_N_m), 700 * tests::largest_entry(worst.torque));
  // A thousandth of the maximum torque of the rotors: 0.15 N each on an arm of 0.046 m.
  EXPECT_LE(tests::largest_entry(bounds.torque_N_m), 1e-3 * 2 * 0.15 * 0.046);
  EXPECT_LE(bounds.integral_m_s.x, 10 * worst.integral.x);
}

INSTANTIATE_TEST_SUITE_P(Laws, RoundingTest,
                         testing::Combine(testing::Bool(), testing::Bool(),
                                          testing::Values(ThrustRule::kProjected, ThrustRule::kMagnitude)));

TEST(RoundingBounds, SayWhyTheyDoNotApply) {
  const RoundedLaw law = crazyflie(false, true, ThrustRule::kProjected);
  FlightEnvelope e;
  EXPECT_TRUE(rounding_bounds(law, e).applies) << rounding_bounds(law, e).why_not;
  e.attitude_error_rad = 1.3;
  EXPECT_NE(rounding_bounds(law, e).why_not.find("branches"), std::string::npos);
  EXPECT_TRUE(rounding_bounds(crazyflie(false, false, ThrustRule::kProjected), e).applies)
      << "Lee has no branches";
  e = {};
  e.tilt_rad = 1.57;
  EXPECT_FALSE(rounding_bounds(law, e).applies);
  e = {};
  e.least_force_N = 0;
  EXPECT_FALSE(rounding_bounds(law, e).applies);
}

// Each operation separately, on random pairs: the distance between the float and double results is within the bound.
TEST(Bounded, EveryOperationHoldsForRandomPairs) {
  std::mt19937 generator(41);
  for (int i = 0; i < 20000; ++i) {
    const double x0 = uniform(generator, -3, 3), y0 = uniform(generator, -3, 3),
                 r = uniform(generator, 0, 0.5);
    const Bounded x = Bounded::input(x0 - r, x0 + r), y = Bounded::input(y0 - r, y0 + r);
    const double xd = uniform(generator, x0 - r, x0 + r), yd = uniform(generator, y0 - r, y0 + r);
    const auto xf = static_cast<float>(xd), yf = static_cast<float>(yd);
    const auto holds = [&](const Bounded& b, float f, double d) {
      return std::fabs(static_cast<double>(f) - d) <= b.error() && b.lower() <= d && d <= b.upper() &&
             b.lower() <= static_cast<double>(f) && static_cast<double>(f) <= b.upper();
    };
    EXPECT_TRUE(holds(x + y, xf + yf, xd + yd));
    EXPECT_TRUE(holds(x - y, xf - yf, xd - yd));
    EXPECT_TRUE(holds(product(x, y), xf * yf, xd * yd));
    EXPECT_TRUE(holds(product(x, x), xf * xf, xd * xd));
    EXPECT_TRUE(holds(absolute(x), std::fabs(xf), std::fabs(xd)));
    EXPECT_TRUE(holds(positive_part(x), std::fmax(xf, 0.0f), std::fmax(xd, 0.0)));
    EXPECT_TRUE(holds(clamp(x, Bounded(-0.7), Bounded(0.3)), clamp(xf, -0.7f, 0.3f), clamp(xd, -0.7, 0.3)));
    EXPECT_TRUE(holds(square_root(x), square_root(xf), square_root(xd)));
    if (y.lower() > 0 || y.upper() < 0) {
      EXPECT_TRUE(holds(x / y, xf / yf, xd / yd));
    }
  }
}

TEST(Bounded, ComparisonsOfSetsThatOverlapAreUndecided) {
  const Bounded narrow = Bounded::input(0, 1), wide = Bounded::input(-1, 2), above = Bounded::input(3, 4);
  EXPECT_TRUE(narrow < above);
  EXPECT_FALSE(above < narrow);
  EXPECT_THROW(static_cast<void>(narrow < wide), Undecided);
  EXPECT_THROW(static_cast<void>(narrow / wide), Undecided);
}

}  // namespace
}  // namespace swarmcert::controller
