#include "analysis/residuals/torque_residual.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "analysis/residuals/thrust_stage.h"
#include "analysis/residuals/torque_blocks.h"
#include "stability/effects/registry.h"

namespace swarmcert::residuals {
namespace {

/// Returns why the log does not give the force of each of the model's rotors; empty if it does.
std::string why_no_rotor_forces(const stability::Model& model, const Track& track) {
  const bool by_duty = track.thrust_source == logs::ThrustSource::kDuty;
  const std::size_t motors = by_duty ? 4 : static_cast<std::size_t>(track.motor_commands);
  if (motors == 0) return "the log has neither duty nor command of each motor";
  if (motors == model.num_rotors()) return "";
  return fmt::format("the log has {} motors and the model {} rotors", motors, model.num_rotors());
}

/// Returns the torque of the rotors at `record`. Precondition: has_rotor_forces().
Eigen::Vector3d rotor_torque_Nm(const stability::Model& model,
                                const std::vector<stability::RotorPlace>& rotors, const Track& track,
                                std::size_t record) {
  const RotorForces force_N = rotor_forces_N(model, track, record);
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < rotors.size(); ++k)
    torque += force_N[k] *
              Eigen::Vector3d(rotors[k].y_m, -rotors[k].x_m, rotors[k].yaw_m(model.torque_per_thrust_m));
  return torque;
}

/// Adds the torque of `spec` to `torque`, whose values it sees as the torque so far.
void add_effect(const stability::EffectSpec& spec, const stability::Model& model, const Kinds& kinds,
                const Track& track, std::vector<Eigen::Vector3d>& torque) {
  const stability::AppliedEffect effect(spec, {model.kind, kinds.names, model.path});
  const auto stream = effect.effect().stream(effect.shape().data());
  std::vector<stability::Wrench> columns(effect.coefficients().size());
  for (std::size_t i = 0; i < torque.size(); ++i) {
    stability::Instant now = track.instants[i];
    now.torque_B_Nm = torque[i];
    if (track.restarts[i] != 0) stream->restart();
    stream->advance(now, columns.data());
    for (std::size_t c = 0; c < columns.size(); ++c)
      torque[i] += effect.coefficients()[c] * columns[c].torque_B_Nm;
  }
}

/// Returns the torque of the rotors, after the model's motor lag, and of its effects.
std::vector<Eigen::Vector3d> modelled_torque_B_Nm(const stability::Model& model, const Kinds& kinds,
                                                  const Track& track) {
  std::vector<Eigen::Vector3d> torque = rotor_torques(model, kinds, track);
  for (const stability::EffectSpec& spec : model.effects) {
    if (!is_thrust_stage(spec.name) && spec.acts_on(track.vehicle))
      add_effect(spec, model, kinds, track, torque);
  }
  return torque;
}

}  // namespace

bool has_rotor_forces(const stability::Model& model, const Track& track) {
  return why_no_rotor_forces(model, track).empty();
}

RotorForces rotor_forces_N(const stability::Model& model, const Track& track, std::size_t record) {
  const bool by_duty = track.thrust_source == logs::ThrustSource::kDuty;
  const double battery_V = track.instants[record].battery_V;
  const std::size_t rotors = model.num_rotors();
  double shares = 0;
  const auto share = [&](std::size_t k) {
    return std::pow(track.motor_command[record][k], track.motor_power);
  };
  for (std::size_t k = 0; k < rotors && !by_duty; ++k) shares += share(k);
  RotorForces force_N{};
  for (std::size_t k = 0; k < rotors; ++k) {
    if (by_duty)
      force_N[k] = model.thrust.force_N(track.duty[record][k], battery_V);
    else if (model.thrust_curve_N)
      force_N[k] = model.thrust.force_N(track.motor_command[record][k], battery_V);
    else if (shares > 0)
      force_N[k] = track.given_thrust[record] * model.weight_N() * share(k) / shares;
  }
  return force_N;
}

std::vector<Eigen::Vector3d> rotor_torques(const stability::Model& model, const Kinds& kinds,
                                           const Track& track) {
  if (!why_no_rotor_forces(model, track).empty()) return {};
  std::vector<Eigen::Vector3d> torque(track.instants.size());
  const std::vector<stability::RotorPlace> rotors = rotor_places(model);
  for (std::size_t i = 0; i < torque.size(); ++i) torque[i] = rotor_torque_Nm(model, rotors, track, i);
  for (const stability::EffectSpec& spec : model.effects) {
    if (spec.name == "motor_lag") add_effect(spec, model, kinds, track, torque);
  }
  return torque;
}

std::vector<Eigen::Vector3d> torque_records(const stability::Model& model, const Kinds& kinds,
                                            const Track& track) {
  const std::size_t n = track.instants.size();
  if (!track.has_rates || !why_no_rotor_forces(model, track).empty()) return {};
  const std::vector<Eigen::Vector3d> modelled = modelled_torque_B_Nm(model, kinds, track);
  const Eigen::Vector3d inertia(model.inertia_kg_m2[0], model.inertia_kg_m2[1], model.inertia_kg_m2[2]);
  std::vector<Eigen::Vector3d> torque_B_Nm(
      n, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  for (std::size_t i = 1; i + 1 < n; ++i) {
    if (track.restarts[i] != 0 || track.restarts[i + 1] != 0) continue;
    const stability::Instant &before = track.instants[i - 1], &now = track.instants[i],
                             &after = track.instants[i + 1];
    const Eigen::Vector3d slope =
        (after.omega_B_rad_s - before.omega_B_rad_s) / (after.time_s - before.time_s);
    const Eigen::Vector3d momentum = inertia.cwiseProduct(now.omega_B_rad_s);
    torque_B_Nm[i] = inertia.cwiseProduct(slope) + now.omega_B_rad_s.cross(momentum) -
                     (modelled[i - 1] + 2 * modelled[i] + modelled[i + 1]) / 4;
  }
  return torque_B_Nm;
}

TorqueResidual torque_residual(const stability::Model& model, const Kinds& kinds, const Track& track) {
  TorqueResidual residual;
  const std::size_t n = track.instants.size();
  residual.refused = why_no_rotor_forces(model, track);
  if (!residual.refused.empty()) return residual;
  if (!track.has_rates || n < 3) {
    residual.refused = n < 3 ? "the log is empty" : "the log has no angular rates";
    return residual;
  }
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < n; ++i)
    steps_s.push_back(track.instants[i].time_s - track.instants[i - 1].time_s);
  residual.rate_hz = 1 / quantile(steps_s, 0.5);
  if (residual.rate_hz < TorqueResidual::kLeastRate_hz) {
    residual.refused = fmt::format("logs at {:.0f} Hz alias the attitude loop: torques need {:.0f} Hz",
                                   residual.rate_hz, TorqueResidual::kLeastRate_hz);
    return residual;
  }
  residual.torque_B_Nm = torque_records(model, kinds, track);
  return residual;
}

std::vector<TorqueBlock> torque_blocks(const stability::Model& model, const Kinds& kinds, const Track& track,
                                       double duration_s) {
  std::vector<TorqueBlock> blocks;
  if (!why_no_rotor_forces(model, track).empty()) return blocks;
  const std::vector<Eigen::Vector3d> modelled = modelled_torque_B_Nm(model, kinds, track);
  const Eigen::Vector3d inertia(model.inertia_kg_m2[0], model.inertia_kg_m2[1], model.inertia_kg_m2[2]);
  TorqueBlock sum;
  std::size_t first = 0, count = 0;
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const stability::Instant& now = track.instants[i];
    if (track.cut[i] != Cut::kNone || track.restarts[i] != 0) {
      sum = {};
      count = 0;
      continue;
    }
    if (count == 0) first = i;
    const Eigen::Vector3d momentum = inertia.cwiseProduct(now.omega_B_rad_s);
    sum.thrust_N += now.thrust_N;
    sum.torque_B_Nm -= modelled[i];
    if (track.has_rates) sum.torque_B_Nm += now.omega_B_rad_s.cross(momentum);
    ++count;
    const double length_s = now.time_s - track.instants[first].time_s;
    if (length_s < duration_s) continue;
    sum.thrust_N /= static_cast<double>(count);
    sum.torque_B_Nm /= static_cast<double>(count);
    if (track.has_rates)
      sum.torque_B_Nm +=
          inertia.cwiseProduct(now.omega_B_rad_s - track.instants[first].omega_B_rad_s) / length_s;
    blocks.push_back(sum);
    sum = {};
    count = 0;
  }
  return blocks;
}

namespace {

/// Adds the means over slow flight, where the torques of the rotors should cancel.
void add_mean(const stability::Model& model, const Track& track, TorqueErrors& errors) {
  if (!why_no_rotor_forces(model, track).empty()) return;
  const std::vector<stability::RotorPlace> rotors = rotor_places(model);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < track.instants.size(); ++i) {
    const stability::Instant& now = track.instants[i];
    if (track.cut[i] != Cut::kNone || now.v_W_m_s.norm() > TorqueErrors::kSlow_m_s) continue;
    sum -= rotor_torque_Nm(model, rotors, track, i);
    ++errors.slow_records;
  }
  if (errors.slow_records == 0) return;
  const Eigen::Vector3d mean = sum / static_cast<double>(errors.slow_records);
  errors.slow_mean_Nm = {mean[0], mean[1], mean[2], mean.norm()};
}

}  // namespace

TorqueErrors torque_errors(const stability::Model& model, const Kinds& kinds, const Track& track) {
  const TorqueResidual residual = torque_residual(model, kinds, track);
  TorqueErrors errors;
  errors.refused = residual.refused;
  errors.rate_hz = residual.rate_hz;
  Eigen::Vector4d squares = Eigen::Vector4d::Zero(), max = squares;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < residual.torque_B_Nm.size(); ++i) {
    const Eigen::Vector3d& torque = residual.torque_B_Nm[i];
    if (track.cut[i] != Cut::kNone || torque.hasNaN()) continue;
    const Eigen::Vector4d size(std::abs(torque[0]), std::abs(torque[1]), std::abs(torque[2]), torque.norm());
    squares += size.cwiseAbs2();
    max = max.cwiseMax(size);
    sum += torque;
    ++errors.records;
  }
  add_mean(model, track, errors);
  if (!errors.refused.empty()) return errors;
  if (errors.records == 0) {
    errors.refused = "no usable record";
    return errors;
  }
  const auto count = static_cast<double>(errors.records);
  const Eigen::Vector4d rms = (squares / count).cwiseSqrt();
  const Eigen::Vector3d mean = sum / count;
  errors.rmse_Nm = {rms[0], rms[1], rms[2], rms[3]};
  errors.bias_Nm = {mean[0], mean[1], mean[2], mean.norm()};
  errors.max_Nm = {max[0], max[1], max[2], max[3]};
  return errors;
}

}  // namespace swarmcert::residuals
