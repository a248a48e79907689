#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <set>

#include "data.h"
#include "nn/base/input_error.h"
#include "random_instant.h"
#include "stability/bodies/swarm_pairs.h"
#include "stability/bodies/vehicle_state.h"
#include "stability/effects/downwash.h"
#include "stability/effects/registry.h"
#include "stability/effects/state_effect.h"

namespace swarmcert::stability {
namespace {

using tests::RandomInstant;

const EffectContext kContext = {"small", {"small"}, SWARMCERT_SOURCE_DIR "/nn/networks/demo/model.toml"};

EffectSpec spec_of(const std::string& name) {
  EffectSpec spec;
  spec.name = name;
  if (name == "deep_set") spec.network = "network.toml";
  return spec;
}

double default_of(const std::string& effect, const std::string& parameter) {
  for (const Parameter& p : effect_info(effect).shape) {
    if (p.name == parameter) return p.value;
  }
  throw std::logic_error(parameter);
}

TEST(Effects, HaveTheNamesOfTheCommandLine) {
  const std::set<std::string> wanted = {"motor_lag",
                                        "delay",
                                        "sensor_delay",
                                        "thrust_ratio",
                                        "battery",
                                        "drag_linear",
                                        "drag_quadratic",
                                        "drag_rotor",
                                        "inflow",
                                        "ground",
                                        "ceiling",
                                        "downwash",
                                        "upper_lift",
                                        "constant_force",
                                        "torque_bias",
                                        "torque_ratio",
                                        "rate_damping",
                                        "rotor_momentum",
                                        "flow_torque",
                                        "deep_set",
                                        "downwash_torque",
                                        "voltage_sag",
                                        "thrust_saturation",
                                        "payload_step",
                                        "translational_lift",
                                        "wind_field",
                                        "wall",
                                        "vortex_ring",
                                        "rotor_thrust",
                                        "com_offset",
                                        "imu_tilt",
                                        "wake_delay",
                                        "tether",
                                        "accelerometer_scale",
                                        "pendulum"};
  const std::vector<std::string> names = effect_names();
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()), wanted);
}

TEST(Effects, DescribeThemselvesWithBoundsThatHoldTheirDefaultsForACrazyflie) {
  Model crazyflie;
  crazyflie.mass_kg = 0.034;
  crazyflie.arm_m = 0.046;
  for (const std::string& name : effect_names()) {
    SCOPED_TRACE(name);
    const EffectInfo info = effect_info(name, crazyflie);
    EXPECT_FALSE(info.equation.empty());
    EXPECT_FALSE(info.source.empty());
    EXPECT_FALSE(info.excitation.empty());
    EXPECT_FALSE(info.equivalence_class.empty());
    ASSERT_FALSE(info.linear.empty());
    EXPECT_LE(info.linear.size(), static_cast<std::size_t>(kMostColumns));
    EXPECT_LE(info.shape.size(), static_cast<std::size_t>(kMostShape));
    for (const auto* parameters : {&info.linear, &info.shape}) {
      for (const Parameter& p : *parameters) {
        EXPECT_LE(p.lower, p.value) << p.name;
        EXPECT_GE(p.upper, p.value) << p.name;
        for (const double value : p.grid) EXPECT_TRUE(p.lower <= value && value <= p.upper) << p.name;
      }
    }
  }
  EXPECT_EQ(effect_info("thrust_ratio").equivalence_class, "mass / payload / thrust scale");
  EXPECT_EQ(effect_info("constant_force").equivalence_class, "wind / tilt / IMU bias");
}

TEST(Effects, ForceIsColumnsTimesCoefficientsAtRandomStates) {
  std::mt19937_64 random(7);
  int acting = 0;
  for (const std::string& name : effect_names()) {
    if (effect_info(name).remembers) continue;
    SCOPED_TRACE(name);
    EffectSpec spec = spec_of(name);
    std::vector<double> coefficients;
    for (const Parameter& p : effect_info(name).linear) {
      coefficients.push_back(p.lower + 0.3 * (p.upper - p.lower));
      spec.parameters[p.name] = coefficients.back();
    }
    const AppliedEffect applied(spec, kContext);
    const std::unique_ptr<Effect> effect = make_effect(spec_of(name), kContext);
    for (const std::vector<double>& shape : effect->grid({0.05, 1.2})) {
      EXPECT_EQ(shape.size(), effect->info().shape.size());
    }
    if (dynamic_cast<const StateEffect*>(effect.get()) != nullptr) continue;  // depends on the past
    const std::vector<double>& shape = applied.shape();
    const std::unique_ptr<ColumnStream> stream = effect->stream(shape.data());
    for (int trial = 0; trial < 200; ++trial) {
      const RandomInstant state(random, trial % 5);
      std::vector<Wrench> columns(coefficients.size());
      stream->advance(state.now, columns.data());
      Eigen::Vector3d force = Eigen::Vector3d::Zero();
      Eigen::Vector3d torque = Eigen::Vector3d::Zero();
      for (std::size_t k = 0; k < columns.size(); ++k) {
        force += coefficients[k] * columns[k].force_W_N;
        torque += coefficients[k] * columns[k].torque_B_Nm;
      }
      const Wrench wrench = applied.wrench(state.now);
      ASSERT_LT((wrench.force_W_N - force).norm(), 1e-12 * (1 + force.norm()));
      ASSERT_LT((wrench.torque_B_Nm - torque).norm(), 1e-12);
      if (force.norm() + torque.norm() > 1e-6) ++acting;
    }
  }
  EXPECT_GT(acting, 1500) << "the states must reach the effects";
}

TEST(Effects, GiveTheSameBitsForInstantsInARowAsForEachAlone) {
  std::mt19937_64 random(11);
  for (const std::string& name : effect_names()) {
    if (effect_info(name).remembers) continue;
    SCOPED_TRACE(name);
    const std::unique_ptr<Effect> effect = make_effect(spec_of(name), kContext);
    // More than fit in registers, and more pairs than the downwash processes at once; includes vehicles without
    // neighbours.
    std::deque<RandomInstant> states;
    std::vector<Instant> instants;
    for (int i = 0; i < 77; ++i) instants.push_back(states.emplace_back(random, i % 7 == 6 ? 50 : i % 5).now);
    const int width = effect->num_columns();
    std::vector<Wrench> in_a_row(instants.size() * static_cast<std::size_t>(width));
    std::vector<std::vector<double>> shapes = effect->grid({0.05, 1.2});
    shapes.push_back(AppliedEffect(spec_of(name), kContext).shape());
    for (const std::vector<double>& shape : shapes) {
      effect->stream(shape.data())
          ->advance_along(instants.data(), static_cast<int>(instants.size()), width, in_a_row.data());
      const std::unique_ptr<ColumnStream> stream = effect->stream(shape.data());
      std::vector<Wrench> alone(static_cast<std::size_t>(width));
      for (std::size_t i = 0; i < instants.size(); ++i) {
        stream->advance(instants[i], alone.data());
        for (std::size_t k = 0; k < alone.size(); ++k) {
          const Wrench& other = in_a_row[i * alone.size() + k];
          ASSERT_EQ(other.force_W_N, alone[k].force_W_N) << i;
          ASSERT_EQ(other.torque_B_Nm, alone[k].torque_B_Nm) << i;
        }
      }
    }
  }
}

/// Force in gram-force on a vehicle that is `dz_m` below another, at horizontal distance `r_m`.
double downwash_gf(double r_m, double dz_m, double norm_exponent = 1.3, int copies = 1) {
  EffectSpec spec = spec_of("downwash");
  spec.parameters["norm_exponent"] = norm_exponent;
  const AppliedEffect downwash(spec, kContext);
  const std::vector<Neighbour> above(
      static_cast<std::size_t>(copies),
      {{r_m, 0, dz_m}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.034, 0});
  Instant now;
  now.mass_kg = 0.034;
  now.neighbours = above.data();
  now.num_neighbours = copies;
  return downwash.wrench(now).force_W_N.z() / kGramForce_N;
}

TEST(Downwash, HasThePublishedValuesOfItsFit) {
  const double r[] = {0, 0.05, 0.1, 0.15};
  const double dz[] = {0.2, 0.3, 0.5};
  const double expected_gf[3][4] = {{-11.996648, -5.967843, -0.734666, -0.022381},
                                    {-10.032990, -6.144667, -1.411570, -0.121630},
                                    {-8.009931, -6.055821, -2.617013, -0.646439}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j)
      EXPECT_NEAR(downwash_gf(r[j], dz[i]), expected_gf[i][j], 1e-6) << dz[i] << " " << r[j];
  }
}

TEST(Downwash, ComposesByThePNormAndActsDownwardsOnly) {
  const double one = downwash_gf(0.02, 0.3);
  for (const double p : {1.0, 1.3, 1.85, 2.0}) {
    EXPECT_NEAR(downwash_gf(0.02, 0.3, p, 3), one * std::pow(3, 1 / p), 1e-9);
    EXPECT_NEAR(downwash_gf(0.02, 0.3, p, 1), one, 1e-12);
  }
  EXPECT_EQ(downwash_gf(0, -0.3), 0);
  EXPECT_EQ(downwash_gf(0, 0.05), 0);
  EXPECT_EQ(downwash_gf(1, 0.3), 0) << "beyond its reach";
  for (double dz = 0.05; dz < 0.13; dz += 1e-3)
    EXPECT_LT(std::abs(downwash_gf(0, dz + 1e-6) - downwash_gf(0, dz)), 1e-3);
}

TEST(Downwash, IsItsFormulaToRoundingForAnyNumberOfNeighboursAndShape) {
  std::mt19937_64 random(11);
  const auto uniform = [&random](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
  };
  int acting = 0, fading = 0;
  double worst = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    EffectSpec spec = spec_of("downwash");
    const long double n = uniform(0, 4), s0 = uniform(0.005, 0.3), s1 = uniform(0, 1), p = uniform(1, 10);
    const long double k = trial % 3 == 0 ? uniform(0, 1) : 0, e = uniform(0, 2);
    const long double q = trial % 2 == 0 ? 0 : trial % 7 == 1 ? 1e-9 : uniform(0, 1);
    const auto set = [&](const char* name, long double x) { spec.parameters[name] = static_cast<double>(x); };
    set("amplitude_N", 1);
    set("decay_exponent", n);
    set("spread_m", s0);
    set("spread_slope", s1);
    set("norm_exponent", p);
    set("convection_s_m", k);
    set("mass_exponent", e);
    set("tail", q);
    std::vector<Neighbour> all;
    long double sum = 0;
    const int count = 1 + trial % 40;
    for (int j = 0; j < count; ++j) {
      Neighbour other = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.034, 0};
      other.dp_W_m = {uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-0.2, j % 4 == 0 ? 0.15 : 1.5)};
      other.v_W_m_s = {uniform(-2, 2), uniform(-2, 2), 0};
      other.mass_kg = trial % 5 == 0 ? 0.067 : 0.034;
      all.push_back(other);
      const long double dz = other.dp_W_m.z();
      if (dz <= 0.05L) continue;
      const long double x = other.dp_W_m.x() - k * dz * other.v_W_m_s.x();
      const long double y = other.dp_W_m.y() - k * dz * other.v_W_m_s.y();
      const long double h = std::max(dz, 0.12L), s = s0 + s1 * h, r2 = (x * x + y * y) / (s * s);
      if (q == 0 && r2 > 49) continue;
      const long double inside = std::min(1.0L, (dz - 0.05L) / 0.07L);
      fading += inside < 1;
      const long double profile = q == 0 ? std::exp(-r2 / 2) : std::exp(-std::log1p(q * r2 / 2) / q);
      sum += std::pow(std::pow(other.mass_kg / 0.034L, e) * std::pow(0.3L / h, n) * profile * inside *
                          inside * (3 - 2 * inside),
                      p);
    }
    Instant now;
    now.neighbours = all.data();
    now.num_neighbours = count;
    const double given = -AppliedEffect(spec, kContext).wrench(now).force_W_N.z();
    const auto expected = static_cast<double>(std::pow(sum, 1 / p));
    if (expected < 1e-30) {
      ASSERT_LE(given, 1e-30);
      continue;
    }
    worst = std::max(worst, std::abs(given / expected - 1));
    ++acting;
  }
  EXPECT_GT(acting, 2000);
  EXPECT_GT(fading, 2000);
  EXPECT_LT(worst, 2e-14);
}

TEST(Downwash, HasTheSameBitsForOneVehicleAndForASwarm) {
  std::mt19937_64 random(12);
  const auto uniform = [&random](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random);
  };
  int acting = 0, composed = 0;
  for (int trial = 0; trial < 300; ++trial) {
    EffectSpec spec = spec_of("downwash");
    spec.parameters["convection_s_m"] = trial % 3 == 0 ? 0.15 : 0;
    spec.parameters["tail"] = trial % 4 == 1 ? 0.5 : 0;
    const std::unique_ptr<Effect> effect = make_effect(spec, kContext);
    const std::vector<double> shape = effect_values(effect->info(), spec).shape;
    ASSERT_TRUE(effect->takes_pairs());
    const int vehicles = 1 + trial % 26, most = trial % 2 == 0 ? 3 : 12;
    const double coefficient = uniform(0.05, 0.2);
    const auto lines = lines_for(static_cast<std::size_t>(vehicles));
    Rows states[] = {Rows(lines * kVehicleStateSize), Rows(lines * kVehicleStateSize)};
    Rows before(lines), after[] = {Rows(lines), Rows(lines)};
    for (int i = 0; i < vehicles; ++i) {
      before.data()[i] = uniform(-0.1, 0.1);
      for (Rows& state : states) {
        for (int c = 0; c < 6; ++c) {
          state.data()[row_index(i, kVehicleStateSize) + static_cast<std::size_t>(c * kRowLength)] =
              c < 2    ? uniform(-0.15, 0.15)
              : c == 2 ? uniform(0, 1.2)
                       : uniform(-1, 1);
        }
      }
    }
    SwarmPairs pairs(vehicles);
    std::vector<std::vector<int>> others(static_cast<std::size_t>(vehicles));
    for (int i = 0; i < vehicles; ++i) {
      int left = static_cast<int>(random() % static_cast<unsigned>(most));
      for (int j = 0; j < vehicles; ++j) {
        if (j == i || left == 0 || random() % 3 == 0) continue;
        --left;
        others[static_cast<std::size_t>(i)].push_back(j);
        pairs.add(i, j, effect->pair_constant(j % 2 == 0 ? 0.034 : 0.067, shape.data()));
      }
    }
    if (pairs.empty()) continue;
    Rows scratch(pairs.scratch_lines());
    const double* const at[] = {states[0].data(), states[1].data()};
    const double* const from[] = {before.data(), before.data()};
    double* const to[] = {after[0].data(), after[1].data()};
    const int num_states = 1 + trial / 26 % 2;
    effect->add_force_z(pairs, at, num_states, shape.data(), coefficient, scratch.data(),
                        {from, to, kRowLength});
    for (int s = 0; s < num_states; ++s) {
      for (int i = 0; i < vehicles; ++i) {
        const auto three = [&](int vehicle, int first) {
          const double* const x = at[s] + row_index(vehicle, kVehicleStateSize) + first * kRowLength;
          return Eigen::Vector3d(x[0], x[kRowLength], x[2 * kRowLength]);
        };
        std::vector<Neighbour> neighbours;
        for (const int j : others[static_cast<std::size_t>(i)]) {
          neighbours.push_back({three(j, kPosition) - three(i, kPosition), Eigen::Vector3d::Zero(),
                                three(j, kVelocity), j % 2 == 0 ? 0.034 : 0.067, 0});
        }
        Instant now;
        now.neighbours = neighbours.data();
        now.num_neighbours = static_cast<int>(neighbours.size());
        Wrench column;
        effect->columns(now, shape.data(), &column);
        ASSERT_EQ(to[s][i], before.data()[i] + coefficient * column.force_W_N.z())
            << vehicles << " vehicles, number " << i << " of state " << s;
        acting += column.force_W_N.z() < 0;
        composed += column.force_W_N.z() < 0 && neighbours.size() > 2;
      }
    }
  }
  EXPECT_GT(acting, 1000);
  EXPECT_GT(composed, 300);
}

/// A level vehicle whose rotors give `f`, with the simulator's mixing (swarm.cpp): arms of 0.046 m, torque per thrust
/// 0.006 m.
Instant rotors_of(const Eigen::Vector4d& f_N) {
  const double offset_m = 0.046 * std::sqrt(0.5);
  Instant now;
  now.thrust_N = f_N.sum();
  now.torque_B_Nm = {offset_m * (f_N[2] + f_N[3] - f_N[0] - f_N[1]),
                     offset_m * (f_N[1] + f_N[2] - f_N[0] - f_N[3]),
                     0.006 * (f_N[1] + f_N[3] - f_N[0] - f_N[2])};
  return now;
}

TEST(RotorThrust, IsTheThrustAndTorqueOfTheRotorsWithTheirFactors) {
  const Eigen::Vector4d f_N(0.09, 0.07, 0.11, 0.08), factors(1, 0.9, 0.8, 1.05);
  EffectSpec spec = spec_of("rotor_thrust");
  for (int k = 0; k < 4; ++k) spec.parameters["rotor_" + std::to_string(k + 1)] = factors[k];
  const Instant now = rotors_of(f_N), wanted = rotors_of(f_N.cwiseProduct(factors));
  const Wrench wrench = AppliedEffect(spec, kContext).wrench(now);
  EXPECT_NEAR(wrench.force_W_N.z(), wanted.thrust_N - now.thrust_N, 1e-15);
  EXPECT_LT((wrench.torque_B_Nm - (wanted.torque_B_Nm - now.torque_B_Nm)).norm(), 1e-15);
  const Wrench nominal = AppliedEffect(spec_of("rotor_thrust"), kContext).wrench(now);
  EXPECT_LT(nominal.force_W_N.norm() + nominal.torque_B_Nm.norm(), 1e-15) << "factors of 1 change nothing";
}

/// Returns the downwash on a level vehicle that is displaced by (x, y).
double downwash_N(const Instant& now, double x, double y) {
  std::vector<Neighbour> seen(now.neighbours, now.neighbours + now.num_neighbours);
  for (Neighbour& neighbour : seen) neighbour.dp_W_m -= Eigen::Vector3d(x, y, 0);
  Instant moved = now;
  moved.neighbours = seen.data();
  return AppliedEffect(spec_of("downwash"), kContext).wrench(moved).force_W_N.z();
}

TEST(DownwashTorque, OfShortArmsIsTheSlopeOfDownwash) {
  std::mt19937_64 random(21);
  constexpr double kArm_m = 0.01, kStep_m = 1e-5;
  EffectSpec spec = spec_of("downwash_torque");
  spec.parameters["arm_m"] = kArm_m;
  const AppliedEffect effect(spec, kContext);
  int tilted = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    RandomInstant instant(random, 1 + trial % 3);
    instant.now.R_WB.setIdentity();
    const auto slope = [&](double x, double y) {
      return (downwash_N(instant.now, x, y) - downwash_N(instant.now, -x, -y)) / (2 * kStep_m);
    };
    const Eigen::Vector3d expected =
        kArm_m * kArm_m / 2 * Eigen::Vector3d(slope(0, kStep_m), -slope(kStep_m, 0), 0);
    const Wrench wrench = effect.wrench(instant.now);
    EXPECT_EQ(wrench.force_W_N.norm(), 0);
    // The next term is (arm / wake width)^2 of it; the narrowest wake is 0.04 m wide.
    EXPECT_LT((wrench.torque_B_Nm - expected).norm(), 0.15 * expected.norm() + 2e-6) << trial;
    if (expected.norm() > 2e-5) ++tilted;
  }
  EXPECT_GT(tilted, 30);
}

TEST(DownwashTorque, TiltsTowardsTheWakeAndTurnsWithTheSwarm) {
  const AppliedEffect effect(spec_of("downwash_torque"), kContext);
  Neighbour above = {{0.08, 0, 0.3}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.034, 0};
  Instant now;
  now.neighbours = &above;
  now.num_neighbours = 1;
  const Eigen::Vector3d towards = effect.wrench(now).torque_B_Nm;
  EXPECT_GT(towards.y(), 1e-5) << "about +y: the thrust axis falls towards +x, where the wake pushes";
  EXPECT_NEAR(towards.x(), 0, 1e-15);
  // A quarter turn of world and vehicle does not change the torque in the body frame.
  now.R_WB = Eigen::AngleAxisd(1.5707963267948966, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  above.dp_W_m = now.R_WB * above.dp_W_m;
  EXPECT_LT((effect.wrench(now).torque_B_Nm - towards).norm(), 1e-15);
  above.dp_W_m = {0, 0, 0.3};
  EXPECT_LT(effect.wrench(now).torque_B_Nm.norm(), 1e-15) << "straight above: every rotor is pushed alike";
}

TEST(Downwash, ANeighbourThatIsNowhereGivesNoNumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double tail : {0.0, 0.5}) {
    for (int axis = 0; axis < 3; ++axis) {
      EffectSpec spec = spec_of("downwash");
      spec.parameters["tail"] = tail;
      Neighbour near = {{0.01, 0, 0.3}, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), 0.034, 0};
      Neighbour all[] = {near, near};
      all[1].dp_W_m[axis] = nan;
      Instant now;
      now.neighbours = all;
      now.num_neighbours = 2;
      EXPECT_TRUE(std::isnan(AppliedEffect(spec, kContext).wrench(now).force_W_N.z())) << axis << " " << tail;
    }
  }
}

TEST(Downwash, IsZeroBeyondItsReach) {
  const std::unique_ptr<Effect> effect = make_effect(spec_of("downwash"), kContext);
  const EffectValues values = effect_values(effect->info(), spec_of("downwash"));
  for (const double dz : {0.1, 0.3, 0.8}) {
    const double reach_m = effect->reach_m(dz, values.shape.data());
    EXPECT_EQ(downwash_gf(reach_m * 1.0001, dz), 0);
    EXPECT_LT(downwash_gf(reach_m * 0.95, dz), 0);
  }
}

TEST(MotorLag, StreamIsTheExactResponseToARamp) {
  // tau x' = u - x, u = t, x(0) = 0: x = t - tau (1 - exp(-t / tau)).
  const std::unique_ptr<Effect> lag = make_effect(spec_of("motor_lag"), kContext);
  const double tau_s = default_of("motor_lag", "tau_s");
  const auto stream = lag->stream(&tau_s);
  Instant now;
  for (const double t : {0.0, 0.01, 0.0195, 0.03, 0.1, 0.11}) {
    now.time_s = t;
    now.thrust_N = t;
    Wrench column;
    stream->advance(now, &column);
    EXPECT_NEAR(column.force_W_N.z(), -tau_s * (1 - std::exp(-t / tau_s)), 1e-15) << t;
  }
  stream->restart();
  Wrench column;
  stream->advance(now, &column);
  EXPECT_EQ(column.force_W_N.z(), 0) << "no past";
}

TEST(Delay, StreamReadsThePastOfIrregularSamples) {
  for (const std::string name : {"delay", "sensor_delay"}) {
    SCOPED_TRACE(name);
    const std::unique_ptr<Effect> delay = make_effect(spec_of(name), kContext);
    const double delay_s = 0.023;
    const auto stream = delay->stream(&delay_s);
    std::mt19937_64 random(3);
    Instant now;
    double t = 0;
    for (int k = 0; k < 500; ++k) {
      t += std::uniform_real_distribution<double>(0.008, 0.012)(random);
      now.time_s = t;
      now.thrust_N = 2 * t + 1;
      Wrench column;
      stream->advance(now, &column);
      if (k <= 5) continue;
      ASSERT_NEAR(column.force_W_N.z(), -2 * delay_s, 1e-12);
    }
  }
}

TEST(DeepSetEffect, EqualsTheNetworkAndDoesNotDependOnTheOrderOfNeighbours) {
  const std::unique_ptr<Effect> effect = make_effect(spec_of("deep_set"), kContext);
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 50; ++trial) {
    RandomInstant state(random, 4);
    Wrench column, shuffled;
    effect->columns(state.now, nullptr, &column);
    std::swap(state.neighbours[0], state.neighbours[3]);
    std::swap(state.neighbours[1], state.neighbours[2]);
    effect->columns(state.now, nullptr, &shuffled);
    EXPECT_EQ(column.force_W_N.z(), shuffled.force_W_N.z());
    EXPECT_TRUE(std::isfinite(column.force_W_N.z()));
  }
}

class SidewaysPull : public Effect {
 public:
  SidewaysPull() : Effect(describe()) {}
  static EffectInfo describe() {
    return {"sideways_pull", "f_x = a T", "a test", "", "thrust changes", {{"pull", "", 0, -1, 1}}, {}};
  }
  void columns(const Instant& now, const double*, Wrench* columns) const override {
    columns[0] = {{now.thrust_N, 0, 0}, {0, 0, 0}};
  }
};

// Must be the last test, since the effect stays in the registry.
TEST(RegisteredEffect, IsNamedInModelFilesAndTakesPartLikeTheOthers) {
  const EffectMaker make = [](const EffectSpec&, const EffectContext&) {
    return std::make_unique<SidewaysPull>();
  };
  register_effect(SidewaysPull::describe(), make);
  EXPECT_THROW(register_effect(SidewaysPull::describe(), make), std::invalid_argument);
  EXPECT_EQ(effect_names().back(), "sideways_pull");
  EXPECT_EQ(effect_info("sideways_pull").equivalence_class, "sideways_pull");
  EffectSpec spec = spec_of("sideways_pull");
  spec.parameters["pull"] = 0.1;
  Instant now;
  now.thrust_N = 0.3;
  EXPECT_NEAR(AppliedEffect(spec, kContext).wrench(now).force_W_N.x(), 0.03, 1e-15);
}

}  // namespace
}  // namespace swarmcert::stability
