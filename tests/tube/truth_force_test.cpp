// Enclosures of declared truths compared with the effects in the simulator.
#include "analysis/tracking/tube/truth_force.h"

#include <gtest/gtest.h>

#include <cmath>

#include "stability/effects/effect.h"
#include "tube/scenes.h"

namespace swarmcert::analysis {
namespace {

using stability::AppliedEffect;
using stability::EffectSpec;
using stability::Instant;
using stability::Neighbour;
using tests::between;

stability::Model model_with(const std::string& name, const std::map<std::string, double>& parameters) {
  stability::Model model = tests::truth_model();
  EffectSpec spec;
  spec.name = name;
  spec.parameters = parameters;
  model.effects = {spec};
  return model;
}

double simulated(const stability::Model& model, const std::vector<Eigen::Vector3d>& offsets) {
  std::vector<Neighbour> neighbours;
  for (const Eigen::Vector3d& dp : offsets)
    neighbours.push_back({dp, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), model.mass_kg, 0});
  Instant now;
  now.mass_kg = model.mass_kg;
  now.neighbours = neighbours.data();
  now.num_neighbours = static_cast<int>(neighbours.size());
  double sum = 0;
  for (const EffectSpec& spec : model.effects)
    sum += AppliedEffect(spec, {model.kind, {model.kind}, model.path}).wrench(now).force_W_N.z();
  return sum;
}

/// All points of random boxes are inside the enclosure and inside the mean value form about the middle.
void expect_enclosed(const stability::Model& model, int neighbours, std::uint64_t seed) {
  const TruthForce truth(model, 0.6);
  ASSERT_EQ(truth.refusal(), "");
  files::Random random(seed);
  int strong = 0;
  int sloped = 0;
  for (int box = 0; box < 400; ++box) {
    const double width = std::pow(10, between(random, -4, -0.7));
    std::vector<Offset> set, middle;
    for (int n = 0; n < neighbours; ++n) {
      const Eigen::Vector3d centre(between(random, -0.12, 0.12), between(random, -0.12, 0.12),
                                   between(random, -0.6, 0.8));
      Offset offset, point;
      for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<std::size_t>(k);
        offset[at] = {centre[k] - width, centre[k] + width};
        point[at] = centre[k];
      }
      set.push_back(offset);
      middle.push_back(point);
    }
    const TruthForce::Wake wake = truth.wake(set);
    const TruthForce::Wake at_middle = truth.wake(middle);
    for (int i = 0; i < 20; ++i) {
      std::vector<Eigen::Vector3d> dp;
      Interval sloping = at_middle.value_N + Interval(-wake.cut_off_N, wake.cut_off_N);
      for (int n = 0; n < neighbours; ++n) {
        const auto j = static_cast<std::size_t>(n);
        Eigen::Vector3d p;
        for (int k = 0; k < 3; ++k) {
          const auto at = static_cast<std::size_t>(k);
          p[k] = i < 2 ? (i == 0 ? set[j][at].lower : set[j][at].upper)
                       : between(random, set[j][at].lower, set[j][at].upper);
          sloping += wake.gradient_N_m[j][at] * (Interval(p[k]) - middle[j][at]);
        }
        dp.push_back(p);
      }
      const double force = simulated(model, dp);
      strong += std::abs(force) > 0.01 ? 1 : 0;
      const double rounding = 1e-13 * (1 + std::abs(force));
      ASSERT_GE(force, wake.value_N.lower - rounding) << box;
      ASSERT_LE(force, wake.value_N.upper + rounding) << box;
      if (!wake.has_gradient) continue;
      ++sloped;
      ASSERT_GE(force, sloping.lower - rounding) << box;
      ASSERT_LE(force, sloping.upper + rounding) << box;
    }
  }
  EXPECT_GT(strong, 400) << "the boxes must meet the wake";
  EXPECT_GT(sloped, 4000);
}

TEST(TruthForce, DownwashOfOneNeighbourLiesInItsEnclosures) {
  expect_enclosed(model_with("downwash", {}), 1, 1);
  expect_enclosed(model_with("downwash", {{"decay_exponent", 1.7}, {"spread_slope", 0}}), 1, 2);
}

TEST(TruthForce, DownwashOfSeveralNeighboursLiesInItsEnclosuresForAnyNorm) {
  expect_enclosed(model_with("downwash", {}), 2, 3);
  expect_enclosed(model_with("downwash", {{"norm_exponent", 1}}), 3, 4);
  expect_enclosed(model_with("downwash", {{"norm_exponent", 2.5}, {"spread_m", 0.08}}), 3, 5);
}

TEST(TruthForce, LiftWithItsJumpLiesInItsEnclosures) {
  expect_enclosed(model_with("upper_lift", {{"amplitude_N", 0.1}, {"spread_m", 0.2}}), 2, 6);
}

TEST(TruthForce, EnclosuresShrinkToThePoint) {
  const TruthForce truth(model_with("downwash", {}), 0.6);
  const Offset point = {Interval(0.03), Interval(-0.02), Interval(0.3)};
  const TruthForce::Wake wake = truth.wake({point});
  EXPECT_LT(wake.value_N.upper - wake.value_N.lower, 1e-10);
  EXPECT_LT(wake.gradient_N_m[0][2].upper - wake.gradient_N_m[0][2].lower, 1e-12);
}

TEST(TruthForce, TheRestCoversDragGroundAndConstantForces) {
  stability::Model model = tests::truth_model();
  EffectSpec constant;
  constant.name = "constant_force";
  constant.parameters = {{"force_x_N", 0.01}, {"force_z_N", -0.02}};
  model.effects.push_back(constant);
  const TruthForce truth(model, 0.6);
  files::Random random(7);
  for (int i = 0; i < 200; ++i) {
    const std::array<Interval, 3> velocity = {Interval(-0.3, 0.1), Interval(0.2, 0.4), Interval(-0.1, 0.1)};
    const std::array<Interval, 3> rest_N = truth.rest_N({0.05, 0.6}, velocity);
    Instant now;
    now.mass_kg = model.mass_kg;
    now.thrust_N = between(random, 0, 0.6);
    now.p_W_m = {0, 0, between(random, 0.05, 0.6)};
    for (std::size_t k = 0; k < 3; ++k)
      now.v_W_m_s[static_cast<int>(k)] = between(random, velocity[k].lower, velocity[k].upper);
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (const EffectSpec& spec : model.effects) {
      if (spec.name == "motor_lag" || spec.name == "downwash") continue;
      force += AppliedEffect(spec, {model.kind, {model.kind}, model.path}).wrench(now).force_W_N;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_GE(force[static_cast<int>(k)], rest_N[k].lower - 1e-13);
      ASSERT_LE(force[static_cast<int>(k)], rest_N[k].upper + 1e-13);
    }
  }
}

TEST(TruthForce, EffectsWithoutEnclosureAreRefusedByName) {
  for (const auto& [name, parameters] : std::vector<std::pair<std::string, std::map<std::string, double>>>{
           {"downwash", {{"tail", 1}}},
           {"downwash", {{"convection_s_m", 0.1}}},
           {"thrust_ratio", {}},
           {"battery", {}}}) {
    EXPECT_NE(TruthForce(model_with(name, parameters), 0.6).refusal().find(name), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace swarmcert::analysis
