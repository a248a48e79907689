#include "stability/swarm.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace swarmcert::stability {

struct Swarm::Kind {
  double mass_kg = 0, offset_m = 0, yaw_m = 0;
  double lag_rate_1_s = 0, lag_share = 0;  ///< 1 / tau and gain of the motor lag, 0 without
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();
  SignalPath path;
  std::vector<AppliedEffect> effects;      ///< without those that live in `path`
  std::vector<int> only;                   ///< by effect: the one vehicle that it acts on; kEvery: all
  std::vector<const AppliedEffect*> wide;  ///< that look at neighbours
  bool only_pairs = false;                 ///< its one effect acts on all vehicles, and takes pairs
};

/// Vehicles of one kind on which a single effect acts that takes pairs: computed together.
struct Swarm::PairBatch {
  const AppliedEffect* applied = nullptr;
  std::vector<int> vehicles, ends;      ///< pairs up to ends[i] are those of vehicles[i]
  std::vector<std::size_t> own, other;  ///< of each pair: where the two lie in the rows of states
  std::vector<double> masses_kg;        ///< of each pair's neighbour
  Rows pairs, scratch, force_N;
  std::size_t lines = 0, vehicle_lines = 0;  ///< that these have room for

  void make_room(std::size_t for_lines, std::size_t for_vehicle_lines) {
    if (for_lines <= lines && for_vehicle_lines <= vehicle_lines) return;
    lines = std::max(lines, for_lines);
    vehicle_lines = std::max(vehicle_lines, for_vehicle_lines);
    pairs = Rows(6 * lines);
    scratch = Rows(2 * (lines + vehicle_lines));
    force_N = Rows(vehicle_lines);
  }

  void clear() {
    for (std::vector<int>* list : {&vehicles, &ends}) list->clear();
    for (std::vector<std::size_t>* list : {&own, &other}) list->clear();
    masses_kg.clear();
  }
};

inline const Swarm::Kind& Swarm::kind(int vehicle) const {
  return kinds_[static_cast<std::size_t>(kind_of(vehicle))];
}

void Swarm::set_lag(Kind* kind) {
  kind->lag_rate_1_s = kind->path.motor_lag_s > 0 ? 1 / kind->path.motor_lag_s : 0;
  kind->lag_share = kind->path.motor_lag_s > 0 ? kind->path.motor_lag_gain : 0;
}

namespace {

using Vector3Map = Eigen::Map<const Eigen::Vector3d>;

constexpr int kEvery = -1;

/// Simulated vehicles are named as their logs: the first is cf1. A vehicle that does not fly is none of them.
int only_vehicle(const EffectSpec& spec) {
  if (spec.vehicle.empty()) return kEvery;
  const bool is_number = spec.vehicle.size() > 2 && spec.vehicle.size() < 9 &&
                         spec.vehicle.compare(0, 2, "cf") == 0 &&
                         spec.vehicle.find_first_not_of("0123456789", 2) == std::string::npos;
  return is_number ? std::stoi(spec.vehicle.substr(2)) - 1 : std::numeric_limits<int>::max();
}

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
    : models_(std::move(models)), kind_of_(std::move(kind_of)), bodies_(size()) {
  std::vector<std::string> names;
  for (const Model& model : models_) names.push_back(model.kind);
  for (const int kind : kind_of_) {
    if (kind < 0 || kind >= static_cast<int>(models_.size())) {
      throw std::invalid_argument("Swarm: kind " + std::to_string(kind) + " has no model");
    }
  }
  kinds_.resize(models_.size());
  batches_.resize(models_.size());
  for (std::size_t i = 0; i < models_.size(); ++i) {
    const Model& model = models_[i];
    Kind& kind = kinds_[i];
    kind.mass_kg = model.mass_kg;
    kind.offset_m = model.arm_m * std::sqrt(0.5);
    kind.yaw_m = model.torque_per_thrust_m;
    kind.inertia = Vector3Map(model.inertia_kg_m2.data());
    for (const EffectSpec& spec : model.effects) {
      AppliedEffect applied(spec, {model.kind, names, model.path});
      if (applied.effect().info().remembers) {
        applied.effect().add_to(kind.path, applied.coefficients().data(), applied.shape().data());
      } else {
        kind.effects.push_back(std::move(applied));
        kind.only.push_back(only_vehicle(spec));
      }
    }
    for (const AppliedEffect& applied : kind.effects) {
      if (applied.effect().info().needs_neighbours) kind.wide.push_back(&applied);
    }
    interacts_ = interacts_ || !kind.wide.empty();
    kind.only_pairs =
        kind.effects.size() == 1 && kind.only[0] == kEvery && kind.effects[0].effect().takes_pairs();
    if (kind.only_pairs) batches_[i].applied = &kind.effects[0];
    set_lag(&kind);
  }
  near_.resize(kind_of_.size());
  rested_.resize(kind_of_.size());
  neighbours_.resize(kind_of_.size());
  rows_ = start_ = sum_ = Rows(lines_for(kind_of_.size()) * kVehicleStateSize);
  set_bodies();
}

Swarm::Swarm(Model model, int vehicles)
    : Swarm(std::vector<Model>{std::move(model)}, std::vector<int>(static_cast<std::size_t>(vehicles), 0)) {}

Swarm::~Swarm() = default;

const SignalPath& Swarm::path(int vehicle) const { return kind(vehicle).path; }

void Swarm::set_bodies() {
  for (int i = 0; i < size(); ++i) {
    const Kind& own = kind(i);
    bodies_.at(RigidBodies::kInverseMass, i) = 1 / own.mass_kg;
    bodies_.at(RigidBodies::kOffset, i) = own.offset_m;
    bodies_.at(RigidBodies::kYaw, i) = own.yaw_m;
    bodies_.at(RigidBodies::kLagRate, i) = own.lag_rate_1_s;
    bodies_.at(RigidBodies::kLagShare, i) = own.lag_share;
    for (int axis = 0; axis < 3; ++axis) {
      bodies_.at(RigidBodies::kInertia + axis, i) = own.inertia[axis];
      bodies_.at(RigidBodies::kInverseInertia + axis, i) = 1 / own.inertia[axis];
    }
  }
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
  set_bodies();
}

void Swarm::fill(int vehicle, const States& states, const VehicleInput& input) {
  const Kind& own = kind(vehicle);
  instant_.p_W_m = states.three(vehicle, kPosition);
  instant_.v_W_m_s = states.three(vehicle, kVelocity);
  const double q[4] = {states(vehicle, kQuaternion), states(vehicle, kQuaternion + 1),
                       states(vehicle, kQuaternion + 2), states(vehicle, kQuaternion + 3)};
  rotation_of(q, &instant_.R_WB);
  instant_.omega_B_rad_s = states.three(vehicle, kOmega);
  double f[kNumRotors];
  for (int r = 0; r < kNumRotors; ++r) {
    const double command = input.rotor_command_N[r];
    f[r] = command + own.lag_share * (states(vehicle, kRotors + r) - command);
  }
  // As in RigidBodies.
  instant_.thrust_N = f[0] + f[1] + f[2] + f[3];
  instant_.torque_B_Nm = {own.offset_m * (f[2] + f[3] - f[0] - f[1]),
                          own.offset_m * (f[1] + f[2] - f[0] - f[3]),
                          own.yaw_m * (f[1] + f[3] - f[0] - f[2])};
  instant_.battery_V = input.battery_V;
  instant_.mass_kg = own.mass_kg;
  instant_.neighbours = neighbours_.data();
}

void Swarm::add_neighbour(int vehicle, int other, const States& states) {
  Neighbour& neighbour = neighbours_[static_cast<std::size_t>(instant_.num_neighbours++)];
  neighbour.dp_W_m = states.three(other, kPosition) - states.three(vehicle, kPosition);
  neighbour.v_W_m_s = states.three(other, kVelocity);
  neighbour.dv_W_m_s = neighbour.v_W_m_s - states.three(vehicle, kVelocity);
  neighbour.kind = kind_of(other);
  neighbour.mass_kg = kind(other).mass_kg;
}

void Swarm::gather(int vehicle, const States& states, bool all) {
  instant_.num_neighbours = 0;
  if (!all && listed_) {
    for (const int other : near_[static_cast<std::size_t>(vehicle)]) add_neighbour(vehicle, other, states);
    return;
  }
  for (int other = 0; other < size(); ++other) {
    if (other != vehicle) add_neighbour(vehicle, other, states);
  }
}

const Instant& Swarm::instant(int vehicle, double time_s, const double* state, const VehicleInput& input) {
  const States states = by_vehicle(state);
  instant_.time_s = time_s;
  fill(vehicle, states, input);
  gather(vehicle, states, true);
  return instant_;
}

Wrench Swarm::effects_on(int vehicle, double time_s, const double* state, const VehicleInput& input) {
  instant(vehicle, time_s, state, input);
  return sum_of_effects(vehicle, input);
}

/// At instant_.
Wrench Swarm::sum_of_effects(int vehicle, const VehicleInput& input) const {
  Wrench sum;
  sum.force_W_N = input.disturbance_W_N;
  const Kind& own = kind(vehicle);
  for (std::size_t e = 0; e < own.effects.size(); ++e) {
    if (own.only[e] != kEvery && own.only[e] != vehicle) continue;
    const Wrench wrench = own.effects[e].wrench(instant_);
    sum.force_W_N += wrench.force_W_N;
    sum.torque_B_Nm += wrench.torque_B_Nm;
  }
  return sum;
}

void Swarm::to_rows(const double* state, double* rows) const {
  for (int i = 0; i < size(); ++i) {
    const double* const from = state + i * kVehicleStateSize;
    double* const to = rows + row_index(i, kVehicleStateSize);
    for (int c = 0; c < kVehicleStateSize; ++c) to[c * kRowLength] = from[c];
  }
}

void Swarm::from_rows(const double* rows, double* state) const {
  for (int i = 0; i < size(); ++i) {
    const double* const from = rows + row_index(i, kVehicleStateSize);
    double* const to = state + i * kVehicleStateSize;
    for (int c = 0; c < kVehicleStateSize; ++c) to[c] = from[c * kRowLength];
  }
}

void Swarm::hold(const VehicleInput* inputs) {
  for (int i = 0; i < size(); ++i) {
    const VehicleInput& input = inputs[i];
    bodies_.at(RigidBodies::kMoving, i) = input.resting ? 0 : 1;
    for (int r = 0; r < kNumRotors; ++r) bodies_.at(RigidBodies::kCommand + r, i) = input.rotor_command_N[r];
    for (int axis = 0; axis < 3; ++axis) {
      bodies_.at(RigidBodies::kForce + axis, i) = input.disturbance_W_N[axis];
      bodies_.at(RigidBodies::kTorque + axis, i) = 0;
    }
  }
  pair_up(inputs);
}

/// Who is acted on, and by whom, until find_neighbours() looks again or a vehicle comes to rest or leaves the ground.
void Swarm::pair_up(const VehicleInput* inputs) {
  for (int i = 0; i < size(); ++i) {
    char& rested = rested_[static_cast<std::size_t>(i)];
    pairs_hold_ = pairs_hold_ && (rested != 0) == inputs[i].resting;
    rested = inputs[i].resting ? 1 : 0;
  }
  if (pairs_hold_) return;
  pairs_hold_ = true;
  acted_on_.clear();
  for (PairBatch& batch : batches_) batch.clear();
  for (int i = 0; i < size(); ++i) {
    const Kind& own = kind(i);
    // Where only neighbours matter and none is near, there is nothing to add.
    const bool alone = listed_ && near_[static_cast<std::size_t>(i)].empty();
    const bool nothing = own.effects.empty() || (alone && own.wide.size() == own.effects.size());
    if (inputs[i].resting || nothing) continue;
    if (!own.only_pairs) {
      acted_on_.push_back(i);
      continue;
    }
    PairBatch& batch = batches_[static_cast<std::size_t>(kind_of(i))];
    const auto add = [&](int other) {
      batch.own.push_back(row_index(i, kVehicleStateSize));
      batch.other.push_back(row_index(other, kVehicleStateSize));
      batch.masses_kg.push_back(kind(other).mass_kg);
    };
    if (listed_) {
      for (const int other : near_[static_cast<std::size_t>(i)]) add(other);
    } else {
      for (int other = 0; other < size(); ++other) {
        if (other != i) add(other);
      }
    }
    batch.vehicles.push_back(i);
    batch.ends.push_back(static_cast<int>(batch.own.size()));
  }
  for (PairBatch& batch : batches_) {
    if (batch.applied == nullptr) continue;
    const std::size_t lines = lines_for(batch.own.size());
    batch.make_room(lines, lines_for(batch.vehicles.size()));
    double* const constant = batch.pairs.data() + 5 * lines * kRowLength;
    for (std::size_t k = 0; k < batch.own.size(); ++k) {
      constant[k] = batch.applied->effect().pair_constant(batch.masses_kg[k], batch.applied->shape().data());
    }
  }
}

/// Disturbances and effects, as outer forces of the bodies.
void Swarm::act(double time_s, const double* rows, const VehicleInput* inputs) {
  act_on_pairs(rows, inputs);
  const States states = {rows, true};
  instant_.time_s = time_s;
  for (const int i : acted_on_) {
    fill(i, states, inputs[i]);
    instant_.num_neighbours = 0;
    if (!kind(i).wide.empty()) gather(i, states, false);
    const Wrench sum = sum_of_effects(i, inputs[i]);
    for (int axis = 0; axis < 3; ++axis) {
      bodies_.at(RigidBodies::kForce + axis, i) = sum.force_W_N[axis];
      bodies_.at(RigidBodies::kTorque + axis, i) = sum.torque_B_Nm[axis];
    }
  }
}

void Swarm::act_on_pairs(const double* state, const VehicleInput* inputs) {
  static_assert(kRowLength == PairRows::kMultiple);
  for (PairBatch& batch : batches_) {
    const std::size_t count = batch.own.size(), row = lines_for(count) * kRowLength;
    if (count == 0) continue;
    double* const rows = batch.pairs.data();
    const Effect& effect = batch.applied->effect();
    const double* const shape = batch.applied->shape().data();
    for (int axis = 0; axis < 3; ++axis) {
      const double* const at = state + axis * kRowLength;
      double* const to = rows + static_cast<std::size_t>(axis) * row;
      for (std::size_t k = 0; k < count; ++k) to[k] = at[batch.other[k]] - at[batch.own[k]];
    }
    for (int axis = 0; axis < 2 && effect.pairs_need_velocity(shape); ++axis) {
      const double* const at = state + (kVelocity + axis) * kRowLength;
      double* const to = rows + static_cast<std::size_t>(3 + axis) * row;
      for (std::size_t k = 0; k < count; ++k) to[k] = at[batch.other[k]];
    }
    effect.force_z({rows, rows + row, rows + 2 * row, rows + 3 * row, rows + 4 * row, rows + 5 * row},
                   batch.ends.data(), static_cast<int>(batch.vehicles.size()), shape, batch.scratch.data(),
                   batch.force_N.data());
    const double per_unit = batch.applied->coefficients()[0];
    for (std::size_t i = 0; i < batch.vehicles.size(); ++i) {
      const int vehicle = batch.vehicles[i];
      bodies_.at(RigidBodies::kForce + 2, vehicle) =
          inputs[vehicle].disturbance_W_N.z() + per_unit * batch.force_N.data()[i];
    }
  }
}

void Swarm::derivative(double time_s, const double* state, const VehicleInput* inputs, double* derivative,
                       double stabilise) {
  to_rows(state, rows_.data());
  hold(inputs);
  act(time_s, rows_.data(), inputs);
  bodies_.derivative(rows_.data(), stabilise, sum_.data());
  from_rows(sum_.data(), derivative);
}

void Swarm::runge_kutta(double time_s, double step_s, int steps, const VehicleInput* inputs, double* state) {
  to_rows(state, start_.data());
  hold(inputs);
  for (int step = 0; step < steps; ++step) {
    const double t = time_s + step * step_s;
    const double at_s[] = {t, t + step_s / 2, t + step_s / 2, t + step_s};
    for (int stage = 0; stage < 4; ++stage) {
      act(at_s[stage], (stage == 0 ? start_ : rows_).data(), inputs);
      bodies_.stage(stage, step_s, start_.data(), rows_.data(), sum_.data());
    }
  }
  from_rows(start_.data(), state);
}

void Swarm::find_neighbours(const double* state, double horizon_s) {
  listed_ = interacts_;
  pairs_hold_ = false;
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
      const double distance2 = dx * dx + dy * dy;
      const auto reaches = [&](double height_m) {
        const double reach = reach_m(kind.wide, height_m);
        return reach > 0 && distance2 < (reach + margin_m) * (reach + margin_m);
      };
      if (reaches(dz + margin_m) || reaches(dz - margin_m)) near.push_back(j);
    }
  }
}

void Swarm::forget_neighbours() { listed_ = pairs_hold_ = false; }

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
