#include "stability/control_law.h"

namespace swarmcert::stability {
namespace {

/// The moment of inertia for which the public attitude gains were tuned.
constexpr double kPublishedInertia_kg_m2[3] = {16.571710e-6, 16.655602e-6, 29.261652e-6};

template <typename Scalar>
controller::Vector3<Scalar> vector(const PerAxis& values) {
  return {static_cast<Scalar>(values[0]), static_cast<Scalar>(values[1]), static_cast<Scalar>(values[2])};
}

template <typename Scalar>
controller::Matrix3<Scalar> matrix(const Matrix3& m) {
  return {vector<Scalar>({m[0], m[1], m[2]}), vector<Scalar>({m[3], m[4], m[5]}),
          vector<Scalar>({m[6], m[7], m[8]})};
}

}  // namespace

template <typename Scalar>
ControlLaw<Scalar>::ControlLaw(const Gains& gains, const Model& model) {
  is_composite_ = gains.composite.has_value();
  is_robust_ = gains.attitude_law == AttitudeLaw::kRobust;
  mass_kg_ = static_cast<Scalar>(model.mass_kg);
  if (is_composite_) {
    composite_ = {matrix<Scalar>(gains.composite->Lambda), matrix<Scalar>(gains.composite->K)};
  } else {
    pid_ = {vector<Scalar>(gains.pid->Kp), vector<Scalar>(gains.pid->Kd), vector<Scalar>(gains.pid->Ki)};
  }
  integrator_ = {vector<Scalar>(gains.integrator_limit_m_s), static_cast<Scalar>(gains.integrator_step_s)};
  PerAxis scale;
  for (std::size_t i = 0; i < 3; ++i) scale[i] = model.inertia_kg_m2[i] / kPublishedInertia_kg_m2[i];
  const auto scaled = [&scale](double xy, double z) {
    return vector<Scalar>({xy * scale[0], xy * scale[1], z * scale[2]});
  };
  lee_ = {scaled(7e-3, 8e-3), scaled(1.15e-3, 2e-3)};
  robust_ = {vector<Scalar>({10, 10, 4}), scaled(2e-3, 1e-3), scaled(2e-3, 4e-3), vector<Scalar>({2, 2, 2})};
  inertia_kg_m2_ = diagonal(vector<Scalar>(model.inertia_kg_m2));
  allocation_ = allocation(controller::crazyflie_rotors(static_cast<Scalar>(model.arm_m),
                                                        static_cast<Scalar>(model.torque_per_thrust_m)));
}

template <typename Scalar>
typename ControlLaw<Scalar>::Output ControlLaw<Scalar>::rotors(
    const Vector& force_W_N, const Matrix& R_WB, const Vector& omega_B_rad_s, const Matrix& fallback_WR,
    const Vector& rate_integral_rad, const controller::ForceLimits<Scalar>& limits) const {
  const auto attitude = desired_attitude(force_W_N, controller::Heading<Scalar>{}, fallback_WR,
                                         static_cast<Scalar>(0.05 * kGravity_m_s2) * mass_kg_);
  Output output;
  output.R_WR = attitude.R_WR;
  // The desired frame's own rate is not fed forward, as in public firmware.
  const controller::AttitudeState<Scalar> state{R_WB, omega_B_rad_s};
  const auto error = attitude_error(state, controller::AttitudeReference<Scalar>{attitude.R_WR, {}, {}});
  if (is_robust_) {
    const auto rate = reference_rate(robust_.Lambda_1_s, controller::modified_rodrigues(error.R_RB), error);
    output.rate_error_B_rad_s = omega_B_rad_s - rate.omega_r_rad_s;
    output.torque_B_N_m = robust_torque(robust_, inertia_kg_m2_, omega_B_rad_s, rate, rate_integral_rad);
  } else {
    output.rate_error_B_rad_s = {};
    output.torque_B_N_m = lee_torque(lee_, inertia_kg_m2_, state, error);
  }
  output.thrust_N = collective_thrust(controller::ThrustRule::kProjected, force_W_N, R_WB);
  output.mixed = mix(allocation_, limits, controller::Wrench<Scalar>{output.thrust_N, output.torque_B_N_m});
  return output;
}

template class ControlLaw<float>;
template class ControlLaw<double>;

}  // namespace swarmcert::stability
