#include "stability/simulation/pilot.h"

#include "stability/bounds/flown_loop.h"

namespace swarmcert::stability {
namespace {

/// The moments of inertia for which the public attitude gains were tuned.
constexpr double kPublishedInertia_kg_m2[3] = {16.571710e-6, 16.655602e-6, 29.261652e-6};

template <typename Scalar>
controller::Vector3<Scalar> vector(const PerAxis& v) {
  return {static_cast<Scalar>(v[0]), static_cast<Scalar>(v[1]), static_cast<Scalar>(v[2])};
}

template <typename Scalar>
controller::Vector3<Scalar> vector(const controller::Vector3<double>& v) {
  return vector<Scalar>(PerAxis{v.x, v.y, v.z});
}

template <typename Scalar>
controller::Matrix3<Scalar> matrix(const Matrix3& m) {
  return {vector<Scalar>(m.x), vector<Scalar>(m.y), vector<Scalar>(m.z)};
}

/// Fills in all settings except the position gains.
template <typename Scalar, typename Position>
void fill(const Gains& gains, const Model& model, double attitude_step_s,
          controller::FlightSettings<Scalar, Position>* settings) {
  refuse_other_rotors(model, "the controller's mixing");
  settings->mass_kg = static_cast<Scalar>(model.mass_kg);
  settings->inertia_kg_m2 = diagonal(vector<Scalar>(model.inertia_kg_m2));
  const double step_s = attitude_step_s > 0 ? gains.integrator_step_s : 0;
  settings->integrator = {vector<Scalar>(gains.integrator_limit_m_s), static_cast<Scalar>(step_s)};
  settings->attitude_law = gains.attitude_law;
  PerAxis scale;
  for (std::size_t i = 0; i < 3; ++i) scale[i] = model.inertia_kg_m2[i] / kPublishedInertia_kg_m2[i];
  const auto scaled = [&scale](double xy, double z) {
    return vector<Scalar>(PerAxis{xy * scale[0], xy * scale[1], z * scale[2]});
  };
  settings->lee = {scaled(7e-3, 8e-3), scaled(1.15e-3, 2e-3)};
  settings->robust = {vector<Scalar>(PerAxis{10, 10, 4}), scaled(2e-3, 1e-3), scaled(2e-3, 4e-3),
                      vector<Scalar>(PerAxis{2, 2, 2})};
  settings->attitude_step_s = static_cast<Scalar>(attitude_step_s);
  settings->allocation = allocation(controller::crazyflie_rotors(
      static_cast<Scalar>(model.arm_m), static_cast<Scalar>(model.torque_per_thrust_m)));
  const ThrustMap& map = model.thrust;
  settings->thrust_map = {static_cast<Scalar>(map.c00), static_cast<Scalar>(map.c10),
                          static_cast<Scalar>(map.c01), static_cast<Scalar>(map.c20),
                          static_cast<Scalar>(map.c11)};
  // The map at p = 1 is linear in v.
  settings->largest_force = {static_cast<Scalar>(map.c00 + map.c10 + map.c20), Scalar(0),
                             static_cast<Scalar>(map.c01 + map.c11), Scalar(0), Scalar(1e6)};
  settings->idle_force_N = static_cast<Scalar>(least_rotor_force_N(map));
}

}  // namespace

template <typename Scalar>
Pilot<Scalar>::Pilot(const Gains& gains, const Model& model, double attitude_step_s) {
  if (gains.composite) {
    Settings<controller::CompositeGains<Scalar>> settings;
    settings.position = {matrix<Scalar>(gains.composite->Lambda_1_s),
                         matrix<Scalar>(gains.composite->K_kg_s)};
    fill(gains, model, attitude_step_s, &settings);
    settings_ = settings;
  } else {
    Settings<controller::PidGains<Scalar>> settings;
    settings.position = {vector<Scalar>(gains.pid->Kp_1_s2), vector<Scalar>(gains.pid->Kd_1_s),
                         vector<Scalar>(gains.pid->Ki_1_s3)};
    fill(gains, model, attitude_step_s, &settings);
    settings_ = settings;
  }
}

template <typename Scalar>
controller::FlightCommand<Scalar> Pilot<Scalar>::step(
    controller::FlightMemory<Scalar>& memory, const controller::Measured<Scalar>& measured,
    const controller::FlightReference<Scalar>& reference, Scalar prediction_N, std::uint32_t now_ms,
    bool position_is_due, const controller::Vector3<Scalar>& torque_prediction_Nm) const {
  const controller::Vector3<Scalar> effect = {Scalar(0), Scalar(0), prediction_N};
  return std::visit(
      [&](const auto& settings) {
        return controller::flight_step(settings, memory, measured, reference, effect, now_ms, position_is_due,
                                       torque_prediction_Nm);
      },
      settings_);
}

// Flattened, so that unused results are not computed.
template <typename Scalar>
[[gnu::flatten]] typename Pilot<Scalar>::Push Pilot<Scalar>::push(
    controller::FlightMemory<Scalar>& memory, const controller::Measured<Scalar>& measured,
    const controller::FlightReference<Scalar>& reference, Scalar prediction_N, std::uint32_t now_ms,
    bool position_is_due, const controller::Vector3<Scalar>& torque_prediction_Nm) const {
  const auto with = [&](const auto& settings) -> Push {
    const Scalar mean_p = memory.mean_p;
    const controller::FlightCommand<Scalar> command =
        controller::flight_step(settings, memory, measured, reference, {Scalar(0), Scalar(0), prediction_N},
                                now_ms, position_is_due, torque_prediction_Nm);
    memory.mean_p = mean_p;  // irrelevant, since no pilot's largest force depends on it
    return {command.faults, command.motors_off, command.wanted, command.mixed.forces};
  };
  if (const auto* const pid = std::get_if<0>(&settings_)) return with(*pid);
  return with(*std::get_if<1>(&settings_));
}

template <typename Scalar>
[[gnu::flatten]] Scalar Pilot<Scalar>::wanted_thrust_N(controller::FlightMemory<Scalar> memory,
                                                       const controller::Measured<Scalar>& measured,
                                                       const controller::FlightReference<Scalar>& reference,
                                                       Scalar prediction_N) const {
  const auto with = [&](const auto& settings) {
    return controller::flight_step(settings, memory, measured, reference,
                                   {Scalar(0), Scalar(0), prediction_N}, 0, true)
        .wanted.thrust_N;
  };
  if (const auto* const pid = std::get_if<0>(&settings_)) return with(*pid);
  return with(*std::get_if<1>(&settings_));
}

template <typename Scalar>
controller::Vector3<Scalar> Pilot<Scalar>::rate_error(const controller::FlightMemory<Scalar>& memory,
                                                      const controller::Measured<Scalar>& measured) const {
  return std::visit(
      [&](const auto& settings) -> controller::Vector3<Scalar> {
        if (settings.attitude_law == AttitudeLaw::kLee) return {};
        const auto error =
            attitude_error(measured.attitude, controller::AttitudeReference<Scalar>{memory.R_WR, {}, {}});
        return measured.attitude.omega_B_rad_s -
               reference_rate(settings.robust.Lambda_1_s, controller::modified_rodrigues(error.R_RB), error)
                   .omega_r_rad_s;
      },
      settings_);
}

template class Pilot<float>;
template class Pilot<double>;
template class Pilot<Lanes>;

}  // namespace swarmcert::stability
