#include "stability/swarm.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace swarmcert::stability {

struct Swarm::Kind {
  double mass_kg = 0, inverse_mass_1_kg = 0, offset_m = 0, yaw_m = 0;
  double lag_rate_1_s = 0, lag_share = 0;  ///< 1 / tau and gain of the motor lag, 0 without
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero(), inverse_inertia = Eigen::Vector3d::Zero();
  SignalPath path;
  std::vector<AppliedEffect> effects;      ///< without those that live in `path`
  std::vector<const AppliedEffect*> wide;  ///< that look at neighbours
};

void Swarm::set_lag(Kind* kind) {
  kind->lag_rate_1_s = kind->path.motor_lag_s > 0 ? 1 / kind->path.motor_lag_s : 0;
  kind->lag_share = kind->path.motor_lag_s > 0 ? kind->path.motor_lag_gain : 0;
}

namespace {

using Vector3Map = Eigen::Map<const Eigen::Vector3d>;

/// Largest horizontal distance at which a neighbour that is `dz_m` higher does something.
double reach_m(const std::vector<const AppliedEffect*>& effects, double dz_m) {
  double reach = 0;
  for (const AppliedEffect* applied : effects) {
    reach = std::max(reach, applied->effect().reach_m(dz_m, applied->shape().data()));
  }
  return reach;
}

}  // namespace

Swarm::Swarm(std::vector<Model> models, std::vector<int> kind_of)
    : models_(std::move(models)), kind_of_(std::move(kind_of)) {
  std::vector<std::string> names;
  for (const Model& model : models_) names.push_back(model.kind);
  for (const int kind : kind_of_) {
    if (kind < 0 || kind >= static_cast<int>(models_.size())) {
      throw std::invalid_argument("Swarm: kind " + std::to_string(kind) + " has no model");
    }
  }
  kinds_.resize(models_.size());
  for (std::size_t i = 0; i < models_.size(); ++i) {
    const Model& model = models_[i];
    Kind& kind = kinds_[i];
    kind.mass_kg = model.mass_kg;
    kind.inverse_mass_1_kg = 1 / model.mass_kg;
    kind.offset_m = model.arm_m * std::sqrt(0.5);
    kind.yaw_m = model.torque_per_thrust_m;
    kind.inertia = Vector3Map(model.inertia_kg_m2.data());
    kind.inverse_inertia = kind.inertia.cwiseInverse();
    for (const EffectSpec& spec : model.effects) {
      AppliedEffect applied(spec, {model.kind, names, model.path});
      if (applied.effect().info().remembers) {
        applied.effect().add_to(kind.path, applied.coefficients().data(), applied.shape().data());
      } else {
        kind.effects.push_back(std::move(applied));
      }
    }
    for (const AppliedEffect& applied : kind.effects) {
      if (applied.effect().info().needs_neighbours) kind.wide.push_back(&applied);
    }
    interacts_ = interacts_ || !kind.wide.empty();
    set_lag(&kind);
  }
  near_.resize(kind_of_.size());
  neighbours_.resize(kind_of_.size());
}

Swarm::Swarm(Model model, int vehicles)
    : Swarm(std::vector<Model>{std::move(model)}, std::vector<int>(static_cast<std::size_t>(vehicles), 0)) {}

Swarm::~Swarm() = default;

const SignalPath& Swarm::path(int vehicle) const {
  return kinds_[static_cast<std::size_t>(kind_of(vehicle))].path;
}

void Swarm::assume_lag(double motor_lag_s, double delay_s) {
  for (Kind& kind : kinds_) {
    if (kind.path.motor_lag_s == 0 && motor_lag_s > 0) {
      kind.path.motor_lag_s = motor_lag_s;
      kind.path.motor_lag_gain = 1;
    }
    if (kind.path.delay_s == 0 && delay_s > 0) {
      kind.path.delay_s = delay_s;
      kind.path.delay_gain = 1;
    }
    set_lag(&kind);
  }
}

inline void Swarm::rotor_wrench(const Kind& kind, const double* x, const VehicleInput& input,
                                double* thrust_N, Eigen::Vector3d* torque_B_Nm) const {
  double f[kNumRotors];
  for (int r = 0; r < kNumRotors; ++r) {
    f[r] = input.rotor_command_N[r] + kind.lag_share * (x[kRotors + r] - input.rotor_command_N[r]);
  }
  // Rotors: front right, back right, back left, front left; the first turns the body clockwise seen from above.
  *thrust_N = f[0] + f[1] + f[2] + f[3];
  *torque_B_Nm = {kind.offset_m * (f[2] + f[3] - f[0] - f[1]), kind.offset_m * (f[1] + f[2] - f[0] - f[3]),
                  kind.yaw_m * (f[1] + f[3] - f[0] - f[2])};
}

void Swarm::fill(int vehicle, const double* state, const VehicleInput& input, double thrust_N,
                 const Eigen::Vector3d& torque_B_Nm, const Eigen::Matrix3d& R_WB) {
  const double* const x = state + vehicle * kVehicleStateSize;
  instant_.p_W_m = Vector3Map(x + kPosition);
  instant_.v_W_m_s = Vector3Map(x + kVelocity);
  instant_.R_WB = R_WB;
  instant_.omega_B_rad_s = Vector3Map(x + kOmega);
  instant_.thrust_N = thrust_N;
  instant_.torque_B_Nm = torque_B_Nm;
  instant_.battery_V = input.battery_V;
  instant_.mass_kg = kinds_[static_cast<std::size_t>(kind_of(vehicle))].mass_kg;
  instant_.neighbours = neighbours_.data();
}

void Swarm::add_neighbour(int vehicle, int other, const double* state) {
  const double* const x = state + vehicle * kVehicleStateSize;
  const double* const y = state + other * kVehicleStateSize;
  Neighbour& neighbour = neighbours_[static_cast<std::size_t>(instant_.num_neighbours++)];
  neighbour.dp_W_m = Vector3Map(y + kPosition) - Vector3Map(x + kPosition);
  neighbour.v_W_m_s = Vector3Map(y + kVelocity);
  neighbour.dv_W_m_s = neighbour.v_W_m_s - Vector3Map(x + kVelocity);
  neighbour.kind = kind_of(other);
  neighbour.mass_kg = kinds_[static_cast<std::size_t>(neighbour.kind)].mass_kg;
}

void Swarm::gather(int vehicle, const double* state, bool all) {
  instant_.num_neighbours = 0;
  if (!all && listed_) {
    for (const int other : near_[static_cast<std::size_t>(vehicle)]) add_neighbour(vehicle, other, state);
    return;
  }
  for (int other = 0; other < size(); ++other) {
    if (other != vehicle) add_neighbour(vehicle, other, state);
  }
}

const Instant& Swarm::instant(int vehicle, double time_s, const double* state, const VehicleInput& input) {
  const double* const x = state + vehicle * kVehicleStateSize;
  const Kind& kind = kinds_[static_cast<std::size_t>(kind_of(vehicle))];
  double thrust_N;
  Eigen::Vector3d torque_B_Nm;
  Eigen::Matrix3d R_WB;
  rotor_wrench(kind, x, input, &thrust_N, &torque_B_Nm);
  rotation_of(x + kQuaternion, &R_WB);
  instant_.time_s = time_s;
  fill(vehicle, state, input, thrust_N, torque_B_Nm, R_WB);
  gather(vehicle, state, true);
  return instant_;
}

Wrench Swarm::effects_on(int vehicle, double time_s, const double* state, const VehicleInput& input) {
  instant(vehicle, time_s, state, input);
  Wrench sum;
  sum.force_W_N = input.disturbance_W_N;
  for (const AppliedEffect& applied : kinds_[static_cast<std::size_t>(kind_of(vehicle))].effects) {
    const Wrench wrench = applied.wrench(instant_);
    sum.force_W_N += wrench.force_W_N;
    sum.torque_B_Nm += wrench.torque_B_Nm;
  }
  return sum;
}

void Swarm::derivative(double time_s, const double* state, const VehicleInput* inputs, double* derivative,
                       double stabilise) {
  instant_.time_s = time_s;
  for (int vehicle = 0; vehicle < size(); ++vehicle) {
    const double* const x = state + vehicle * kVehicleStateSize;
    double* const dx = derivative + vehicle * kVehicleStateSize;
    const VehicleInput& input = inputs[vehicle];
    const Kind& kind = kinds_[static_cast<std::size_t>(kind_of(vehicle))];

    for (int r = 0; r < kNumRotors; ++r) {
      dx[kRotors + r] = kind.lag_rate_1_s * (input.rotor_command_N[r] - x[kRotors + r]);
    }
    if (input.resting) {
      std::fill(dx, dx + kRotors, 0.0);
      continue;
    }
    double thrust_N;
    Eigen::Vector3d torque_B_Nm;
    rotor_wrench(kind, x, input, &thrust_N, &torque_B_Nm);
    const double* const q = x + kQuaternion;
    const double length2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const double s = 2 / length2;
    Eigen::Vector3d force_W_N(s * (q[1] * q[3] + q[0] * q[2]), s * (q[2] * q[3] - q[0] * q[1]),
                              1 - s * (q[1] * q[1] + q[2] * q[2]));  // b3
    force_W_N = thrust_N * force_W_N + input.disturbance_W_N;
    const Vector3Map omega(x + kOmega);
    Eigen::Vector3d moment_B_Nm = torque_B_Nm;

    // Where only neighbours matter and none is near, there is nothing to add.
    const bool alone = listed_ && near_[static_cast<std::size_t>(vehicle)].empty();
    if (!(kind.effects.empty() || (alone && kind.wide.size() == kind.effects.size()))) {
      Eigen::Matrix3d R_WB;
      rotation_of(q, &R_WB);
      fill(vehicle, state, input, thrust_N, torque_B_Nm, R_WB);
      instant_.num_neighbours = 0;
      if (!kind.wide.empty()) gather(vehicle, state, false);
      for (const AppliedEffect& applied : kind.effects) {
        const Wrench wrench = applied.wrench(instant_);
        force_W_N += wrench.force_W_N;
        moment_B_Nm += wrench.torque_B_Nm;
      }
    }

    for (int i = 0; i < 3; ++i) {
      dx[kPosition + i] = x[kVelocity + i];
      dx[kVelocity + i] = force_W_N[i] * kind.inverse_mass_1_kg;
    }
    dx[kVelocity + 2] -= kGravity_m_s2;
    // q' = q (0, omega) / 2, plus a pull to |q| = 1.
    const double pull = stabilise * (1 - length2);
    const double wx = omega[0], wy = omega[1], wz = omega[2];
    dx[kQuaternion] = 0.5 * (-q[1] * wx - q[2] * wy - q[3] * wz) + pull * q[0];
    dx[kQuaternion + 1] = 0.5 * (q[0] * wx + q[2] * wz - q[3] * wy) + pull * q[1];
    dx[kQuaternion + 2] = 0.5 * (q[0] * wy - q[1] * wz + q[3] * wx) + pull * q[2];
    dx[kQuaternion + 3] = 0.5 * (q[0] * wz + q[1] * wy - q[2] * wx) + pull * q[3];
    const Eigen::Vector3d momentum = kind.inertia.cwiseProduct(omega);
    const Eigen::Vector3d omega_dot = kind.inverse_inertia.cwiseProduct(momentum.cross(omega) + moment_B_Nm);
    for (int i = 0; i < 3; ++i) dx[kOmega + i] = omega_dot[i];
  }
}

void Swarm::find_neighbours(const double* state, double horizon_s) {
  listed_ = interacts_;
  if (!interacts_) return;
  constexpr double kFastestChange_m_s2 = 50;
  double fastest_m_s = 0;
  for (int i = 0; i < size(); ++i) {
    fastest_m_s = std::max(fastest_m_s, Vector3Map(state + i * kVehicleStateSize + kVelocity).norm());
  }
  const double margin_m = 2 * horizon_s * (fastest_m_s + horizon_s * kFastestChange_m_s2);
  for (int i = 0; i < size(); ++i) {
    const double* const x = state + i * kVehicleStateSize;
    const Kind& kind = kinds_[static_cast<std::size_t>(kind_of(i))];
    std::vector<int>& near = near_[static_cast<std::size_t>(i)];
    near.clear();
    for (int j = 0; j < size(); ++j) {
      if (j == i) continue;
      const double* const y = state + j * kVehicleStateSize;
      const double dx = y[0] - x[0], dy = y[1] - x[1], dz = y[2] - x[2];
      const double reach =
          std::max(reach_m(kind.wide, dz - margin_m), reach_m(kind.wide, dz + margin_m)) + margin_m;
      if (reach > margin_m && dx * dx + dy * dy < reach * reach) near.push_back(j);
    }
  }
}

void Swarm::forget_neighbours() { listed_ = false; }

void set_hover(const Model& model, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& v_W_m_s,
               double* state) {
  std::fill(state, state + kVehicleStateSize, 0.0);
  for (int i = 0; i < 3; ++i) {
    state[kPosition + i] = p_W_m[i];
    state[kVelocity + i] = v_W_m_s[i];
  }
  state[kQuaternion] = 1;
  for (int r = 0; r < kNumRotors; ++r) state[kRotors + r] = model.weight_N() / kNumRotors;
}

}  // namespace swarmcert::stability
