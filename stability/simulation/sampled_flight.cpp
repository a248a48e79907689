#include "stability/simulation/sampled_flight.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace swarmcert::stability {
namespace {

/// Returns the number of control periods per period of a slower loop.
int periods(double control_hz, double slow_hz, const char* what) {
  const double ratio = control_hz / slow_hz;
  const double whole = std::round(ratio);
  if (whole < 1 || std::abs(ratio - whole) > 1e-6 * whole) {
    throw std::invalid_argument(
        fmt::format("the rate of the {} loop, {:g} Hz, does not divide that of the attitude loop, {:g} Hz",
                    what, slow_hz, control_hz));
  }
  return static_cast<int>(whole);
}

}  // namespace

SampledFlight::SampledFlight(Swarm& swarm, const Gains& given, const Task& task,
                             const SampledFlightOptions& options, const files::Network* network)
    : swarm_(swarm), task_(task), options_(options), rows_(swarm.make_rows()), random_(options.seed) {
  Gains gains = given;
  const double control_hz = std::max(options.attitude_rate_hz, gains.rate_hz);
  if (gains.rate_hz == 0) gains.rate_hz = control_hz;
  if (gains.integrator_step_s == 0) gains.integrator_step_s = 1 / gains.rate_hz;
  period_s_ = 1 / control_hz;
  position_every_ = periods(control_hz, gains.rate_hz, "position");
  network_every_ = periods(control_hz, gains.network_rate_hz > 0 ? gains.network_rate_hz : 100, "network");
  network_late_ = static_cast<int>(std::ceil(gains.network_latency_s * control_hz - 1e-9));

  const auto size = static_cast<std::size_t>(swarm.state_size());
  state_.resize(size);
  inputs_.resize(static_cast<std::size_t>(swarm.size()));
  records_.resize(inputs_.size());
  is_complete_.resize(inputs_.size(), 1);
  for (int i = 0; i < swarm.size(); ++i) {
    const Setpoint start = task.at(i, 0);
    set_hover(swarm.model(i), start.p_W_m, start.v_W_m_s,
              &state_[static_cast<std::size_t>(i) * kVehicleStateSize]);
    input(i).resting = task.starts_on_ground();
    double* const rotors = &state_[static_cast<std::size_t>(i) * kVehicleStateSize + kRotors];
    if (input(i).resting) std::fill(rotors, rotors + kNumRotors, 0.0);
    std::copy(rotors, rotors + kNumRotors, input(i).rotor_command_N);
    std::copy(rotors, rotors + kNumRotors, records_[static_cast<std::size_t>(i)].rotor_N.begin());
  }
  controllers_ = options.flies_float ? make_float_bank(swarm, gains, period_s_)
                                     : make_double_bank(swarm, gains, period_s_);
  const files::Network* const torque_network = options.torque_network;
  if (network != nullptr || torque_network != nullptr) {
    std::vector<std::string> kinds;
    for (const Model& model : swarm.models()) kinds.push_back(model.kind);
    for (const std::string& kind : kinds) {
      if (network != nullptr) networks_.push_back(std::make_unique<DeepSetForce>(*network, kind, kinds));
      if (torque_network != nullptr) {
        torque_networks_.push_back(
            std::make_unique<DeepSetForce>(*torque_network, kind, kinds, DeepSetOutput::kTorque));
      }
    }
    radio_ = std::make_unique<Radio>(swarm.size(), network_every_ * period_s_, options.radio);
    predictions_.assign(inputs_.size(), std::vector<Wrench>(static_cast<std::size_t>(network_late_ + 1)));
  }
  int longest = 0;
  for (int i = 0; i < swarm.size(); ++i) {
    const double delay_s = swarm.path(i).delay_s;
    longest = std::max(longest, static_cast<int>(std::ceil(delay_s / period_s_)) + 1);
    has_delay_ = has_delay_ || delay_s > 0;
    const double rest_s = delay_s - std::floor(delay_s / period_s_ + 1e-9) * period_s_;
    if (rest_s > 1e-9 * period_s_) switch_s_ = std::max(switch_s_, rest_s);
  }
  delayed_.resize(inputs_.size());
  for (int i = 0; i < swarm.size(); ++i) {
    const auto& start = records_[static_cast<std::size_t>(i)].rotor_N;
    for (int age = 0; age <= longest; ++age) {
      delayed_[static_cast<std::size_t>(i)].insert(delayed_[static_cast<std::size_t>(i)].end(), start.begin(),
                                                   start.end());
    }
  }
}

SampledFlight::~SampledFlight() = default;

const double* SampledFlight::state() const {
  if (!is_unpacked_ && !is_changed_) swarm_.from_rows(rows_.data(), state_.data());
  is_unpacked_ = true;
  return state_.data();
}

double* SampledFlight::change_state() {
  state();
  is_changed_ = true;
  return state_.data();
}

const ControlRecord& SampledFlight::record(int vehicle) const {
  const auto i = static_cast<std::size_t>(vehicle);
  if (is_complete_[i] == 0) {
    controllers_->report(vehicle, &records_[i]);
    is_complete_[i] = 1;
  }
  return records_[i];
}

double SampledFlight::battery_V() const {
  return std::max(options_.battery_start_V - options_.battery_drop_V_s * time_s(), 3.2);
}

Eigen::Vector3d SampledFlight::measured_position(int vehicle) {
  const double* const x = state() + vehicle * kVehicleStateSize;
  Eigen::Vector3d p(x[0], x[1], x[2]);
  for (int axis = 0; options_.noise && axis < 3; ++axis) {
    p[axis] += swarm_.model(vehicle).sensor.position_noise_m * random_.bell();
  }
  return p;
}

/// Computes predictions from the current measurements; they are applied network_late_ periods later (zero-order hold).
void SampledFlight::predict() {
  const auto slots = static_cast<std::int64_t>(network_late_) + 1;
  const auto now_ms = static_cast<std::uint32_t>(std::llround(1e3 * time_s()));
  if (period_ % network_every_ == 0) {
    sent_W_m_.clear();
    for (int i = 0; i < swarm_.size(); ++i) sent_W_m_.push_back(measured_position(i));
    radio_->broadcast(sent_W_m_, now_ms, random_);
  }
  for (int i = 0; i < swarm_.size(); ++i) {
    std::vector<Wrench>& ring = predictions_[static_cast<std::size_t>(i)];
    Wrench& now = ring[static_cast<std::size_t>(period_ % slots)];
    if (period_ % network_every_ == 0) {
      Instant known = swarm_.instant(i, time_s(), state(), input(i));
      radio_->look(i, now_ms, &known, known_, weights_);
      const auto kind = static_cast<std::size_t>(swarm_.kind_of(i));
      now = {};
      if (!networks_.empty()) now.force_W_N.z() = networks_[kind]->force_z_N(known, weights_.data());
      if (!torque_networks_.empty())
        now.torque_B_Nm = torque_networks_[kind]->wrench(known, weights_.data()).torque_B_Nm;
    } else {
      now = ring[static_cast<std::size_t>((period_ + slots - 1) % slots)];
    }
    const std::int64_t applied = period_ - network_late_;
    const Wrench flown = applied < 0 ? Wrench() : ring[static_cast<std::size_t>(applied % slots)];
    ControlRecord& record = records_[static_cast<std::size_t>(i)];
    record.prediction_N = flown.force_W_N.z();
    record.torque_prediction_B_Nm = flown.torque_B_Nm;
    controllers_->predict(i, flown.force_W_N.z(), flown.torque_B_Nm);
  }
}

/// Passes new positions and setpoints to the position loop.
void SampledFlight::measure() {
  const auto now_ms = static_cast<std::uint32_t>(std::llround(1e3 * time_s()));
  for (int i = 0; i < swarm_.size(); ++i) {
    const double* const x = rows_.data() + row_index(i, kVehicleStateSize);
    const auto three = [x](int from) {
      return Eigen::Vector3d(x[from * kRowLength], x[(from + 1) * kRowLength], x[(from + 2) * kRowLength]);
    };
    Setpoint& setpoint = records_[static_cast<std::size_t>(i)].setpoint;
    setpoint = task_.at(i, time_s());
    Eigen::Vector3d p = three(kPosition), v = three(kVelocity);
    if (options_.noise) {
      const SensorModel& sensor = swarm_.model(i).sensor;
      for (int axis = 0; axis < 3; ++axis) {
        p[axis] += sensor.position_noise_m * random_.bell();
        v[axis] += sensor.velocity_noise_m_s * random_.bell();
      }
    }
    controllers_->see(i, p, v, now_ms);
    controllers_->follow(i, setpoint);
  }
}

void SampledFlight::control() {
  const double battery = battery_V();
  const auto now_ms = static_cast<std::uint32_t>(std::llround(1e3 * time_s()));
  if (ran_position_) measure();
  controllers_->step(rows_.data(), battery, now_ms, ran_position_, records_);
  std::fill(is_complete_.begin(), is_complete_.end(), 0);
  for (std::size_t i = 0; i < records_.size(); ++i) {
    VehicleInput& input = inputs_[i];
    ControlRecord& record = records_[i];
    input.battery_V = battery;
    // On the ground the motors are off until the task takes off, and no integral grows.
    if (input.resting) {
      controllers_->reset_integrals(static_cast<int>(i));
    }
    if (record.motors_off || (input.resting && record.setpoint.p_W_m.z() <= options_.ground_m + 1e-3)) {
      controllers_->report(static_cast<int>(i), &record);
      is_complete_[i] = 1;
      record.thrust_N = 0;
      record.rotor_N = {};
      record.pwm = {};
    }
    if (!has_delay_) std::copy(record.rotor_N.begin(), record.rotor_N.end(), input.rotor_command_N);
  }
}

void SampledFlight::advance(double from_s, double h_s) {
  is_unpacked_ = false;
  const double step_s = h_s / options_.substeps;
  if (!swarm_.may_meet_bends()) {
    swarm_.runge_kutta(from_s, step_s, options_.substeps, inputs_.data(), rows_.data());
    return;
  }
  for (int k = 0; k < options_.substeps; ++k) step_onto_bends(from_s + k * step_s, step_s);
}

/// Takes one Runge-Kutta step, split where vehicles meet bends, since a step across a bend has only second-order
/// accuracy. Vehicles that no other vehicle reaches keep the result of the full step, so that they are bitwise
/// identical to flying alone.
void SampledFlight::step_onto_bends(double from_s, double h_s) {
  constexpr int kMostCuts = 8;
  const double end_s = from_s + h_s;
  for (int cuts = 0;; ++cuts) {
    start_ = rows_;
    swarm_.runge_kutta(from_s, h_s, 1, inputs_.data(), rows_.data());
    if (cuts == 0) in_one_step_ = rows_;
    const double share = cuts < kMostCuts ? swarm_.first_bend(start_.data(), rows_.data(), h_s) : 1;
    if (share == 1) {
      if (cuts > 0) swarm_.copy_unreached(in_one_step_.data(), rows_.data());
      return;
    }
    rows_ = start_;
    swarm_.runge_kutta(from_s, share * h_s, 1, inputs_.data(), rows_.data());
    from_s += share * h_s;
    h_s = end_s - from_s;
  }
}

/// Sets the inputs to the commands after their delay: those of the late part of the period if `late`, else of the early
/// part.
void SampledFlight::apply_delayed(bool late) {
  const auto slots = static_cast<std::int64_t>(delayed_.front().size() / kNumRotors);
  for (int i = 0; i < swarm_.size(); ++i) {
    const SignalPath& path = swarm_.path(i);
    const auto& now = records_[static_cast<std::size_t>(i)].rotor_N;
    const auto whole = static_cast<std::int64_t>(std::floor(path.delay_s / period_s_ + 1e-9));
    const bool has_rest = path.delay_s - static_cast<double>(whole) * period_s_ > 1e-9 * period_s_;
    const std::int64_t age = whole + (has_rest && !late ? 1 : 0);
    const double* const then =
        &delayed_[static_cast<std::size_t>(i)]
                 [static_cast<std::size_t>((period_ + slots - age) % slots) * kNumRotors];
    for (std::size_t r = 0; r < kNumRotors; ++r) {
      input(i).rotor_command_N[r] = now[r] + path.delay_gain * (then[r] - now[r]);
    }
  }
}

/// Moves the plant by one period. With a command delay of k + r periods, the command of k + 1 periods ago acts for the
/// first fraction r of the period, that of k periods ago for the rest. If kinds have different r, all switch at the
/// largest.
void SampledFlight::move() {
  if (!has_delay_) {
    advance(time_s(), period_s_);
    return;
  }
  const auto slots = static_cast<std::int64_t>(delayed_.front().size() / kNumRotors);
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    std::copy(records_[i].rotor_N.begin(), records_[i].rotor_N.end(),
              &delayed_[i][static_cast<std::size_t>(period_ % slots) * kNumRotors]);
  }
  if (switch_s_ > 0) {
    apply_delayed(false);
    advance(time_s(), switch_s_);
  }
  apply_delayed(true);
  advance(time_s() + switch_s_, period_s_ - switch_s_);
}

/// Inelastic ground: a vehicle that descends to it stands level until thrust lifts it.
void SampledFlight::touch_ground() {
  for (int i = 0; i < swarm_.size(); ++i) {
    if (input(i).resting) {
      const double thrust_N = swarm_.instant(i, time_s(), state(), input(i)).thrust_N;
      const double lift_N = thrust_N + swarm_.effects_on(i, time_s(), state(), input(i)).force_W_N.z();
      input(i).resting = lift_N <= swarm_.model(i).weight_N();
      continue;
    }
    double* const x = rows_.data() + row_index(i, kVehicleStateSize);
    const auto at = [x](int component) -> double& { return x[component * kRowLength]; };
    if (at(kPosition + 2) > options_.ground_m || at(kVelocity + 2) >= 0) continue;
    is_unpacked_ = false;
    input(i).resting = true;
    at(kPosition + 2) = options_.ground_m;
    for (int axis = 0; axis < 3; ++axis) at(kVelocity + axis) = at(kOmega + axis) = 0;
    for (int c = 0; c < 4; ++c) at(kQuaternion + c) = c == 3 ? 1 : 0;
    swarm_.rest_effects(i, swarm_.effect_states(rows_.data()));
  }
}

void SampledFlight::step() {
  constexpr int kListEvery = 10;
  if (is_changed_) swarm_.to_rows(state_.data(), rows_.data());
  is_changed_ = false;
  if (period_ % kListEvery == 0) swarm_.find_neighbours(rows_.data(), kListEvery * period_s_);
  ran_position_ = period_ % position_every_ == 0;
  if (!predictions_.empty()) predict();
  control();
  move();
  ++period_;
  swarm_.normalise(rows_.data());
  touch_ground();
}

}  // namespace swarmcert::stability
