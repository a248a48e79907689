#include "stability/bounds/truth_bounds.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "stability/bounds/enclosures/interval_functions.h"
#include "stability/effects/registry.h"
#include "stability/vehicle.h"

namespace swarmcert::stability {
namespace {

using tests::kMass_kg;

using Eigen::Vector3d;

constexpr double kDifference_s = 1e-6;

Model vehicle(const std::string& effect) {
  return parse_model(
      "schema = \"swarmcert/model/1\"\n[vehicle]\nkind = \"small\"\nmass_kg = 0.034\n"
      "inertia_kg_m2 = [1e-5, 1e-5, 2e-5]\narm_m = 0.046\ntorque_per_thrust_m = 0.006\n"
      "[vehicle.thrust]\nc00 = 11.09\nc10 = -39.08\nc01 = -9.53\nc20 = 20.57\nc11 = 38.43\n" +
          effect,
      "model.toml");
}

class Motions {
 public:
  explicit Motions(unsigned seed) : random_(seed) {}
  double uniform(double from, double to) { return from + (to - from) * unit_(random_); }
  Vector3d direction() {
    Vector3d v;
    do {
      v = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    } while (v.norm() > 1 || v.norm() < 1e-3);
    return v.normalized();
  }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> unit_{0, 1};
};

/// Largest force and rate along z of random neighbours that move within `motion`, by finite differences of the
/// simulator's columns.
struct Seen {
  double amplitude_N = 0, rate_N_s = 0;
};
Seen seen_of_wake(const EffectSpec& spec, const MotionSet& motion, double sign, int runs) {
  const AppliedEffect effect(spec, {"small", {"small"}, ""});
  Motions random(3);
  Seen seen;
  for (int run = 0; run < runs; ++run) {
    std::vector<Neighbour> before, after;
    const bool alike = run % 2 == 0;
    const double gap = random.uniform(motion.least_gap_m, std::min(motion.largest_gap_m, 1.0));
    const Vector3d side = random.uniform(0, 0.15) * Vector3d(1, 0, 0), way = random.direction();
    for (int j = 0; j < motion.neighbours; ++j) {
      Neighbour n;
      n.dp_W_m = alike ? side : Vector3d(random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15), 0);
      n.dp_W_m.z() =
          sign * (alike ? gap : random.uniform(motion.least_gap_m, std::min(motion.largest_gap_m, 1.0)));
      n.dv_W_m_s = motion.relative_speed_m_s * (alike ? way : random.direction());
      n.v_W_m_s = std::isfinite(motion.speed_m_s) ? motion.speed_m_s * random.direction() : n.dv_W_m_s;
      n.mass_kg = motion.neighbour_mass_kg;
      n.kind = 0;
      before.push_back(n);
      n.dp_W_m += kDifference_s * n.dv_W_m_s;
      if (std::isfinite(motion.acceleration_m_s2))
        n.v_W_m_s += kDifference_s * motion.acceleration_m_s2 * random.direction();
      if (std::abs(n.dp_W_m.z()) < motion.least_gap_m) n.dp_W_m.z() = before.back().dp_W_m.z();
      after.push_back(n);
    }
    Instant now;
    now.mass_kg = kMass_kg;
    now.num_neighbours = motion.neighbours;
    now.neighbours = before.data();
    const double f = effect.wrench(now).force_W_N.z();
    now.neighbours = after.data();
    seen.amplitude_N = std::max(seen.amplitude_N, std::abs(f));
    seen.rate_N_s = std::max(seen.rate_N_s, std::abs(effect.wrench(now).force_W_N.z() - f) / kDifference_s);
  }
  return seen;
}

TEST(TruthBounds, EncloseTheDownwashThatIsSimulatedForAnyGapSpeedAndNumberAndAreReached) {
  const char* const parameters[] = {
      "", "parameters = { amplitude_N = 0.2, decay_exponent = 2, spread_m = 0.05, spread_slope = 0 }\n",
      "parameters = { convection_s_m = 0.15, norm_exponent = 1 }\n"};
  for (const char* text : parameters) {
    for (const double least_gap_m : {0.0, 0.15, 0.3}) {
      for (const int neighbours : {1, 3}) {
        SCOPED_TRACE(testing::Message() << text << least_gap_m << " " << neighbours);
        const Model model = vehicle(std::string("[[effect]]\nname = \"downwash\"\n") + text);
        MotionSet motion;
        motion.relative_speed_m_s = 1.3;
        motion.neighbours = neighbours;
        motion.neighbour_mass_kg = 0.067;
        motion.least_gap_m = least_gap_m;
        motion.largest_gap_m = 0.9;
        motion.speed_m_s = 0.8;
        motion.acceleration_m_s2 = 2;
        const EffectBounds bounds = truth_bounds(model, motion).at(0);
        const Seen seen = seen_of_wake(model.effects[0], motion, 1, 10000);
        EXPECT_LE(seen.amplitude_N, bounds.amplitude_N[2]);
        EXPECT_LE(seen.rate_N_s, bounds.rate_N_s[2] * (1 + 1e-4));  // finite difference over a microsecond
        const bool drifts = std::string(text).find("convection") != std::string::npos;
        EXPECT_GT(seen.amplitude_N, (drifts ? 0.5 : 0.8) * bounds.amplitude_N[2]);
        EXPECT_GT(seen.rate_N_s, (drifts ? 0.4 : 0.8) * bounds.rate_N_s[2]);
        EXPECT_GE(bounds.reached_rate_N_s * (1 + 5e-3) * (neighbours == 1 && !drifts ? 1 : 1e9),
                  bounds.rate_N_s[2]);
        EXPECT_EQ(bounds.amplitude_N[0], 0);
      }
    }
  }
}

TEST(TruthBounds, EncloseALateWakeOfNeighboursThatChangeTheirVelocity) {
  const Model model = vehicle(
      "[[effect]]\nname = \"wake_delay\"\nparameters = { delay_s = 0.2, amplitude_N = 0.1, spread_m = 0.06, "
      "wind_x_m_s = 0.3, wind_y_m_s = -0.2 }\n");
  MotionSet motion;
  motion.relative_speed_m_s = 1.3;
  motion.neighbours = 2;
  motion.neighbour_mass_kg = 0.067;
  motion.least_gap_m = 0.3;
  motion.largest_gap_m = 0.9;
  motion.speed_m_s = 0.5;
  motion.acceleration_m_s2 = 2;
  const EffectBounds bounds = truth_bounds(model, motion).at(0);
  const Seen seen = seen_of_wake(model.effects[0], motion, 1, 10000);
  EXPECT_LE(seen.amplitude_N, bounds.amplitude_N[2]);
  EXPECT_LE(seen.rate_N_s, bounds.rate_N_s[2] * (1 + 1e-4));
  EXPECT_GT(seen.amplitude_N, 0.4 * bounds.amplitude_N[2]);
  EXPECT_GT(seen.rate_N_s, 0.2 * bounds.rate_N_s[2]);
  motion.acceleration_m_s2 = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(std::isinf(truth_bounds(model, motion).at(0).rate_N_s[2]));
}

TEST(TruthBounds, SayWhatOfATiltAndOfATetherNothingDeclaredLimits) {
  MotionSet motion;
  motion.speed_m_s = 1.5;
  motion.largest_thrust_N = 0.5;
  const EffectBounds tilt =
      truth_bounds(
          vehicle("[[effect]]\nname = \"imu_tilt\"\nparameters = { tilt_x_rad = 0.03, tilt_y_rad = 0.04 }\n"),
          motion)
          .at(0);
  EXPECT_NEAR(tilt.amplitude_N[0], 0.05 * 0.5, 1e-12);
  EXPECT_TRUE(std::isinf(tilt.rate_N_s[0]));
  EXPECT_FALSE(tilt.unbounded.empty());
  const EffectBounds tether =
      truth_bounds(vehicle("[[effect]]\nname = \"tether\"\nparameters = { stiffness_N_m = 0.2 }\n"), motion)
          .at(0);
  EXPECT_TRUE(std::isinf(tether.amplitude_N[2]));
  EXPECT_NEAR(tether.rate_N_s[2], 0.2 * 1.5, 1e-12);
  for (const char* const none : {"com_offset", "accelerometer_scale"}) {
    const EffectBounds bounds =
        truth_bounds(vehicle(std::string("[[effect]]\nname = \"") + none + "\"\n"), motion).at(0);
    EXPECT_EQ(bounds.amplitude_N[2], 0) << none;
    EXPECT_FALSE(bounds.note.empty()) << none;
  }
}

TEST(TruthBounds, LiftJumpsWhereVehiclesTouchAndIsBoundedElsewhere) {
  const Model model = vehicle("[[effect]]\nname = \"upper_lift\"\nparameters = { amplitude_N = 0.02 }\n");
  MotionSet motion;
  motion.relative_speed_m_s = 1;
  motion.neighbour_mass_kg = kMass_kg;
  motion.neighbours = 2;
  EXPECT_TRUE(std::isinf(truth_bounds(model, motion).at(0).rate_N_s[2]));
  EXPECT_FALSE(truth_bounds(model, motion).at(0).unbounded.empty());
  motion.least_gap_m = 0.1;
  const EffectBounds bounds = truth_bounds(model, motion).at(0);
  const Seen seen = seen_of_wake(model.effects[0], motion, -1, 10000);
  EXPECT_LE(seen.rate_N_s, bounds.rate_N_s[2] * (1 + 1e-4));
  EXPECT_GT(seen.rate_N_s, 0.8 * bounds.rate_N_s[2]);
  EXPECT_LE(seen.amplitude_N, bounds.amplitude_N[2]);
}

TEST(TruthBounds, EncloseDragInflowSurfacesAndFlowOnRandomMotions) {
  const char* const effects[] = {
      "name = \"drag_linear\"\nparameters = { drag_N_s_m = 0.02 }\n",
      "name = \"drag_quadratic\"\nparameters = { drag_N_s2_m2 = 0.01 }\n",
      "name = \"drag_rotor\"\nparameters = { drag_N_s_m = 0.02 }\n",
      "name = \"inflow\"\nparameters = { loss_s_m = 0.05 }\n",
      "name = \"ground\"\nparameters = { amplitude = 0.2 }\n",
      "name = \"ceiling\"\nparameters = { amplitude = 0.2, height_m = 1.2 }\n",
      "name = \"voltage_sag\"\nparameters = { sag = 0.1 }\n",
      "name = \"thrust_saturation\"\nparameters = { loss = 0.5 }\n",
      "name = \"translational_lift\"\nparameters = { gain = 0.1, speed_m_s = 1 }\n",
      "name = \"vortex_ring\"\nparameters = { loss = 0.2, descent_m_s = 0.5 }\n",
      "name = \"wall\"\nparameters = { push = 0.1, place_m = 0.01 }\n",
      "name = \"wind_field\"\nparameters = { shear_x_N = 0.02, shear_y_N = -0.01, thermal_N = 0.02, height_m "
      "= 1.15, x_m = 0.3 }\n"};
  MotionSet motion;
  motion.speed_m_s = 1.5;
  motion.acceleration_m_s2 = 4;
  motion.largest_thrust_N = 0.6;
  motion.thrust_rate_N_s = 2;
  motion.least_height_m = 0.05;
  motion.largest_height_m = 1.15;
  for (const char* text : effects) {
    SCOPED_TRACE(text);
    const Model model = vehicle(std::string("[[effect]]\n") + text);
    const EffectBounds bounds = truth_bounds(model, motion).at(0);
    const AppliedEffect effect(model.effects[0], {"small", {"small"}, ""});
    Motions random(5);
    double nearest = 0;
    for (int run = 0; run < 20000; ++run) {
      Instant now;
      now.mass_kg = kMass_kg;
      now.p_W_m.z() = run % 2 == 0 ? motion.least_height_m + 1e-5 : motion.largest_height_m - 1e-5;
      now.v_W_m_s = motion.speed_m_s * random.direction();
      const Vector3d thrust = random.uniform(0.1, motion.largest_thrust_N - 1e-5) * random.direction();
      const auto point = [&](const Vector3d& T) {
        now.thrust_N = T.norm();
        now.R_WB = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), T).toRotationMatrix();
        return effect.wrench(now).force_W_N;
      };
      const Vector3d before = point(thrust);
      const double height_m = now.p_W_m.z();
      now.p_W_m += kDifference_s * now.v_W_m_s;
      if (now.p_W_m.z() < motion.least_height_m || now.p_W_m.z() > motion.largest_height_m)
        now.p_W_m.z() = height_m;
      now.v_W_m_s += kDifference_s * motion.acceleration_m_s2 * random.direction();
      const Vector3d rate =
          (point(thrust + kDifference_s * motion.thrust_rate_N_s * random.direction()) - before) /
          kDifference_s;
      for (int i = 0; i < 3; ++i) {
        ASSERT_LE(std::abs(before[i]), bounds.amplitude_N[i] * (1 + 1e-9));
        ASSERT_LE(std::abs(rate[i]), bounds.rate_N_s[i] * (1 + 1e-4));
      }
      nearest = std::max(nearest, rate.cwiseAbs().maxCoeff() / bounds.rate_N_s[0]);
    }
    EXPECT_GT(nearest, 0.4);
  }
}

TEST(TruthBounds, ALoadThatChangesHasAWeightButNoRate) {
  const auto bounds_of = [](const std::string& after_kg) {
    return truth_bounds(vehicle("[[effect]]\nname = \"payload_step\"\nparameters = { mass_before_kg = 0.004, "
                                "mass_after_kg = " +
                                after_kg + " }\n"),
                        MotionSet())
        .at(0);
  };
  const EffectBounds dropped = bounds_of("0.001");
  EXPECT_NEAR(dropped.amplitude_N[2], 0.004 * kGravity_m_s2, 1e-12);
  EXPECT_TRUE(std::isinf(dropped.rate_N_s[2]));
  EXPECT_FALSE(dropped.unbounded.empty());
  const EffectBounds kept = bounds_of("0.004");
  EXPECT_NEAR(kept.bias_N[2], 0.004 * kGravity_m_s2, 1e-12);
  EXPECT_EQ(kept.rate_N_s[2], 0);
}

TEST(TruthBounds, WhatIsNotEnclosedIsInfiniteAndSaysWhy) {
  const Model model = vehicle(
      "[[effect]]\nname = \"gust\"\nparameters = { a = 1.0 }\n[effect.expression]\nforce_z_N = \"a * "
      "sin(t)\"\nlinear = [\"a\"]\n[[effect]]\nname = \"battery\"\n[[effect]]\nname = "
      "\"motor_lag\"\n[[effect]]\nname = \"constant_force\"\nparameters = { force_x_N = -0.02 "
      "}\n[[effect]]\nname = \"drag_linear\"\nparameters = { drag_N_s_m = 0.01 }\n[[effect]]\nname = "
      "\"downwash\"\nparameters = { tail = 0.5 }\n");
  const auto bounds = truth_bounds(model, MotionSet());
  for (const std::size_t i : {0u, 1u, 4u, 5u}) {
    EXPECT_TRUE(std::isinf(bounds.at(i).rate_N_s[2])) << bounds[i].effect;
    EXPECT_FALSE(bounds[i].unbounded.empty());
  }
  EXPECT_EQ(bounds.at(2).rate_N_s[2], 0);
  EXPECT_FALSE(bounds.at(2).note.empty());
  EXPECT_EQ(bounds.at(3).bias_N[0], 0.02);
  EXPECT_EQ(bounds.at(3).rate_N_s[0], 0);
}

TEST(IntervalFunctions, EncloseTheFunctionsOfLongDouble) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 20000; ++i) {
    const double x = (unit(random) - 0.5) * std::pow(10, 5 * unit(random) - 3);
    const Interval e = exp_of(x);
    ASSERT_LE(e.lower, std::exp(static_cast<long double>(x))) << x;
    ASSERT_GE(e.upper, std::exp(static_cast<long double>(x))) << x;
    if (std::abs(x) < 50) {
      ASSERT_LT(e.upper - e.lower, 1e-12 * e.upper) << x;
    }
    const double y = std::pow(10, 12 * unit(random) - 6);
    const Interval l = log_of(y);
    ASSERT_LE(l.lower, std::log(static_cast<long double>(y)));
    ASSERT_GE(l.upper, std::log(static_cast<long double>(y)));
    const double n = 4 * unit(random);
    const Interval p = pow(Interval(y), n);
    ASSERT_LE(p.lower, std::pow(static_cast<long double>(y), static_cast<long double>(n)));
    ASSERT_GE(p.upper, std::pow(static_cast<long double>(y), static_cast<long double>(n)));
  }
}

}  // namespace
}  // namespace swarmcert::stability
