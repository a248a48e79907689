/// Effects that a user writes as formulas.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "nn/base/input_error.h"
#include "random_instant.h"
#include "stability/effects/registry.h"

namespace swarmcert::stability {
namespace {

using tests::RandomInstant;

const EffectContext kOneKind = {"small", {"small"}, ""};

TEST(ExpressionEffect, EqualsTheBuiltInEffectThatItSpells) {
  EffectSpec spelled;
  spelled.name = "my_drag";
  spelled.parameters = {{"D", 0.02}};
  spelled.expression.formulas = {
      {"force_x_N", "-D * vx"}, {"force_y_N", "-D * vy"}, {"force_z_N", "-D * vz"}};
  spelled.expression.linear = {"D"};
  EffectSpec built_in;
  built_in.name = "drag_linear";
  built_in.parameters = {{"drag_N_s_m", 0.02}};
  const AppliedEffect a(spelled, kOneKind), b(built_in, kOneKind);
  std::mt19937_64 random(9);
  for (int trial = 0; trial < 100; ++trial) {
    const RandomInstant state(random, 2);
    EXPECT_LT((a.wrench(state.now).force_W_N - b.wrench(state.now).force_W_N).norm(), 1e-15);
  }
}

TEST(ExpressionEffect, ACoefficientAtTheEndOfASumHasTheColumnOfTheWholeFormula) {
  const struct {
    const char* formula;
    double (*column)(double x, double z);
  } cases[] = {
      {"a * x + c", [](double, double) { return 1.0; }},
      {"a * max(x, z)  +  c ", [](double, double) { return 1.0; }},
      {"a * (x > z ? 1 : 0) + c", [](double, double) { return 1.0; }},
      {"x > z ? a * x : a * z + c", [](double x, double z) { return x > z ? 0.0 : 1.0; }},
      {"x > z ? a + c : a * z + c", [](double, double) { return 1.0; }},
      {"c * z + a * x + c", [](double, double z) { return z + 1; }},
      {"a * x - 2 * (z * a + c)", [](double, double) { return -2.0; }},
      {"a * x * + c", nullptr},
  };
  std::mt19937_64 random(13);
  for (const auto& one : cases) {
    EffectSpec spec;
    spec.name = "mine";
    spec.parameters = {{"a", 2.0}, {"c", 3.0}};
    spec.expression.formulas = {{"force_z_N", one.formula}};
    spec.expression.linear = {"a", "c"};
    if (one.column == nullptr) {
      EXPECT_THROW(make_effect(spec, kOneKind), files::InputError) << one.formula;
      continue;
    }
    const std::unique_ptr<Effect> effect = make_effect(spec, kOneKind);
    for (int trial = 0; trial < 20; ++trial) {
      const RandomInstant state(random, 0);
      Wrench columns[2];
      effect->columns(state.now, nullptr, columns);
      const Eigen::Vector3d& p_m = state.now.p_W_m;
      EXPECT_NEAR(columns[1].force_W_N.z(), one.column(p_m.x(), p_m.z()), 1e-12) << one.formula;
    }
  }
}

TEST(ExpressionEffect, SumsOverNeighbours) {
  EffectSpec spec;
  spec.name = "mine";
  spec.parameters = {{"a", 2.0}};
  spec.expression.formulas = {{"force_z_N", "-a * (dz > 0 ? exp(-(dx^2 + dy^2)) * mj : 0)"}};
  spec.expression.linear = {"a"};
  spec.expression.per_neighbour = true;
  const AppliedEffect effect(spec, kOneKind);
  std::mt19937_64 random(11);
  const RandomInstant state(random, 5);
  double expected = 0;
  for (const Neighbour& n : state.neighbours) {
    if (n.dp_W_m.z() > 0) expected -= 2 * std::exp(-n.dp_W_m.head<2>().squaredNorm()) * n.mass_kg;
  }
  EXPECT_NE(expected, 0);
  EXPECT_NEAR(effect.wrench(state.now).force_W_N.z(), expected, 1e-15);
}

}  // namespace
}  // namespace swarmcert::stability
