/// Effects of supply, propellers, loads and moving air: their formulas at hand-picked states, and where they vanish.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "stability/effects/registry.h"

namespace swarmcert::stability {
namespace {

constexpr double kFlowMass_kg = 0.034, kFlowWeight_N = kFlowMass_kg * kGravity_m_s2, kFlowAccuracy_N = 1e-12;

Eigen::Vector3d flow_force(const std::string& name, const std::map<std::string, double>& parameters,
                           const Instant& now) {
  EffectSpec spec;
  spec.name = name;
  spec.parameters = parameters;
  return AppliedEffect(spec, {"small", {"small"}, ""}).wrench(now).force_W_N;
}

Instant hovering() {
  Instant now;
  now.mass_kg = kFlowMass_kg;
  now.thrust_N = kFlowWeight_N;
  now.p_W_m = {0, 0, 0.5};
  return now;
}

TEST(VoltageSag, CostsNothingInHoverAndGrowsWithThePower) {
  Instant now = hovering();
  EXPECT_NEAR(flow_force("voltage_sag", {{"sag", 0.1}}, now).norm(), 0, kFlowAccuracy_N);
  now.thrust_N = 4 * kFlowWeight_N;  // 4^(3/2) - 1 = 7
  EXPECT_NEAR(flow_force("voltage_sag", {{"sag", 0.1}}, now).z(), -0.1 * 7 * 4 * kFlowWeight_N,
              kFlowAccuracy_N);
  now.thrust_N = 0;
  EXPECT_EQ(flow_force("voltage_sag", {{"sag", 0.1}}, now).norm(), 0);
}

TEST(ThrustSaturation, ActsAboveTheKneeAlone) {
  const std::map<std::string, double> parameters = {{"loss", 0.8}, {"knee_weights", 1.2}};
  Instant now = hovering();
  EXPECT_EQ(flow_force("thrust_saturation", parameters, now).norm(), 0);
  now.thrust_N = 1.5 * kFlowWeight_N;
  EXPECT_NEAR(flow_force("thrust_saturation", parameters, now).z(), -0.8 * 0.3 * kFlowWeight_N,
              kFlowAccuracy_N);
}

TEST(PayloadStep, IsTheLoadsWeightBeforeAndAfterItsTime) {
  const std::map<std::string, double> parameters = {
      {"mass_before_kg", 0.004}, {"mass_after_kg", -0.001}, {"time_s", 14}};
  Instant now = hovering();
  now.time_s = 13.999;
  EXPECT_NEAR(flow_force("payload_step", parameters, now).z(), -0.004 * kGravity_m_s2, kFlowAccuracy_N);
  now.time_s = 14;
  EXPECT_NEAR(flow_force("payload_step", parameters, now).z(), 0.001 * kGravity_m_s2, kFlowAccuracy_N);
}

TEST(TranslationalLift, ComesWithSpeedAcrossTheThrustAxisOnly) {
  const std::map<std::string, double> parameters = {{"gain", 0.1}, {"speed_m_s", 0.5}};
  Instant now = hovering();
  now.v_W_m_s = {0, 0, 3};
  EXPECT_EQ(flow_force("translational_lift", parameters, now).norm(), 0);
  now.v_W_m_s = {0.3, 0.4, 3};
  EXPECT_NEAR(flow_force("translational_lift", parameters, now).z(),
              0.1 * kFlowWeight_N * (1 - std::exp(-1.0)), kFlowAccuracy_N);
  now.v_W_m_s = {100, 0, 0};
  EXPECT_NEAR(flow_force("translational_lift", parameters, now).z(), 0.1 * kFlowWeight_N, kFlowAccuracy_N);
}

TEST(VortexRing, TakesMostAtItsDescentAndNothingWhileClimbing) {
  const std::map<std::string, double> parameters = {{"loss", 0.2}, {"descent_m_s", 0.8}, {"width_m_s", 0.2}};
  Instant now = hovering();
  now.v_W_m_s = {0, 0, -0.8};
  EXPECT_NEAR(flow_force("vortex_ring", parameters, now).z(), -0.2 * kFlowWeight_N, kFlowAccuracy_N);
  now.v_W_m_s.z() = -1;
  EXPECT_NEAR(flow_force("vortex_ring", parameters, now).z(), -0.2 * kFlowWeight_N * std::exp(-0.5),
              kFlowAccuracy_N);
  now.v_W_m_s.z() = 0.8;
  EXPECT_LT(std::abs(flow_force("vortex_ring", parameters, now).z()), 1e-12);
}

TEST(WindField, IsALayerOverTheHeightAndAColumnOverThePlace) {
  const std::map<std::string, double> parameters = {
      {"shear_x_N", 0.03},  {"shear_y_N", -0.01}, {"thermal_N", 0.02}, {"height_m", 0.5},
      {"thickness_m", 0.1}, {"x_m", 0.3},         {"y_m", -0.4},       {"radius_m", 0.25}};
  Instant now = hovering();
  now.p_W_m = {0.3, -0.4, 0.5};
  EXPECT_LT((flow_force("wind_field", parameters, now) - Eigen::Vector3d(0.015, -0.005, 0.02)).norm(),
            kFlowAccuracy_N);
  now.p_W_m = {0.3, -0.15, 2.5};
  EXPECT_LT((flow_force("wind_field", parameters, now) - Eigen::Vector3d(0.03, -0.01, 0.02 * std::exp(-0.5)))
                .norm(),
            1e-9);
  now.p_W_m = {-30, 0, -50};
  EXPECT_LT(flow_force("wind_field", parameters, now).norm(), 1e-12);
}

TEST(Wall, PushesIntoTheRoomAndFadesAwayFromIt) {
  const double quarter = std::acos(0.0);
  const std::map<std::string, double> parameters = {
      {"push", 0.1}, {"bearing_rad", quarter}, {"place_m", 1.5}, {"decay_m", 0.2}};
  Instant now = hovering();
  now.p_W_m = {5, 1.5, 0.5};
  EXPECT_LT((flow_force("wall", parameters, now) - Eigen::Vector3d(0, -0.1 * kFlowWeight_N, 0)).norm(),
            kFlowAccuracy_N);
  now.p_W_m.y() = 1.3;
  EXPECT_NEAR(flow_force("wall", parameters, now).y(), -0.1 * kFlowWeight_N * std::exp(-1.0),
              kFlowAccuracy_N);
  now.p_W_m.y() = -20;
  EXPECT_LT(flow_force("wall", parameters, now).norm(), kFlowAccuracy_N);
}

TEST(ComOffset, LeversTheThrustAboutTheCentreOfMass) {
  EffectSpec spec;
  spec.name = "com_offset";
  spec.parameters = {{"offset_x_m", 0.002}, {"offset_y_m", -0.001}};
  Instant now = hovering();
  now.R_WB = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Wrench wrench = AppliedEffect(spec, {"small", {"small"}, ""}).wrench(now);
  // The rotors' centre is at -c from the centre of mass; the rotors push along body z.
  const Eigen::Vector3d expected =
      Eigen::Vector3d(-0.002, 0.001, 0).cross(Eigen::Vector3d(0, 0, kFlowWeight_N));
  EXPECT_LT((wrench.torque_B_Nm - expected).norm(), 1e-15);
  EXPECT_EQ(wrench.force_W_N.norm(), 0);
}

Eigen::Vector3d torque_of(const std::string& name, const std::map<std::string, double>& parameters,
                          const Instant& now) {
  EffectSpec spec;
  spec.name = name;
  spec.parameters = parameters;
  const Wrench wrench = AppliedEffect(spec, {"small", {"small"}, ""}).wrench(now);
  EXPECT_EQ(wrench.force_W_N.norm(), 0);
  return wrench.torque_B_Nm;
}

TEST(FlowTorque, TiltsTheThrustAxisAwayFromTheDirectionOfFlight) {
  Instant now = hovering();
  EXPECT_EQ(torque_of("flow_torque", {{"moment_N_s", 5e-4}}, now).norm(), 0);
  now.R_WB = Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.6, 0, 0.8)).toRotationMatrix();
  now.v_W_m_s = now.R_WB * Eigen::Vector3d(2, 0, 1);
  const Eigen::Vector3d torque = torque_of("flow_torque", {{"moment_N_s", 5e-4}}, now);
  EXPECT_LT((torque - Eigen::Vector3d(0, -1e-3, 0)).norm(), 1e-15);  // nose up
  // The thrust axis turns with omega x e3.
  EXPECT_LT(torque.cross(Eigen::Vector3d::UnitZ()).x(), 0);
}

TEST(RateDamping, TakesEnergyFromEveryRotation) {
  Instant now = hovering();
  now.omega_B_rad_s = {1, -2, 3};
  const Eigen::Vector3d torque =
      torque_of("rate_damping", {{"damping_xy_N_m_s", 1e-4}, {"damping_z_N_m_s", 2e-4}}, now);
  EXPECT_LT((torque - Eigen::Vector3d(-1e-4, 2e-4, -6e-4)).norm(), 1e-15);
  EXPECT_LT(torque.dot(now.omega_B_rad_s), 0);
}

TEST(RotorMomentum, IsWhatTheBodyGivesToTheRotors) {
  EffectSpec spec;
  spec.name = "rotor_momentum";
  spec.parameters = {{"inertia_kg_m2", 5e-8}};
  const AppliedEffect effect(spec, {"small", {"small"}, ""});
  const auto stream = effect.effect().stream(nullptr);
  Instant now = hovering();
  now.rotor_spin_rad_s = 40;
  now.omega_B_rad_s = {2, 0, 0};
  Wrench column;
  stream->advance(now, &column);
  // A steady rotor of a rolling body: tau = -omega x h.
  EXPECT_LT((column.torque_B_Nm - Eigen::Vector3d(0, 80, 0)).norm(), 1e-12);
  now.time_s = 0.01;
  now.omega_B_rad_s.setZero();
  now.rotor_spin_rad_s = 50;
  stream->advance(now, &column);
  // Counterclockwise rotors that speed up turn the body clockwise.
  EXPECT_LT((column.torque_B_Nm - Eigen::Vector3d(0, 0, -1000)).norm(), 1e-9);
  stream->restart();
  now.time_s = 5;
  now.rotor_spin_rad_s = 90;
  stream->advance(now, &column);
  EXPECT_EQ(column.torque_B_Nm.norm(), 0);
}

TEST(TorqueRatio, IsAChangeOfTheRotorsTorqueAboutEachAxis) {
  Instant now = hovering();
  now.torque_B_Nm = {1e-3, 2e-3, 3e-3};
  EXPECT_LT((torque_of("torque_ratio", {{"change_x", -0.5}, {"change_y", 0.1}}, now) -
             Eigen::Vector3d(-5e-4, 2e-4, 0))
                .norm(),
            1e-15);
}

TEST(ImuTilt, TiltsTheThrustInTheBody) {
  Instant now = hovering();
  now.R_WB = Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  // Rotors tilted about body x by t push along body -y, here along world x.
  const Eigen::Vector3d of_x = flow_force("imu_tilt", {{"tilt_x_rad", 0.03}}, now);
  EXPECT_LT((of_x - Eigen::Vector3d(0.03 * kFlowWeight_N, 0, 0)).norm(), kFlowAccuracy_N);
  const Eigen::Vector3d of_y = flow_force("imu_tilt", {{"tilt_y_rad", 0.03}}, now);
  EXPECT_LT((of_y - Eigen::Vector3d(0, 0.03 * kFlowWeight_N, 0)).norm(), kFlowAccuracy_N);
}

TEST(WakeDelay, IsTheDownwashOfNeighboursWhereTheyWere) {
  const std::map<std::string, double> shape = {
      {"amplitude_N", 0.1}, {"decay_exponent", 1}, {"spread_m", 0.05}, {"spread_slope", 0.1}};
  std::map<std::string, double> late = shape;
  late["delay_s"] = 0.2;
  Neighbour crossing = {{0.2, 0, 0.4}, Eigen::Vector3d::Zero(), {1, 0, 0}, kFlowMass_kg, 0};
  Instant now = hovering();
  now.neighbours = &crossing;
  now.num_neighbours = 1;
  const double of_late = flow_force("wake_delay", late, now).z();
  EXPECT_NEAR(of_late, -0.1 * 0.3 / 0.4, 1e-9) << "0.2 s ago it was straight above";
  EXPECT_NEAR(flow_force("wake_delay", shape, now).z(), flow_force("downwash", shape, now).z(), 1e-12);
  crossing.dp_W_m.x() = 0;
  EXPECT_NEAR(flow_force("downwash", shape, now).z(), of_late, 1e-9);
}

TEST(WakeDelay, DriftsWithTheWindForAsLongAsItTakesToArrive) {
  std::map<std::string, double> shape = {{"amplitude_N", 0.1},
                                         {"decay_exponent", 1},
                                         {"spread_m", 0.05},
                                         {"spread_slope", 0.1},
                                         {"delay_s", 0.2}};
  Neighbour crossing = {{-0.1, 0.3, 0.4}, Eigen::Vector3d::Zero(), {1, 0, 0}, kFlowMass_kg, 0};
  Instant now = hovering();
  now.neighbours = &crossing;
  now.num_neighbours = 1;
  const double far_off = flow_force("wake_delay", shape, now).z();
  EXPECT_GT(far_off, -0.001) << "0.2 s ago it was at (-0.3, 0.3) m";
  shape["wind_x_m_s"] = 1.5;
  shape["wind_y_m_s"] = -1.5;
  EXPECT_NEAR(flow_force("wake_delay", shape, now).z(), -0.1 * 0.3 / 0.4, 1e-9) << "blown to (0, 0)";
  shape["delay_s"] = 0;
  EXPECT_NEAR(
      flow_force("wake_delay", shape, now).z(),
      flow_force("downwash",
                 {{"amplitude_N", 0.1}, {"decay_exponent", 1}, {"spread_m", 0.05}, {"spread_slope", 0.1}},
                 now)
          .z(),
      1e-12)
      << "no wind moves what arrives at once";
}

TEST(Tether, PullsTowardsTheAnchorWhereItIsTaut) {
  const std::map<std::string, double> parameters = {
      {"stiffness_N_m", 0.2}, {"anchor_x_m", 1}, {"anchor_z_m", 0.5}, {"slack_m", 0.5}};
  Instant now = hovering();
  now.p_W_m = {1, 0.4, 0.5};
  EXPECT_EQ(flow_force("tether", parameters, now).norm(), 0);
  now.p_W_m = {1, 0.8, 0.5};
  EXPECT_LT((flow_force("tether", parameters, now) - Eigen::Vector3d(0, -0.06, 0)).norm(), kFlowAccuracy_N);
  now.p_W_m = {1, 0, 0.5};
  EXPECT_EQ(flow_force("tether", parameters, now).norm(), 0) << "at the anchor itself";
}

}  // namespace
}  // namespace swarmcert::stability
