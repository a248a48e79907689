/// @file Effects that the user writes as formulas in the model file, parsed by muParser.
///
///   [[effect]]
///   name = "floor_dip"
///   parameters = { a = -0.01, width_m = 0.05 }
///   [effect.expression]
///   force_b3_N = "a * T * exp(-((z - 0.18) / width_m)^2 / 2)"
///   linear = ["a"]
///   bounds = { a = [-0.05, 0] }
///   grid = { width_m = [0.03, 0.05, 0.08] }
///
/// Shape parameters (width_m) are fitted as well: over `grid` if given, else around their value, unless that is zero or
/// their bounds are equal.
/// Formulas: force_x_N, force_y_N, force_z_N in the world; force_b1_N, force_b2_N and force_b3_N along the body axes
/// (b3 is the thrust axis); torque_x_Nm .. torque_z_Nm in the body frame. Each must be linear in the parameters listed
/// under `linear`, without a constant term; this is checked on reading. Variables: position x y z, velocity vx vy vz
/// (world); b3x b3y b3z; body rates wx wy wz; thrust T; battery voltage V (or `battery`); mass m; g; time t (or
/// `time`); heading and tilt in radians; speed; climb, the velocity along the thrust axis; vbx vby, the velocity along
/// the other body axes. With per_neighbour = true the formulas are summed over the neighbours, with dx dy dz, dvx dvy
/// dvz (neighbour minus own) and mj, the neighbour's mass.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class ExpressionEffect : public Effect {
 public:
  /// @param path model file, for messages.
  /// @throws files::InputError if a formula cannot be parsed, uses an unknown name, or is not linear in the parameters
  ///     listed as such.
  ExpressionEffect(const EffectSpec& spec, const std::string& path);
  ~ExpressionEffect() override;
  /// @throws files::InputError if a formula evaluates to a non-finite number; the message says where.
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  double reach_m(double dz_m, const double* shape) const override;

 private:
  struct Formulas;
  std::unique_ptr<Formulas> formulas_;
};

}  // namespace swarmcert::stability
