/// @file Bounds on the difference between the float control law used in flight and the analysed double one. Host only.
#pragma once

#include <string>

#include "controller/attitude_law.h"
#include "controller/desired_attitude.h"
#include "controller/position_law.h"

namespace swarmcert::controller {

/// The set of states and setpoints for which a bound holds. Magnitudes are per axis for vectors.
struct FlightEnvelope {
  double position_m = 10;   ///< |p| and |p_d|: positions are rounded to float before they are subtracted
  double velocity_m_s = 5;  ///< |p'| and |p_d'|
  double position_error_m = 1;
  double velocity_error_m_s = 3;
  double integral_m_s = 1;        ///< |I|; the integrator's limit if that is smaller
  double acceleration_m_s2 = 10;  ///< |p_d''|
  double effect_N = 0.2;          ///< |f_a_hat|
  double least_force_N = 0.1;     ///< minimum of |f_d|; below it the direction is meaningless
  double largest_force_N = 1.5;
  double tilt_rad = 1.0;  ///< angle of f_d from the vertical, below pi/2
  double attitude_error_rad =
      0.8;  ///< angle of R_RB; below 1.2 for the robust law, so that both take the same branch
  double rate_rad_s = 10;
  double reference_rate_rad_s = 5;
  double reference_rate_derivative_rad_s2 = 50;
};

/// The laws whose two instances are compared. Exactly one of `lee` and `robust` is used.
struct RoundedLaw {
  double mass_kg = 0;
  bool is_composite = false;
  CompositeGains<double> composite;
  PidGains<double> pid;
  Integrator<double> integrator;
  ThrustRule thrust_rule = ThrustRule::kProjected;
  bool is_robust = true;
  LeeGains<double> lee;
  RobustGains<double> robust;
  double attitude_step_s = 0.002;  ///< of the robust law's integral
  Matrix3<double> inertia_kg_m2;
};

/// Bounds on |float - double| over the whole envelope, for one evaluation of each law from the same state and
/// integrals, with every input rounded to float and the heading computed by heading_of_yaw() from a yaw within pi.
/// Given per world axis, or per body axis for torques.
struct RoundingBounds {
  bool applies = false;
  std::string why_not;  ///< empty if `applies`
  Vector3<double> force_N;
  double thrust_N = 0;
  Vector3<double> torque_N_m;
  /// Rounding error of one step of the integrals. Divided by the step, it acts like a constant error of the integrated
  /// quantity: a position error in m for the first, an angular rate in rad/s for the second.
  Vector3<double> integral_m_s;
  Vector3<double> rate_integral_rad;
};

/// Evaluates the templates used in flight on sets of inputs (bounded.h), in stages: f_d; thrust and desired attitude;
/// attitude error; torque. Between stages the sets are restricted to what geometry allows (unit vectors, rotations by
/// at most the envelope's angle). Cells of |f_d| and heading are evaluated separately, and the largest bound over all
/// cells is returned. Errors of the inputs are propagated through the desired attitude by its exact Lipschitz
/// constants, derived in the source.
RoundingBounds rounding_bounds(const RoundedLaw& law, const FlightEnvelope& envelope);

}  // namespace swarmcert::controller
