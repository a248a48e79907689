#include "analysis/residuals/torque_residual.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <cmath>

#include "stability/effects/registry.h"

namespace swarmcert::residuals {
namespace {

/// Rotors: front right, back right, back left, front left; the first turns the body clockwise seen from above.
Eigen::Vector3d rotor_torque_Nm(const stability::Model& model, const std::array<double, 4>& duty,
                                double battery_V) {
  double f[4];
  for (std::size_t r = 0; r < 4; ++r) f[r] = model.thrust.force_N(duty[r], battery_V);
  const double offset_m = model.arm_m * std::sqrt(0.5);
  return {offset_m * (f[2] + f[3] - f[0] - f[1]), offset_m * (f[1] + f[2] - f[0] - f[3]),
          model.torque_per_thrust_m * (f[1] + f[3] - f[0] - f[2])};
}

std::vector<Eigen::Vector3d> applied_torque_Nm(const stability::Model& model, const Track& track) {
  std::vector<Eigen::Vector3d> torque(track.instants.size());
  for (std::size_t i = 0; i < torque.size(); ++i)
    torque[i] = rotor_torque_Nm(model, track.duty[i], track.instants[i].battery_V);
  for (const stability::EffectSpec& spec : model.effects) {
    if (spec.name != "motor_lag") continue;
    const stability::AppliedEffect lag(spec, {});
    const auto stream = lag.effect().stream(lag.shape().data());
    for (std::size_t i = 0; i < torque.size(); ++i) {
      stability::Instant now = track.instants[i];
      now.torque_B_Nm = torque[i];
      if (track.restarts[i] != 0) stream->restart();
      stability::Wrench change;
      stream->advance(now, &change);
      torque[i] += lag.coefficients()[0] * change.torque_B_Nm;
    }
  }
  return torque;
}

}  // namespace

TorqueErrors torque_errors(const stability::Model& model, const Track& track) {
  TorqueErrors errors;
  const std::size_t n = track.instants.size();
  if (!track.has_rates || n < 3) {
    errors.refused = n < 3 ? "the log is empty" : "the log has no angular rates";
    return errors;
  }
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < n; ++i)
    steps_s.push_back(track.instants[i].time_s - track.instants[i - 1].time_s);
  errors.rate_hz = 1 / quantile(steps_s, 0.5);
  if (errors.rate_hz < TorqueErrors::kLeastRate_hz) {
    errors.refused = fmt::format("logs at {:.0f} Hz of a loop at 500 Hz alias", errors.rate_hz);
    return errors;
  }
  const std::vector<Eigen::Vector3d> applied = applied_torque_Nm(model, track);
  const Eigen::Vector3d inertia(model.inertia_kg_m2[0], model.inertia_kg_m2[1], model.inertia_kg_m2[2]);
  Eigen::Vector4d squares = Eigen::Vector4d::Zero(), max = squares;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < n; ++i) {
    if (track.cut[i] != Cut::kNone || track.restarts[i] != 0 || track.restarts[i + 1] != 0) continue;
    const stability::Instant &before = track.instants[i - 1], &now = track.instants[i],
                             &after = track.instants[i + 1];
    const Eigen::Vector3d slope =
        (after.omega_B_rad_s - before.omega_B_rad_s) / (after.time_s - before.time_s);
    const Eigen::Vector3d momentum = inertia.cwiseProduct(now.omega_B_rad_s);
    const Eigen::Vector3d torque = inertia.cwiseProduct(slope) + now.omega_B_rad_s.cross(momentum) -
                                   (applied[i - 1] + 2 * applied[i] + applied[i + 1]) / 4;
    const Eigen::Vector4d size(std::abs(torque[0]), std::abs(torque[1]), std::abs(torque[2]), torque.norm());
    squares += size.cwiseAbs2();
    max = max.cwiseMax(size);
    sum += torque;
    ++errors.records;
  }
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
