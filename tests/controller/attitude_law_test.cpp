#include "controller/attitude_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "attitude_decay.h"
#include "random_vectors.h"

namespace swarmcert::controller {
namespace {

constexpr double kPi = 3.14159265358979323846;
// Crazyflie inertia (Förster 2015, "System identification of the Crazyflie 2.0 nano quadrocopter", ETH Zürich).
const Matrix3<double> kInertia = diagonal(Vector3<double>{16.571710e-6, 16.655602e-6, 29.261652e-6});
constexpr InertiaRange kInertiaRange{16.571710e-6, 29.261652e-6};

/// The desired frame rotates at a constant rate in its own coordinates, and J omega' = J omega x omega + tau.
struct Simulation {
  AttitudeState<double> state;
  AttitudeReference<double> reference;

  template <typename Torque>
  void step(double step_s, const Torque& torque) {
    struct Rate {
      Matrix3<double> R_WB, R_WR;
      Vector3<double> omega;
    };
    const auto skew = [](const Vector3<double>& w) {
      return Matrix3<double>{{0, -w.z, w.y}, {w.z, 0, -w.x}, {-w.y, w.x, 0}};
    };
    const auto rate = [&](const AttitudeState<double>& s, const AttitudeReference<double>& r) {
      const Vector3<double> momentum = kInertia * s.omega_B_rad_s;
      const Vector3<double> m = cross(momentum, s.omega_B_rad_s) + torque(s, r);
      return Rate{s.R_WB * skew(s.omega_B_rad_s),
                  r.R_WR * skew(r.omega_R_rad_s),
                  {m.x / kInertia.x.x, m.y / kInertia.y.y, m.z / kInertia.z.z}};
    };
    const auto moved = [&](const Rate& k, double h) {
      const auto plus = [&](const Matrix3<double>& a, const Matrix3<double>& b) {
        return Matrix3<double>{a.x + scaled(h, b.x), a.y + scaled(h, b.y), a.z + scaled(h, b.z)};
      };
      std::pair<AttitudeState<double>, AttitudeReference<double>> next{state, reference};
      next.first.R_WB = plus(state.R_WB, k.R_WB);
      next.first.omega_B_rad_s = state.omega_B_rad_s + scaled(h, k.omega);
      next.second.R_WR = plus(reference.R_WR, k.R_WR);
      return next;
    };
    const Rate a = rate(state, reference);
    const auto at_b = moved(a, step_s / 2);
    const Rate b = rate(at_b.first, at_b.second);
    const auto at_c = moved(b, step_s / 2);
    const Rate c = rate(at_c.first, at_c.second);
    const auto at_d = moved(c, step_s);
    const Rate d = rate(at_d.first, at_d.second);
    for (const auto& [k, weight] : {std::pair{a, 1.0}, {b, 2.0}, {c, 2.0}, {d, 1.0}}) {
      const auto next = moved(k, weight * step_s / 6);
      state = next.first;
      reference = next.second;
    }
  }

  double angle_rad() const {
    const double sigma = norm(modified_rodrigues(transpose(reference.R_WR) * state.R_WB));
    return 4.0 * std::atan(sigma);
  }
};

Simulation from(double angle_rad, const Vector3<double>& axis, const Vector3<double>& omega,
                const Vector3<double>& omega_R) {
  const Matrix3<double> start = tests::rotation({0.6, 0, 0.8}, 0.3);
  return {{start * tests::rotation(axis, angle_rad), omega}, {start, omega_R, {}}};
}

TEST(ModifiedRodrigues, IsTheTangentOfAQuarterOfTheAngleAlongTheAxis) {
  std::mt19937 generator(7);
  for (int i = 0; i < 20000; ++i) {
    const Vector3<double> axis = tests::random_unit_vector(generator);
    const double angle =
        i % 4 == 0 ? kPi - tests::uniform(generator, 0, 1e-3) : tests::uniform(generator, 0, kPi);
    const Vector3<float> sigma = modified_rodrigues(tests::cast<float>(tests::rotation(axis, angle)));
    const Vector3<double> expected = scaled(std::tan(angle / 4), axis);
    // For rotations by pi, up to round-off, either sign of the axis is correct.
    const double gap = std::fmin(norm(tests::cast<double>(sigma) - expected),
                                 kPi - angle < 1e-6 ? norm(tests::cast<double>(sigma) + expected) : 1.0);
    EXPECT_LE(gap, 1e-6) << "angle " << angle;
  }
}

TEST(ModifiedRodrigues, HalfTurnsAboutEveryAxisAreDefined) {
  std::mt19937 generator(8);
  for (int i = 0; i < 1000; ++i) {
    const Vector3<double> axis = tests::random_unit_vector(generator);
    const Vector3<float> sigma = modified_rodrigues(tests::cast<float>(tests::rotation(axis, kPi)));
    EXPECT_NEAR(norm(sigma), 1.0, 1e-6);
    EXPECT_NEAR(std::fabs(dot(tests::cast<double>(sigma), axis)), 1.0, 1e-6);
  }
}

// omega_r_dot must be the derivative of omega_r along the motion: compare it with finite differences.
TEST(RobustLaw, ReferenceRatesDerivativeIsItsDerivative) {
  std::mt19937 generator(9);
  const Vector3<double> lambda{10, 8, 4};
  for (int i = 0; i < 200; ++i) {
    Simulation sim = from(tests::uniform(generator, 0, 3.0), tests::random_unit_vector(generator),
                          tests::random_vector(generator, 5), tests::random_vector(generator, 2));
    sim.reference.omega_dot_R_rad_s2 = {};
    const auto rate_now = [&] {
      const AttitudeError<double> e = attitude_error(sim.state, sim.reference);
      return reference_rate(lambda, modified_rodrigues(e.R_RB), e);
    };
    const auto no_torque = [](const auto&, const auto&) { return Vector3<double>{}; };
    const double h = 1e-5;
    const Vector3<double> at_start = rate_now().omega_r_rad_s;
    sim.step(h, no_torque);
    // omega_r_dot is evaluated for the current omega, so it is compared at the midpoint of the interval.
    const Vector3<double> derivative = rate_now().omega_r_dot_rad_s2;
    sim.step(h, no_torque);
    const Vector3<double> difference = divided(rate_now().omega_r_rad_s - at_start, 2 * h);
    EXPECT_LE(norm(difference - derivative), 1e-4 * (1 + norm(derivative)));
  }
}

TEST(RobustLaw, From170DegreesStaysUnderItsStatedDecay) {
  std::mt19937 generator(10);
  const RobustGains<double> gains{{10, 10, 4}, {5e-4, 5e-4, 1e-3}, {}, {}};
  int close = 0;
  for (int run = 0; run < 40; ++run) {
    const Vector3<double> omega = run % 2 == 0 ? Vector3<double>{} : tests::random_vector(generator, 6);
    Simulation sim = from(170.0 / 180.0 * kPi, tests::random_unit_vector(generator), omega,
                          run % 4 < 2 ? Vector3<double>{} : tests::random_vector(generator, 1));
    const auto rate = [&](const AttitudeState<double>& s, const AttitudeReference<double>& r) {
      const AttitudeError<double> e = attitude_error(s, r);
      return reference_rate(gains.Lambda_1_s, modified_rodrigues(e.R_RB), e);
    };
    const auto torque = [&](const AttitudeState<double>& s, const AttitudeReference<double>& r) {
      return robust_torque(gains, kInertia, s.omega_B_rad_s, rate(s, r), {});
    };
    const double sigma_0 = std::tan(sim.angle_rad() / 4);
    const double q_0 = norm(sim.state.omega_B_rad_s - rate(sim.state, sim.reference).omega_r_rad_s);
    double time = 0.0;
    for (int i = 0; i < 1500; ++i) {
      sim.step(1e-3, torque);
      time += 1e-3;
      const double sigma = std::tan(sim.angle_rad() / 4);
      const double bound = robust_decay(4.0, 5e-4, kInertiaRange, sigma_0, q_0, time);
      ASSERT_LE(sigma, bound + 1e-9) << "run " << run << ", t = " << time;
      close += sigma > 0.2 * bound;
    }
    EXPECT_LT(sim.angle_rad(), 0.05);
  }
  EXPECT_GT(close, 100) << "the stated decay is far above everything that happens";
}

// Starting at the reference rate, only the decay of the attitude itself remains, which nearly attains the bound.
TEST(RobustLaw, From170DegreesAtTheReferenceRateTheStatedDecayIsNearlyAttained) {
  std::mt19937 generator(12);
  const RobustGains<double> gains{{6, 6, 6}, {5e-4, 5e-4, 1e-3}, {}, {}};
  for (int run = 0; run < 10; ++run) {
    Simulation sim = from(170.0 / 180.0 * kPi, tests::random_unit_vector(generator), {}, {});
    const auto rate = [&](const AttitudeState<double>& s, const AttitudeReference<double>& r) {
      const AttitudeError<double> e = attitude_error(s, r);
      return reference_rate(gains.Lambda_1_s, modified_rodrigues(e.R_RB), e);
    };
    sim.state.omega_B_rad_s = rate(sim.state, sim.reference).omega_r_rad_s;
    const double sigma_0 = std::tan(sim.angle_rad() / 4);
    double time = 0.0;
    for (int i = 0; i < 800; ++i) {
      sim.step(1e-3, [&](const AttitudeState<double>& s, const AttitudeReference<double>& r) {
        return robust_torque(gains, kInertia, s.omega_B_rad_s, rate(s, r), {});
      });
      time += 1e-3;
      const double sigma = std::tan(sim.angle_rad() / 4);
      const double bound = robust_decay(6.0, 5e-4, kInertiaRange, sigma_0, 0.0, time);
      ASSERT_LE(sigma, bound + 1e-9) << "run " << run << ", t = " << time;
      ASSERT_GE(sigma, 0.6 * bound) << "run " << run << ", t = " << time;
    }
  }
}

TEST(LeeLaw, From170DegreesStaysUnderItsStatedDecay) {
  std::mt19937 generator(11);
  // Upstream's defaults with equal k_R, as the theorem requires.
  const LeeGains<double> gains{{7e-3, 7e-3, 7e-3}, {1.15e-3, 1.15e-3, 2e-3}};
  for (int run = 0; run < 20; ++run) {
    const double angle = 170.0 / 180.0 * kPi;
    const Vector3<double> omega_e = run % 2 == 0 ? Vector3<double>{} : tests::random_vector(generator, 0.8);
    const Vector3<double> axis = tests::random_unit_vector(generator);
    const Vector3<double> omega_R = run % 4 < 2 ? Vector3<double>{} : tests::random_vector(generator, 1);
    Simulation sim = from(angle, axis, omega_e + transpose(tests::rotation(axis, angle)) * omega_R, omega_R);
    const LeeDecay decay = lee_decay(7e-3, 1.15e-3, 2e-3, kInertiaRange, angle, norm(omega_e));
    ASSERT_TRUE(decay.applies);
    ASSERT_GT(decay.rate_1_s, 0.0);
    double time = 0.0;
    for (int i = 0; i < 3000; ++i) {
      sim.step(1e-3, [&](const AttitudeState<double>& s, const AttitudeReference<double>& r) {
        return lee_torque(gains, kInertia, s, attitude_error(s, r));
      });
      time += 1e-3;
      const double psi = 1 - std::cos(sim.angle_rad());
      ASSERT_LE(psi, decay.initial * std::exp(-decay.rate_1_s * time) + 1e-9)
          << "run " << run << ", t = " << time;
    }
    EXPECT_LT(sim.angle_rad(), 0.1);
  }
}

TEST(LeeLaw, StatesNoDecayForATurnItsTheoremDoesNotCover) {
  EXPECT_FALSE(lee_decay(7e-3, 1.15e-3, 2e-3, kInertiaRange, kPi, 0.0).applies);
  EXPECT_FALSE(lee_decay(7e-3, 1.15e-3, 2e-3, kInertiaRange, 170.0 / 180.0 * kPi, 5.0).applies);
}

TEST(RobustLaw, IntegralIsClampedPerAxis) {
  const RobustGains<float> gains{{10, 10, 10}, {}, {1, 1, 1}, {0.2f, 0.3f, 0.4f}};
  Vector3<float> integral{};
  for (int i = 0; i < 1000; ++i) integral = integrate_rate(gains, integral, {1, -1, 1}, {}, 0.002f);
  EXPECT_EQ(integral.x, 0.2f);
  EXPECT_EQ(integral.y, -0.3f);
  EXPECT_EQ(integral.z, 0.4f);
}

}  // namespace
}  // namespace swarmcert::controller
