/// @file The sampled closed loop: controllers at their own rates, zero-order hold, plant by Runge-Kutta.
///
/// Vehicles are computed in SIMD lanes where the processor supports it, bitwise identical to computing each alone.
///
/// Each control period (that of the attitude loop, 2 ms) runs the position loop if it is due, the network's prediction
/// if it is due (held between updates, applied after its latency, computed from neighbours' positions received by
/// radio), and the attitude law and mixing. Then the plant is integrated by classical Runge-Kutta under constant
/// commands, which change within a period only because of a command delay. A step that would take a vehicle across a
/// height where an effect is not smooth (Effect::bends_m()) is split there. Quaternions are normalised between periods,
/// never within one.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "nn/base/random.h"
#include "nn/weights/network.h"
#include "stability/effects/deep_set_force.h"
#include "stability/gains.h"
#include "stability/simulation/controller_bank.h"
#include "stability/simulation/radio.h"
#include "stability/simulation/swarm.h"
#include "stability/tasks/task.h"

namespace swarmcert::stability {

struct SampledFlightOptions {
  double attitude_rate_hz = 500;
  int substeps = 1;         ///< Runge-Kutta steps per control period
  bool flies_float = true;  ///< controllers in float32, as in flight; false: the same code in double
  bool noise = false;       ///< adds noise to measured positions and velocities, by the model's [sensor]
  std::uint64_t seed = 0;
  double battery_start_V = 4.1;
  double battery_drop_V_s = 1.5e-3;  ///< a Crazyflie's cell lasts about five minutes
  double ground_m = 0.05;            ///< lowest possible height
  RadioOptions radio;                ///< transmits the networks' inputs, at the networks' rate
  /// Its prediction is subtracted from the torque that the attitude law requests; nullptr: none. Read by the
  /// constructor.
  const files::Network* torque_network = nullptr;
};

class SampledFlight {
 public:
  /// @param swarm, task must outlive this.
  /// @param network adds its prediction to the control law; nullptr: none.
  /// @throws std::invalid_argument if the period of the position or network loop is not a whole number of control
  ///     periods; files::InputError if a network lacks a kind, or predicts something else.
  SampledFlight(Swarm& swarm, const Gains& gains, const Task& task, const SampledFlightOptions& options,
                const files::Network* network = nullptr);
  ~SampledFlight();

  /// Simulates one control period.
  void step();

  double time_s() const { return static_cast<double>(period_) * period_s_; }
  double period_s() const { return period_s_; }
  /// Returns the number of periods since the start.
  std::int64_t period() const { return period_; }
  /// Returns true if the position loop ran in the last step().
  bool ran_position() const { return ran_position_; }
  /// Returns the state, [swarm().state_size()], see StateIndex; valid until the next step().
  const double* state() const;
  /// Returns the state in rows (rigid_bodies.h); valid after a step() until change_state().
  const double* rows() const { return rows_.data(); }
  /// Returns state() for writing, before the next step().
  double* change_state();
  const VehicleInput& input(int vehicle) const { return inputs_[static_cast<std::size_t>(vehicle)]; }
  VehicleInput& input(int vehicle) { return inputs_[static_cast<std::size_t>(vehicle)]; }
  /// Returns the inputs and outputs of a vehicle's controller in its last period.
  const ControlRecord& record(int vehicle) const;
  /// Returns record(vehicle).saturated without completing the record.
  bool is_saturated(int vehicle) const { return records_[static_cast<std::size_t>(vehicle)].saturated; }
  /// Returns the inputs of all vehicles.
  const VehicleInput* inputs() const { return inputs_.data(); }
  Swarm& swarm() { return swarm_; }
  double battery_V() const;

 private:
  void measure();
  void control();
  Eigen::Vector3d measured_position(int vehicle);
  void predict();
  void move();
  void apply_delayed(bool late);
  void advance(double from_s, double h_s);
  void step_onto_bends(double from_s, double h_s);
  void touch_ground();

  Swarm& swarm_;
  const Task& task_;
  const SampledFlightOptions options_;
  double period_s_;
  int position_every_, network_every_, network_late_;
  std::int64_t period_ = 0;
  bool ran_position_ = false;
  Rows rows_;                          ///< the state, unless is_changed_
  Rows start_, in_one_step_;           ///< scratch of step_onto_bends()
  mutable std::vector<double> state_;  ///< the state, vehicle by vehicle, if is_unpacked_
  mutable bool is_unpacked_ = false;
  bool is_changed_ = true;
  std::vector<VehicleInput> inputs_;
  mutable std::vector<ControlRecord> records_;
  mutable std::vector<char> is_complete_;  ///< by vehicle: whether its record is complete, see report()
  std::unique_ptr<ControllerBank> controllers_;
  std::vector<std::unique_ptr<DeepSetForce>> networks_, torque_networks_;  ///< by kind; empty: none
  std::unique_ptr<Radio> radio_;
  std::vector<Eigen::Vector3d> sent_W_m_;
  std::vector<Neighbour> known_;
  std::vector<double> weights_;
  std::vector<std::vector<Wrench>> predictions_;  ///< ring buffer, by age in network_every_ periods
  std::vector<std::vector<double>> delayed_;      ///< ring buffer of rotor commands, by age in periods
  double switch_s_ = 0;                           ///< time within a period at which delayed commands change
  bool has_delay_ = false;
  files::Random random_;
};

}  // namespace swarmcert::stability
