/// @file Equations of motion of a swarm of vehicles, of one kind or several, with their effects on each other.
///
///   p' = v,  m v' = m g + R f_u + f_a,  R' = R S(omega),  J omega' = J omega x omega + tau_u + tau_a
/// (paper, equations (1) to (3)); f_u and tau_u come from four rotors behind the motor lag, f_a and tau_a from the
/// models' effects. Nothing saturates here.
#pragma once

#include <cstddef>
#include <vector>

#include "stability/bodies/rigid_bodies.h"
#include "stability/bodies/vehicle_state.h"
#include "stability/effects/effect.h"
#include "stability/effects/signal_path.h"
#include "stability/effects/state_effect.h"
#include "stability/model.h"

namespace swarmcert::stability {

/// External inputs of one vehicle.
struct VehicleInput {
  double rotor_command_N[kNumRotors] = {0, 0, 0, 0};  ///< after the command delay
  double battery_V = kFullBattery_V;
  Eigen::Vector3d disturbance_W_N = Eigen::Vector3d::Zero();  ///< added to f_a
  bool resting = false;                                       ///< on the ground: only the rotors change state
};

/// The plant. Keeps scratch memory: use one instance per thread.
class Swarm {
 public:
  /// @param models one per kind of vehicle.
  /// @param kind_of index into `models` for each vehicle.
  /// @throws files::InputError if an effect cannot be made.
  Swarm(std::vector<Model> models, std::vector<int> kind_of);
  /// All vehicles share one model.
  Swarm(Model model, int vehicles);
  ~Swarm();

  int size() const { return static_cast<int>(kind_of_.size()); }
  /// Size of a state: kVehicleStateSize per vehicle, then the states of effects (StateEffect).
  int state_size() const { return size() * kVehicleStateSize + num_effect_states(); }
  int num_effect_states() const { return static_cast<int>(rates_.size()); }
  const Model& model(int vehicle) const { return models_[static_cast<std::size_t>(kind_of_[vehicle])]; }
  int kind_of(int vehicle) const { return kind_of_[static_cast<std::size_t>(vehicle)]; }
  const std::vector<Model>& models() const { return models_; }
  /// Returns the delays and lags that the model's effects put into the vehicle's signals.
  const SignalPath& path(int vehicle) const;
  /// Sets the motor lag and the delay of those kinds whose models specify none.
  void assume_lag(double motor_lag_s, double delay_s);

  /// Computes d state / dt.
  /// @param state      [state_size()], see StateIndex.
  /// @param inputs     [size()].
  /// @param derivative [state_size()], overwritten.
  /// @param stabilise  rate in 1/s at which |q| is pulled towards 1, for integrators that never normalise; else 0.
  void derivative(double time_s, const double* state, const VehicleInput* inputs, double* derivative,
                  double stabilise = 0);

  /// Computes derivative() for a state in rows (rigid_bodies.h), in rows.
  void derivative_in_rows(double time_s, const double* rows, const VehicleInput* inputs,
                          double* derivative_rows, double stabilise = 0);

  /// Converts a state to rows (rigid_bodies.h), and back.
  void to_rows(const double* state, double* rows) const;
  void from_rows(const double* rows, double* state) const;
  /// Returns the states of effects within a state in rows; they follow the lines of the vehicles.
  double* effect_states(double* rows) const { return rows + effect_row_; }
  const double* effect_states(const double* rows) const { return rows + effect_row_; }
  /// Sets the states of the effects on one vehicle to rest, within the `effect_states` of all vehicles.
  void rest_effects(int vehicle, double* effect_states) const;
  /// Returns rows for a state; lanes without a vehicle are at rest.
  Rows make_rows() const;

  /// Takes `steps` classical Runge-Kutta steps of `step_s` each, with constant inputs.
  /// @param rows the state in rows at `time_s`; overwritten. Quaternions are not normalised.
  void runge_kutta(double time_s, double step_s, int steps, const VehicleInput* inputs, double* rows);
  /// Scales the quaternions to length 1.
  void normalise(double* rows) const { bodies_.normalise(rows); }

  /// Returns f_a and tau_a of one vehicle at `state`.
  Wrench effects_on(int vehicle, double time_s, const double* state, const VehicleInput& input);

  /// Returns all inputs of the effects on one vehicle, with all other vehicles as its neighbours. Valid until the next
  /// call on this object.
  const Instant& instant(int vehicle, double time_s, const double* state, const VehicleInput& input);

  /// Determines which vehicles can interact within `horizon_s`, so that derivative() evaluates few pairs. Without this
  /// call, and after forget_neighbours(), it evaluates all pairs. Assumes accelerations below 50 m/s^2.
  /// @param rows the state in rows.
  void find_neighbours(const double* rows, double horizon_s);
  void forget_neighbours();

  /// Whether, before the next find_neighbours(), a vehicle may reach a height below another at which an effect is not
  /// smooth (Effect::bends_m()).
  bool may_meet_bends() const { return !meetings_.empty(); }
  /// Returns the fraction of a step after which the first such height is reached; 1 if there is none, or only at the
  /// ends.
  /// @param before, after the state in rows, `step_s` apart.
  double first_bend(const double* before, const double* after, double step_s) const;
  /// Copies from `from` the states of vehicles that no other vehicle can reach. Both are states in rows.
  void copy_unreached(const double* from, double* rows) const;

 private:
  struct Kind;
  struct PairBatch;
  /// States of all vehicles, vehicle by vehicle or in rows.
  struct States {
    const double* x;
    bool in_rows;

    double operator()(int i, int c) const {
      return in_rows ? x[row_index(i, kVehicleStateSize) + static_cast<std::size_t>(c * kRowLength)]
                     : x[i * kVehicleStateSize + c];
    }
    Eigen::Vector3d three(int i, int c) const {
      return {(*this)(i, c), (*this)(i, c + 1), (*this)(i, c + 2)};
    }
  };

  /// A StateEffect on one vehicle.
  struct StateUse {
    const AppliedEffect* applied;
    const StateEffect* effect;
    std::size_t first;  ///< offset of its states among those of all effects
  };

  void place_effect_states();
  bool has_effect_states(int vehicle) const;
  Wrench act_with_states(int vehicle, const double* effect_states, const Wrench& others);
  void stage_effect_states(int which, double step_s, double* start, double* rows, double* sum) const;
  void find_meetings(const double* rows, double horizon_s);
  static void set_lag(Kind* kind);
  const Kind& kind(int vehicle) const;
  States by_vehicle(const double* state) const { return {state, false}; }
  void fill(int vehicle, const States& states, const VehicleInput& input);
  void add_neighbour(int vehicle, int other, const States& states);
  void gather(int vehicle, const States& states, bool all);
  Wrench sum_of_effects(int vehicle, const VehicleInput& input, const double* effect_states);
  void hold(const VehicleInput* inputs);
  void pair_up(const VehicleInput* inputs);
  void act(double time_s, const double* rows, const VehicleInput* inputs);
  void act_on_pairs(const double* const* rows, int num_rows);
  void set_bodies();

  std::vector<Model> models_;
  std::vector<int> kind_of_;
  std::vector<Kind> kinds_;
  bool interacts_ = false;  ///< some effect depends on neighbours
  bool listed_ = false;
  std::vector<std::vector<int>> near_;  ///< by vehicle, if listed_
  std::vector<int> found_;              ///< scratch
  /// `upper` may become higher than `lower` by bend_m, where the force on `lower` is not smooth.
  struct Meeting {
    int lower, upper;
    double bend_m;
  };
  std::vector<Meeting> meetings_;
  std::vector<int> acted_on_;       ///< vehicles with effects that are not in batches_; since hold()
  std::vector<PairBatch> batches_;  ///< by kind
  /// All effects depend on nothing but the positions of pairs. In a Runge-Kutta step, the forces of stages 1 and 2, and
  /// those of stages 3 and 4, then do not depend on each other.
  bool sees_ahead_ = false;
  bool pairs_hold_ = false;             ///< acted_on_ and batches_ match near_ and the resting vehicles
  std::vector<char> rested_;            ///< by vehicle, when these were built
  std::vector<StateUse> state_uses_;    ///< vehicle by vehicle
  std::vector<std::size_t> first_use_;  ///< by vehicle, and one past the end
  std::vector<double> rates_;           ///< d / dt of the states of effects
  std::size_t effect_row_ = 0;
  Instant instant_;
  std::vector<Neighbour> neighbours_;
  RigidBodies bodies_;
  Rows rows_, sum_, ahead_;
};

/// Sets the initial state: at `p_W_m`, with velocity `v_W_m_s`, level, heading +x, rotors at hover force.
void set_hover(const Model& model, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& v_W_m_s,
               double* state);

}  // namespace swarmcert::stability
