#include "stability/simulation/swarm.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "stability/simulation/swarm_kind.h"

namespace swarmcert::stability {

void Swarm::set_lag(Kind* kind) {
  kind->lag_rate_1_s = kind->path.motor_lag_s > 0 ? 1 / kind->path.motor_lag_s : 0;
  kind->lag_share = kind->path.motor_lag_s > 0 ? kind->path.motor_lag_gain : 0;
}

namespace {

using Vector3Map = Eigen::Map<const Eigen::Vector3d>;

/// Returns the index of the vehicle that `spec` names. Simulated vehicles are named like their logs; the first is cf1.
/// A vehicle that does not fly matches none.
int only_vehicle(const EffectSpec& spec) {
  if (spec.vehicle.empty()) return kEveryVehicle;
  const bool is_number = spec.vehicle.size() > 2 && spec.vehicle.size() < 9 &&
                         spec.vehicle.compare(0, 2, "cf") == 0 &&
                         spec.vehicle.find_first_not_of("0123456789", 2) == std::string::npos;
  return is_number ? std::stoi(spec.vehicle.substr(2)) - 1 : std::numeric_limits<int>::max();
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
    refuse_other_rotors(model, "simulation");
    Kind& kind = kinds_[i];
    kind.mass_kg = model.mass_kg;
    kind.offset_m = model.arm_m * std::sqrt(0.5);
    kind.yaw_m = model.torque_per_thrust_m;
    kind.inertia = Vector3Map(model.inertia_kg_m2.data());
    for (const EffectSpec& spec : model.effects) {
      AppliedEffect applied(spec, {model.kind, names, model.path});
      if (applied.effect().info().remembers) {
        applied.effect().add_to(kind.path, applied.coefficients().data(), applied.shape().data());
      } else if (dynamic_cast<const StateEffect*>(&applied.effect()) != nullptr) {
        kind.with_states.push_back(std::move(applied));
        kind.with_states_only.push_back(only_vehicle(spec));
      } else {
        kind.effects.push_back(std::move(applied));
        kind.only.push_back(only_vehicle(spec));
      }
    }
    for (const AppliedEffect& applied : kind.effects) {
      if (!applied.effect().info().needs_neighbours) continue;
      kind.wide.push_back(&applied);
      const std::vector<double> bends_m = applied.effect().bends_m();
      kind.bends_m.insert(kind.bends_m.end(), bends_m.begin(), bends_m.end());
    }
    interacts_ = interacts_ || !kind.wide.empty();
    kind.reach_m = ReachTable(kind.wide);
    kind.only_pairs = kind.with_states.empty() && kind.effects.size() == 1 && kind.only[0] == kEveryVehicle &&
                      kind.effects[0].effect().takes_pairs();
    if (kind.only_pairs) batches_[i].applied = &kind.effects[0];
    batches_[i].pairs = SwarmPairs(size());
    set_lag(&kind);
  }
  near_.resize(kind_of_.size());
  rested_.resize(kind_of_.size());
  neighbours_.resize(kind_of_.size());
  place_effect_states();
  rows_ = sum_ = ahead_ = make_rows();
  set_bodies();
}

Swarm::Swarm(Model model, int vehicles)
    : Swarm(std::vector<Model>{std::move(model)}, std::vector<int>(static_cast<std::size_t>(vehicles), 0)) {}

Swarm::~Swarm() = default;

const SignalPath& Swarm::path(int vehicle) const { return kind(vehicle).path; }

void Swarm::set_bodies() {
  bodies_.set_lagging(
      std::any_of(kinds_.begin(), kinds_.end(), [](const Kind& own) { return own.lag_rate_1_s != 0; }));
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
  return sum_of_effects(vehicle, input, state + size() * kVehicleStateSize);
}

/// Returns the sum of the effects at instant_.
Wrench Swarm::sum_of_effects(int vehicle, const VehicleInput& input, const double* effect_states) {
  Wrench sum;
  sum.force_W_N = input.disturbance_W_N;
  const Kind& own = kind(vehicle);
  for (std::size_t e = 0; e < own.effects.size(); ++e) {
    if (own.only[e] != kEveryVehicle && own.only[e] != vehicle) continue;
    const Wrench wrench = own.effects[e].wrench(instant_);
    sum.force_W_N += wrench.force_W_N;
    sum.torque_B_Nm += wrench.torque_B_Nm;
  }
  return has_effect_states(vehicle) ? act_with_states(vehicle, effect_states, sum) : sum;
}

Rows Swarm::make_rows() const {
  const std::size_t lines = lines_for(kind_of_.size());
  Rows rows(lines * kVehicleStateSize + lines_for(rates_.size()));
  for (std::size_t line = 0; line < lines; ++line) {
    const std::size_t at = row_index(static_cast<int>(line) * kRowLength, kVehicleStateSize);
    std::fill_n(rows.data() + at + (kQuaternion + 3) * kRowLength, kRowLength, 1.0);
  }
  return rows;
}

void Swarm::to_rows(const double* state, double* rows) const {
  for (int i = 0; i < size(); ++i) {
    const double* const from = state + i * kVehicleStateSize;
    double* const to = rows + row_index(i, kVehicleStateSize);
    for (int c = 0; c < kVehicleStateSize; ++c) to[c * kRowLength] = from[c];
  }
  std::copy_n(state + size() * kVehicleStateSize, num_effect_states(), effect_states(rows));
}

void Swarm::from_rows(const double* rows, double* state) const {
  for (int i = 0; i < size(); ++i) {
    const double* const from = rows + row_index(i, kVehicleStateSize);
    double* const to = state + i * kVehicleStateSize;
    for (int c = 0; c < kVehicleStateSize; ++c) to[c] = from[c * kRowLength];
  }
  std::copy_n(effect_states(rows), num_effect_states(), state + size() * kVehicleStateSize);
}

void Swarm::hold(const VehicleInput* inputs) {
  bool same_rest = true, all_move = true;
  for (int i = 0; i < size(); ++i) {
    const VehicleInput& input = inputs[i];
    double* const body = &bodies_.at(0, i);
    const auto row = [body](int which) -> double& { return body[which * kRowLength]; };
    for (int r = 0; r < kNumRotors; ++r) row(RigidBodies::kCommand + r) = input.rotor_command_N[r];
    for (int axis = 0; axis < 3; ++axis) row(RigidBodies::kForce + axis) = input.disturbance_W_N[axis];
    row(RigidBodies::kLaterForceZ) = row(RigidBodies::kDisturbanceZ) = input.disturbance_W_N.z();
    row(RigidBodies::kMoving) = input.resting ? 0 : 1;
    char& rested = rested_[static_cast<std::size_t>(i)];
    same_rest = same_rest && (rested != 0) == input.resting;
    all_move = all_move && !input.resting;
    rested = input.resting ? 1 : 0;
  }
  bodies_.set_all_moving(all_move);
  if (!pairs_hold_ || !same_rest) pair_up(inputs);
}

/// Determines which vehicles have effects and which pairs interact, until find_neighbours() is called again or a
/// vehicle lands or takes off.
void Swarm::pair_up(const VehicleInput* inputs) {
  pairs_hold_ = true;
  for (const int i : acted_on_) {
    for (int axis = 0; axis < 3; ++axis) bodies_.at(RigidBodies::kTorque + axis, i) = 0;
  }
  acted_on_.clear();
  for (PairBatch& batch : batches_) batch.pairs.clear();
  for (int i = 0; i < size(); ++i) {
    const Kind& own = kind(i);
    // If only neighbours matter and none is near, there is nothing to add.
    const bool alone = listed_ && near_[static_cast<std::size_t>(i)].empty();
    const bool nothing = own.effects.empty() || (alone && own.wide.size() == own.effects.size());
    if (inputs[i].resting || (nothing && !has_effect_states(i))) continue;
    if (!own.only_pairs) {
      acted_on_.push_back(i);
      continue;
    }
    PairBatch& batch = batches_[static_cast<std::size_t>(kind_of(i))];
    const auto add = [&](int other) {
      batch.pairs.add(
          i, other,
          batch.applied->effect().pair_constant(kind(other).mass_kg, batch.applied->shape().data()));
    };
    if (listed_) {
      for (const int other : near_[static_cast<std::size_t>(i)]) add(other);
    } else {
      for (int other = 0; other < size(); ++other) {
        if (other != i) add(other);
      }
    }
  }
  sees_ahead_ = acted_on_.empty();
  for (PairBatch& batch : batches_) {
    if (batch.pairs.empty()) continue;
    sees_ahead_ = sees_ahead_ && !batch.applied->effect().pairs_need_velocity(batch.applied->shape().data());
    batch.scratch.make_room(batch.pairs.scratch_lines());
  }
}

/// Adds disturbances and effects to the external forces of the bodies.
void Swarm::act(double time_s, const double* rows, const VehicleInput* inputs) {
  act_on_pairs(&rows, 1);
  const States states = {rows, true};
  instant_.time_s = time_s;
  std::fill(rates_.begin(), rates_.end(), 0.0);
  for (const int i : acted_on_) {
    fill(i, states, inputs[i]);
    instant_.num_neighbours = 0;
    if (!kind(i).wide.empty()) gather(i, states, false);
    const Wrench sum = sum_of_effects(i, inputs[i], effect_states(rows));
    for (int axis = 0; axis < 3; ++axis) {
      bodies_.at(RigidBodies::kForce + axis, i) = sum.force_W_N[axis];
      bodies_.at(RigidBodies::kTorque + axis, i) = sum.torque_B_Nm[axis];
    }
  }
}

/// Adds the effects between pairs, in one or two states of the swarm, to the external forces of the bodies.
void Swarm::act_on_pairs(const double* const* rows, int num_rows) {
  double* const forces[] = {bodies_.row(RigidBodies::kForce + 2), bodies_.row(RigidBodies::kLaterForceZ)};
  const double* const disturbance = bodies_.row(RigidBodies::kDisturbanceZ);
  const double* from[] = {disturbance, disturbance};
  for (PairBatch& batch : batches_) {
    if (batch.pairs.empty()) continue;
    batch.applied->effect().add_force_z(batch.pairs, rows, num_rows, batch.applied->shape().data(),
                                        batch.applied->coefficients()[0], batch.scratch.data(),
                                        {from, forces, RigidBodies::kNumRows * kRowLength});
    for (int k = 0; k < 2; ++k) from[k] = forces[k];
  }
}

void Swarm::derivative(double time_s, const double* state, const VehicleInput* inputs, double* derivative,
                       double stabilise) {
  to_rows(state, rows_.data());
  derivative_in_rows(time_s, rows_.data(), inputs, sum_.data(), stabilise);
  from_rows(sum_.data(), derivative);
}

void Swarm::derivative_in_rows(double time_s, const double* rows, const VehicleInput* inputs,
                               double* derivative_rows, double stabilise) {
  hold(inputs);
  act(time_s, rows, inputs);
  bodies_.derivative(rows, stabilise, derivative_rows);
  std::copy(rates_.begin(), rates_.end(), effect_states(derivative_rows));
}

void Swarm::runge_kutta(double time_s, double step_s, int steps, const VehicleInput* inputs, double* start) {
  hold(inputs);
  double* const rows = rows_.data();
  for (int step = 0; step < steps; ++step) {
    if (sees_ahead_) {
      for (const int first : {0, 2}) {
        const double* const at = first == 0 ? start : rows;
        bodies_.drift(first == 0 ? step_s / 2 : step_s, start, at, ahead_.data());
        const double* const both[] = {at, ahead_.data()};
        act_on_pairs(both, 2);
        bodies_.two_stages(first, step_s, start, rows, sum_.data());
      }
      continue;
    }
    const double t = time_s + step * step_s;
    const double at_s[] = {t, t + step_s / 2, t + step_s / 2, t + step_s};
    for (int stage = 0; stage < 4; ++stage) {
      act(at_s[stage], stage == 0 ? start : rows, inputs);
      bodies_.stage(stage, step_s, start, rows, sum_.data());
      stage_effect_states(stage, step_s, effect_states(start), effect_states(rows),
                          effect_states(sum_.data()));
    }
  }
}

void set_hover(const Model& model, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& v_W_m_s,
               double* state) {
  std::fill(state, state + kVehicleStateSize, 0.0);
  for (int i = 0; i < 3; ++i) {
    state[kPosition + i] = p_W_m[i];
    state[kVelocity + i] = v_W_m_s[i];
  }
  state[kQuaternion + 3] = 1;
  for (int r = 0; r < kNumRotors; ++r) state[kRotors + r] = model.weight_N() / kNumRotors;
}

}  // namespace swarmcert::stability
