/// @file Effects that the user writes as formulas in the model file, read by the library muParser.
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
/// Shape parameters (width_m) are fitted as well: over `grid` where one is given, else around their value, unless that
/// is zero or their bounds are equal.
/// Formulas: force_x_N, force_y_N, force_z_N in the world; force_b1_N, force_b2_N and force_b3_N along the axes of the
/// body (b3: of the thrust); torque_x_Nm .. torque_z_Nm in the body. Each is linear in the parameters listed under
/// `linear`, without a constant part: checked when read. Variables: position x y z, velocity vx vy vz (world); b3x b3y
/// b3z; body rates wx wy wz; thrust T; battery V; mass m; g; time t (or `time`); V (or `battery`); heading and tilt in
/// radians; speed; climb, the velocity along the thrust axis; vbx vby, the velocity along the other axes of the body.
/// With per_neighbour = true the formulas are summed over the neighbours, with dx dy dz, dvx dvy dvz (neighbour minus
/// own) and mj, the neighbour's mass.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

class ExpressionEffect : public Effect {
 public:
  /// @param path of the model file, for messages.
  /// @throws files::InputError if a formula cannot be read, uses an unknown name, or is not linear where it says so.
  ExpressionEffect(const EffectSpec& spec, const std::string& path);
  ~ExpressionEffect() override;
  /// @throws files::InputError if a formula gives a number that is not finite; the message says where.
  void columns(const Instant& now, const double* shape, Wrench* columns) const override;
  double reach_m(double dz_m, const double* shape) const override;

 private:
  struct Formulas;
  std::unique_ptr<Formulas> formulas_;
};

}  // namespace swarmcert::stability
