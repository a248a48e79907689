#include "stability/bounds/loops/coupled_cascade.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

namespace swarmcert::stability {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Channels x, y and z of a vehicle that flew: separate attitude laws for both tilts, and the thrust.
std::vector<Cascade> channels() {
  Cascade x, y, z;
  x.ratio = y.ratio = z.ratio = 1.3;
  x.lag_s = y.lag_s = z.lag_s = 0.0575;
  x.attitude = AttitudeLoop{500, 70, 1500};
  y.attitude = AttitudeLoop{420, 68, 0};
  x.body_rate_lag_s = 0.003;
  y.body_rate_lag_s = 0.004;
  return {x, y, z};
}

PidMatrices matrices(const MatrixXd& Kp, const MatrixXd& Kd, const MatrixXd& Ki) { return {Kp, Kd, Ki}; }

CoupledCascade apart() {
  const VectorXd Kp = Eigen::Vector3d(9, 11, 20), Kd = Eigen::Vector3d(6, 7, 8),
                 Ki = Eigen::Vector3d(3, 0, 12);
  return {matrices(Kp.asDiagonal(), Kd.asDiagonal(), Ki.asDiagonal()), channels()};
}

CoupledCascade coupled() {
  CoupledCascade loop = apart();
  loop.position.Kp(0, 1) = -4;
  loop.position.Kp(1, 0) = 6;
  loop.position.Kd(1, 2) = 2;
  loop.position.Kd(2, 0) = -1.5;
  loop.position.Ki(0, 2) = 1;
  return loop;
}

/// The channel as a separate loop.
Cascade alone(const CoupledCascade& loop, Eigen::Index i) {
  Cascade result = loop.channels[static_cast<std::size_t>(i)];
  result.Kp = loop.position.Kp(i, i);
  result.Kd = loop.position.Kd(i, i);
  result.Ki = loop.position.Ki(i, i);
  return result;
}

/// Expects equal gains, or that neither loop can be destabilised.
void expect_same_gain(double found, double expected, double tolerance) {
  if (std::isinf(expected)) {
    EXPECT_EQ(found, expected);
  } else {
    EXPECT_NEAR(found, expected, tolerance * expected);
  }
}

TEST(CoupledCascade, AxesThatAreNotCoupledKeepTheMarginsOfTheirOwnLoops) {
  const CoupledCascade loop = apart();
  const CoupledMargins margins = coupled_margins(loop);
  CascadeMargins least;
  least.gain = least.delay_s = least.damping = 1e9;
  ASSERT_EQ(margins.alone.size(), 3u);
  for (Eigen::Index i = 0; i < 3; ++i) {
    SCOPED_TRACE(i);
    const CascadeMargins own = cascade_margins(alone(loop, i));
    ASSERT_GT(own.gain, 1);
    const CascadeMargins& found = margins.alone[static_cast<std::size_t>(i)];
    expect_same_gain(found.gain, own.gain, 1e-9);
    EXPECT_NEAR(found.low_gain, own.low_gain, 1e-9);
    EXPECT_NEAR(found.delay_s, own.delay_s, 1e-9 * own.delay_s);
    least.gain = std::min(least.gain, own.gain);
    least.low_gain = std::max(least.low_gain, own.low_gain);
    least.delay_s = std::min(least.delay_s, own.delay_s);
    least.damping = std::min(least.damping, own.damping);
  }
  ASSERT_LT(least.gain, 1e4);
  EXPECT_NEAR(margins.together.gain, least.gain, 1e-9 * least.gain);
  EXPECT_NEAR(margins.together.low_gain, least.low_gain, 1e-9);
  EXPECT_NEAR(margins.together.delay_s, least.delay_s, 1e-9 * least.delay_s);
  EXPECT_NEAR(margins.together.damping, least.damping, 1e-9);
}

/// With equal tilt loops, gains that are diagonal in axes rotated by any angle describe the same vehicle.
TEST(CoupledCascade, GainsThatAreDiagonalInTurnedAxesHaveTheirMarginsTogether) {
  CoupledCascade straight;
  const Eigen::Vector2d Kp(9, 13), Kd(6, 5), Ki(2, 0);
  straight.position = matrices(Kp.asDiagonal(), Kd.asDiagonal(), Ki.asDiagonal());
  straight.channels = {channels()[0], channels()[0]};
  const CoupledMargins expected = coupled_margins(straight);
  for (const double angle : {0.2, 0.8, 2.5}) {
    SCOPED_TRACE(angle);
    const MatrixXd turn = Eigen::Rotation2Dd(angle).toRotationMatrix();
    const auto turned = [&turn](const MatrixXd& m) { return MatrixXd(turn * m * turn.transpose()); };
    CoupledCascade loop = straight;
    loop.position = {turned(straight.position.Kp), turned(straight.position.Kd),
                     turned(straight.position.Ki)};
    const CoupledMargins margins = coupled_margins(loop);
    expect_same_gain(margins.together.gain, expected.together.gain, 1e-8);
    EXPECT_NEAR(margins.together.low_gain, expected.together.low_gain, 1e-8);
    EXPECT_NEAR(margins.together.delay_s, expected.together.delay_s, 1e-8 * expected.together.delay_s);
    EXPECT_NEAR(margins.together.damping, expected.together.damping, 1e-8);
    // One tilt alone also affects the other's axis.
    EXPECT_GT(std::abs(margins.alone[0].low_gain - expected.alone[0].low_gain), 1e-5);
  }
}

TEST(CoupledCascade, AtItsGainMarginsTheLoopStopsBeingStable) {
  const CoupledCascade loop = coupled();
  const CoupledMargins margins = coupled_margins(loop);
  const auto holds = [&loop](double factor, std::size_t first, std::size_t count) {
    CoupledCascade changed = loop;
    for (std::size_t i = first; i < first + count; ++i) changed.channels[i].ratio *= factor;
    return is_stable(changed);
  };
  const auto expect_ends = [&](const CascadeMargins& found, std::size_t first, std::size_t count) {
    SCOPED_TRACE(first);
    ASSERT_GT(found.gain, 1);
    ASSERT_TRUE(std::isfinite(found.gain));
    EXPECT_TRUE(holds(0.999 * found.gain, first, count));
    EXPECT_FALSE(holds(1.001 * found.gain, first, count));
    if (found.low_gain == 0) return;  // without an integrator, it may be zero
    EXPECT_TRUE(holds(1.001 * found.low_gain, first, count));
    EXPECT_FALSE(holds(0.999 * found.low_gain, first, count));
  };
  ASSERT_GT(margins.together.low_gain, 0);
  expect_ends(margins.together, 0, 3);
  expect_ends(margins.alone[0], 0, 1);
  expect_ends(margins.alone[1], 1, 1);
  const CascadeMargins uncoupled = coupled_margins(apart()).together;
  EXPECT_GT(std::abs(margins.together.low_gain - uncoupled.low_gain), 0.01)
      << "else the coupling does not show";
  EXPECT_EQ(nearness_to_limit_cycle(CoupledMargins{margins.together, {}}),
            nearness_to_limit_cycle(margins.together));
}

/// Steps the coupled loop through time by Euler's method, with delayed commands; implemented from the equations in the
/// headers.
class SteppedCascade {
 public:
  explicit SteppedCascade(const CoupledCascade& loop) : loop_(loop) {}

  /// Returns the largest |e| in the last tenth relative to that in the second tenth.
  /// @param delay_s per channel.
  double growth(const Eigen::Vector3d& delay_s, double duration_s) {
    const auto steps = static_cast<long>(duration_s / kStep_s);
    double early = 0, late = 0;
    position_[0] = 0.01;
    position_[2] = -0.02;
    for (long step = 0; step < steps; ++step) {
      for (std::size_t i = 0; i < 3; ++i) {
        commands_[i].push_back(law(i));
        const long when = step - std::lround(delay_s[static_cast<Eigen::Index>(i)] / kStep_s);
        move(i, when < 0 ? 0 : commands_[i][static_cast<std::size_t>(when)]);
      }
      integral_ += kStep_s * position_;
      position_ += kStep_s * velocity_;
      velocity_ += kStep_s * acceleration_;
      if (step >= steps / 10 && step < steps / 5) early = std::max(early, position_.norm());
      if (step >= steps - steps / 10) late = std::max(late, position_.norm());
    }
    return late / early;
  }

 private:
  static constexpr double kStep_s = 2e-5;

  double wanted(std::size_t i) const {
    const auto row = static_cast<Eigen::Index>(i);
    return -loop_.channels[i].ratio *
           (loop_.position.Kp.row(row).dot(position_) + loop_.position.Kd.row(row).dot(velocity_) +
            loop_.position.Ki.row(row).dot(integral_));
  }
  double law(std::size_t i) {
    const Cascade& channel = loop_.channels[i];
    if (!channel.attitude) return wanted(i);
    const double error = tilt_[i] - wanted(i);
    law_integral_[i] += kStep_s * error;
    return -channel.ratio *
           (channel.attitude->Kw_J_s * (channel.body_rate_lag_s > 0 ? seen_rate_[i] : rate_[i]) +
            channel.attitude->KR_J_s2 * error + channel.attitude->KI_J_s3 * law_integral_[i]);
  }
  void move(std::size_t i, double command) {
    const Cascade& channel = loop_.channels[i];
    acts_[i] += kStep_s * (command - acts_[i]) / channel.lag_s;
    if (!channel.attitude) {
      acceleration_[static_cast<Eigen::Index>(i)] = acts_[i];
      return;
    }
    acceleration_[static_cast<Eigen::Index>(i)] = tilt_[i];
    if (channel.body_rate_lag_s > 0)
      seen_rate_[i] += kStep_s * (rate_[i] - seen_rate_[i]) / channel.body_rate_lag_s;
    tilt_[i] += kStep_s * rate_[i];
    rate_[i] += kStep_s * acts_[i];
  }

  CoupledCascade loop_;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero(), velocity_ = Eigen::Vector3d::Zero(),
                  acceleration_ = Eigen::Vector3d::Zero(), integral_ = Eigen::Vector3d::Zero();
  double tilt_[3] = {}, rate_[3] = {}, seen_rate_[3] = {}, law_integral_[3] = {}, acts_[3] = {};
  std::vector<double> commands_[3];
};

TEST(CoupledCascade, ADelayAboveItsMarginMakesASteppedLoopGrowAndOneBelowDoesNot) {
  const CoupledCascade loop = coupled();
  const CoupledMargins margins = coupled_margins(loop);
  const auto expect_end = [&loop](double margin_s, const Eigen::Vector3d& where) {
    SCOPED_TRACE(where.transpose());
    ASSERT_GT(margin_s, 1e-3);
    ASSERT_TRUE(std::isfinite(margin_s));
    EXPECT_LT(SteppedCascade(loop).growth(0.95 * margin_s * where, 60), 1);
    EXPECT_GT(SteppedCascade(loop).growth(1.05 * margin_s * where, 60), 1);
  };
  expect_end(margins.together.delay_s, {1, 1, 1});
  expect_end(margins.alone[0].delay_s, {1, 0, 0});
  expect_end(margins.alone[1].delay_s, {0, 1, 0});
  expect_end(margins.alone[2].delay_s, {0, 0, 1});
}

TEST(CoupledCascade, AnUnstableLoopHasNoMarginsThoughEachAxisAloneIsStable) {
  CoupledCascade loop = apart();
  for (Eigen::Index i = 0; i < 3; ++i) ASSERT_TRUE(is_stable(alone(loop, i)));
  loop.position.Kp(0, 1) = 40;
  loop.position.Kp(1, 0) = -40;
  ASSERT_FALSE(is_stable(loop));
  const CoupledMargins margins = coupled_margins(loop);
  EXPECT_EQ(margins.together.gain, 0);
  EXPECT_EQ(margins.together.delay_s, 0);
  for (const CascadeMargins& one : margins.alone) EXPECT_EQ(one.gain, 0);
  EXPECT_EQ(nearness_to_limit_cycle(margins), Nearness::kUnstable);
}

TEST(CoupledCascade, TheVerdictMindsTheChannelWhoseGainCanGrowLeast) {
  CascadeMargins far{3, 0, 0.1, 0.5, 10}, near = far;
  near.gain = 1.5;
  EXPECT_EQ(nearness_to_limit_cycle(CoupledMargins{far, {far, far}}), Nearness::kClear);
  EXPECT_EQ(nearness_to_limit_cycle(CoupledMargins{far, {far, near}}), Nearness::kClose);
  EXPECT_EQ(nearness_to_limit_cycle(CoupledMargins{near, {far, far}}), Nearness::kClose);
}

TEST(CoupledCascade, MatricesOfTheLawAreThoseOfItsForce) {
  const CompositeGains gains{{{3.1, 0.4, -0.2}, {0.4, 2.5, 0.3}, {-0.2, 0.3, 4.2}},
                             {{0.12, 0.01, 0}, {0.01, 0.2, 0.02}, {0, 0.02, 0.09}}};
  const double mass_kg = 0.034;
  const PidMatrices law = pid_matrices(gains, mass_kg);
  const Eigen::Vector3d e(0.3, -0.2, 0.5), v(-1, 0.4, 0.2), integral(0.1, 0.6, -0.3);
  const auto of = [](const Eigen::Vector3d& x) { return controller::Vector3<double>{x[0], x[1], x[2]}; };
  const controller::Vector3<double> force = controller::desired_force<double>(
      gains, mass_kg, {of(e), of(v)}, of(integral), {{0, 0, 0}, {0, 0, mass_kg * 9.81}});
  const Eigen::Vector3d u = -(law.Kp * e + law.Kd * v + law.Ki * integral);
  EXPECT_NEAR(force.x / mass_kg, u[0], 1e-12);
  EXPECT_NEAR(force.y / mass_kg, u[1], 1e-12);
  EXPECT_NEAR(force.z / mass_kg, u[2], 1e-12);
}

}  // namespace
}  // namespace swarmcert::stability
