#include "stability/simulation/continuous_flight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "stability/simulation/pilot.h"

namespace swarmcert::stability {
namespace {

// The state vector: the plant of all vehicles, then for each vehicle three position integrals and three rate integrals.
constexpr int kControllerSize = 6;
constexpr int kEventsPerVehicle = 5;  ///< thrust, three integrals, ground
constexpr double kPull_1_s = 2;       ///< keeps | |q|^2 - 1 | below 3e-8 at a tolerance of 1e-6

controller::Vector3<double> vector(const double* x) { return {x[0], x[1], x[2]}; }
controller::Vector3<double> vector(const Eigen::Vector3d& x) { return {x.x(), x.y(), x.z()}; }

}  // namespace

struct ContinuousFlight::Vehicle {
  std::shared_ptr<const Pilot<double>> pilot;
  controller::FlightMemory<double> memory;
  std::array<double, 3> limit_m_s;
  std::array<int, 3> held = {0, 0, 0};  ///< sign of the clamp at which an integral is held, 0 if it is free
};

ContinuousFlight::ContinuousFlight(Swarm& swarm, const Gains& gains, const Task& task,
                                   const ContinuousFlightOptions& options, const files::Network* network,
                                   Disturbance disturbance)
    : swarm_(swarm),
      task_(task),
      options_(options),
      disturbance_(std::move(disturbance)),
      knots_s_(task.knots_s()) {
  std::vector<std::shared_ptr<const Pilot<double>>> pilots;
  std::vector<std::string> kinds;
  for (const Model& model : swarm.models()) {
    pilots.push_back(std::make_shared<const Pilot<double>>(gains, model, 0));
    kinds.push_back(model.kind);
  }
  for (std::size_t i = 0; network != nullptr && i < kinds.size(); ++i) {
    networks_.push_back(std::make_unique<DeepSetForce>(*network, kinds[i], kinds));
  }
  const int n = swarm.size();
  std::vector<double> start(static_cast<std::size_t>(swarm.state_size() + n * kControllerSize));
  y_ = dy_ = start;
  std::vector<double> absolute(start.size(), 1e-10);
  inputs_.resize(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    if (swarm.path(i).delay_s > 0) {
      throw std::invalid_argument(
          "the continuous loop does not support delays: use the sampled loop, or omit the delay");
    }
    Vehicle& vehicle = vehicles_.emplace_back();
    vehicle.pilot = pilots[static_cast<std::size_t>(swarm.kind_of(i))];
    std::copy(gains.integrator_limit_m_s.begin(), gains.integrator_limit_m_s.end(),
              vehicle.limit_m_s.begin());
    const Setpoint setpoint = task.at(i, 0);
    double* const x = &start[static_cast<std::size_t>(i) * kVehicleStateSize];
    set_hover(swarm.model(i), setpoint.p_W_m, setpoint.v_W_m_s, x);
    double* const tolerance = &absolute[static_cast<std::size_t>(i) * kVehicleStateSize];
    std::fill(tolerance + kPosition, tolerance + kVelocity, 1e-9);
    std::fill(tolerance + kVelocity, tolerance + kQuaternion, 1e-8);
    std::fill(tolerance + kOmega, tolerance + kRotors, 1e-7);
    std::fill(tolerance + kRotors, tolerance + kVehicleStateSize, 1e-9);
    inputs_[static_cast<std::size_t>(i)].battery_V = options.battery_V;
  }
  const bool rates_are_integrated = gains.attitude_law == AttitudeLaw::kRobust;
  std::vector<double> tolerances;
  for (std::size_t k = 0; k < start.size(); ++k) {
    const bool is_plant = k < static_cast<std::size_t>(swarm.state_size());
    const std::size_t vehicle = k / kVehicleStateSize;
    const bool is_of_effect = is_plant && vehicle >= static_cast<std::size_t>(n);
    const int within =
        static_cast<int>(is_plant ? k % kVehicleStateSize
                                  : (k - static_cast<std::size_t>(swarm.state_size())) % kControllerSize);
    const bool moves =
        is_of_effect || (is_plant ? within < kRotors || swarm.path(static_cast<int>(vehicle)).motor_lag_s > 0
                                  : within < 3 || rates_are_integrated);
    if (!moves) continue;
    moving_.push_back(k);
    tolerances.push_back(absolute[k] * options.absolute_scale);
  }
  swarm.forget_neighbours();
  integrator_ = std::make_unique<OdeIntegrator>(
      options.method,
      [this](double t, const double* y, double* dy) {
        derivative(t, expand(y), dy_.data());
        for (std::size_t k = 0; k < moving_.size(); ++k) dy[k] = dy_[moving_[k]];
      },
      options.relative, tolerances);
  if (options.events) {
    integrator_->watch(n * kEventsPerVehicle,
                       [this](double t, const double* y, double* g) { watch(t, expand(y), g); });
  }
  y_ = start;  // components that never move keep these values
  this->start(0, start.data());
  at_ = start;
}

ContinuousFlight::~ContinuousFlight() = default;

double ContinuousFlight::time_s() const { return integrator_->time(); }

const double* ContinuousFlight::state(int vehicle) const { return at_.data() + vehicle * kVehicleStateSize; }

/// Expands the solver's states to the whole state vector.
const double* ContinuousFlight::expand(const double* solved) {
  for (std::size_t k = 0; k < moving_.size(); ++k) y_[moving_[k]] = solved[k];
  return y_.data();
}

void ContinuousFlight::start(double t, const double* y) {
  std::vector<double> solved(moving_.size());
  for (std::size_t k = 0; k < moving_.size(); ++k) solved[k] = y[moving_[k]];
  integrator_->start(t, solved.data());
}

long ContinuousFlight::evaluations() const { return integrator_->evaluations(); }

/// The inputs of the flight code at (t, y).
struct ContinuousFlight::Inputs {
  controller::Measured<double> measured;
  controller::FlightReference<double> reference;
  double prediction_N;

  double position_error_m(int axis) const {
    const controller::Vector3<double> error = measured.position_W_m - reference.position_W_m;
    return axis == 0 ? error.x : axis == 1 ? error.y : error.z;
  }
};

ContinuousFlight::Inputs ContinuousFlight::inputs_of(int i, double t, const double* y) {
  const double* const x = y + i * kVehicleStateSize;
  const double* const own = y + swarm_.state_size() + i * kControllerSize;
  Vehicle& vehicle = vehicles_[static_cast<std::size_t>(i)];
  const VehicleInput& input = inputs_[static_cast<std::size_t>(i)];
  const Setpoint setpoint = task_.at(i, t);
  Eigen::Matrix3d R;
  rotation_of(x + kQuaternion, &R);
  Inputs result;
  result.measured.position_W_m = vector(x + kPosition);
  result.measured.velocity_W_m_s = vector(x + kVelocity);
  result.measured.attitude = {
      {{R(0, 0), R(0, 1), R(0, 2)}, {R(1, 0), R(1, 1), R(1, 2)}, {R(2, 0), R(2, 1), R(2, 2)}},
      vector(x + kOmega)};
  result.measured.position_stamp_ms = result.measured.attitude_stamp_ms = 0;
  result.measured.battery_V = input.battery_V;
  result.reference = {
      vector(setpoint.p_W_m), vector(setpoint.v_W_m_s), vector(setpoint.a_W_m_s2), {}, {}, {}};
  vehicle.memory.integral_m_s = vector(own);
  vehicle.memory.rate_integral_rad = vector(own + 3);
  result.prediction_N =
      networks_.empty()
          ? 0
          : networks_[static_cast<std::size_t>(swarm_.kind_of(i))]->force_z_N(swarm_.instant(i, t, y, input));
  return result;
}

void ContinuousFlight::derivative(double t, const double* y, double* dy) {
  for (int i = 0; i < swarm_.size(); ++i) {
    double* const d_own = dy + swarm_.state_size() + i * kControllerSize;
    Vehicle& vehicle = vehicles_[static_cast<std::size_t>(i)];
    VehicleInput& input = inputs_[static_cast<std::size_t>(i)];
    if (disturbance_) input.disturbance_W_N = disturbance_(i, t);
    const Inputs now = inputs_of(i, t, y);
    const Pilot<double>::Push push =
        vehicle.pilot->push(vehicle.memory, now.measured, now.reference, now.prediction_N);
    for (int r = 0; r < kNumRotors; ++r) {
      input.rotor_command_N[r] = push.motors_off ? 0 : push.forces.at_N[r];
    }
    std::fill(d_own, d_own + kControllerSize, 0.0);
    if (input.resting) continue;
    for (int axis = 0; axis < 3; ++axis) {
      if (vehicle.held[static_cast<std::size_t>(axis)] == 0) d_own[axis] = now.position_error_m(axis);
    }
    const controller::Vector3<double> rate_error = vehicle.pilot->rate_error(vehicle.memory, now.measured);
    d_own[3] = rate_error.x;
    d_own[4] = rate_error.y;
    d_own[5] = rate_error.z;
  }
  swarm_.derivative(t, y, inputs_.data(), dy, kPull_1_s);
}

/// Event functions, zero where a smooth segment ends: thrust reaching its limit; an integral reaching its clamp, or the
/// error that releases it; the vehicle reaching the ground, or the thrust that lifts it off.
void ContinuousFlight::watch(double t, const double* y, double* g) {
  for (int i = 0; i < swarm_.size(); ++i) {
    const double* const x = y + i * kVehicleStateSize;
    const double* const own = y + swarm_.state_size() + i * kControllerSize;
    const Vehicle& vehicle = vehicles_[static_cast<std::size_t>(i)];
    const VehicleInput& input = inputs_[static_cast<std::size_t>(i)];
    double* const at = g + i * kEventsPerVehicle;
    const Inputs now = inputs_of(i, t, y);
    at[0] = vehicle.pilot->wanted_thrust_N(vehicle.memory, now.measured, now.reference, now.prediction_N) -
            kNumRotors * swarm_.model(i).thrust.largest_N(input.battery_V);
    for (int axis = 0; axis < 3; ++axis) {
      const auto index = static_cast<std::size_t>(axis);
      const double limit = vehicle.limit_m_s[index];
      at[1 + axis] = vehicle.held[index] != 0 ? vehicle.held[index] * now.position_error_m(axis)
                     : std::isfinite(limit)   ? limit - std::abs(own[axis])
                                              : 1;
    }
    at[4] = input.resting ? swarm_.model(i).weight_N() - swarm_.instant(i, t, y, input).thrust_N
                          : x[kPosition + 2] - options_.ground_m;
  }
}

void ContinuousFlight::meet(int event, double t, double* y) {
  const int i = event / kEventsPerVehicle, which = event % kEventsPerVehicle;
  Vehicle& vehicle = vehicles_[static_cast<std::size_t>(i)];
  double* const x = y + i * kVehicleStateSize;
  if (which == 0) {
    events_.push_back({FlightEvent::What::kThrustLimit, i, t});
    return;
  }
  if (which <= 3) {
    const auto axis = static_cast<std::size_t>(which - 1);
    double& integral = y[swarm_.state_size() + i * kControllerSize + which - 1];
    const bool was_held = vehicle.held[axis] != 0;
    events_.push_back(
        {was_held ? FlightEvent::What::kIntegralRelease : FlightEvent::What::kIntegralClamp, i, t});
    vehicle.held[axis] = was_held ? 0 : integral > 0 ? 1 : -1;
    // Exactly on its clamp; when released, slightly inside, so that the same crossing is not detected twice.
    const double limit = vehicle.limit_m_s[axis];
    integral = std::clamp(integral, -limit, limit) * (was_held ? 1 - 1e-12 : 1);
    return;
  }
  events_.push_back({FlightEvent::What::kGround, i, t});
  VehicleInput& input = inputs_[static_cast<std::size_t>(i)];
  input.resting = !input.resting;
  if (!input.resting) return;
  x[kPosition + 2] = options_.ground_m;
  std::fill(x + kVelocity, x + kQuaternion, 0.0);
  std::fill(x + kQuaternion, x + kRotors, 0.0);
  x[kQuaternion + 3] = 1;
  swarm_.rest_effects(i, y + swarm_.size() * kVehicleStateSize);
}

void ContinuousFlight::fly_to(double end_s, double limit_s) {
  // Chattering at a limit would never end; a thousand events in one segment indicate a faulty model or faulty gains.
  constexpr int kMostEvents = 1000;
  int count = 0;
  while (integrator_->time() < end_s) {
    const std::vector<int> met = integrator_->advance(end_s, limit_s);
    if (met.empty()) return;
    if (++count > kMostEvents) throw IntegrationError("more than 1000 events between two stops");
    const double t = integrator_->time();
    expand(integrator_->state());
    std::vector<double> y = y_;
    for (const int event : met) meet(event, t, y.data());
    start(t, y.data());
  }
}

void ContinuousFlight::advance(double time_s) {
  constexpr double kEver_s = 1e300;
  while (integrator_->time() < time_s) {
    const auto knot = std::upper_bound(knots_s_.begin(), knots_s_.end(), integrator_->time() + 1e-12);
    const double limit_s = knot == knots_s_.end() ? kEver_s : *knot;
    if (limit_s > time_s) {
      fly_to(time_s, limit_s);
      break;
    }
    fly_to(limit_s, limit_s);
    expand(integrator_->state());
    const std::vector<double> y = y_;
    start(limit_s, y.data());
  }
  expand(integrator_->state());
  at_ = y_;
}

}  // namespace swarmcert::stability
