/// @file The continuous closed loop: flight code in double as a function of the state, plant integrated by SUNDIALS.
///
/// The same swarm, laws and tasks as in the sampled loop, but nothing is sampled: the controller, its integrals and the
/// network's prediction follow the state at every instant. This is a different system; in a transient the two differ by
/// about 0.1 mm. Integration stops at the task's knots and at events: thrust reaching its limit, an integral reaching
/// its clamp, a vehicle reaching the ground. The equations themselves pull the quaternions to unit length; the solver
/// never normalises them.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "nn/weights/network.h"
#include "stability/effects/deep_set_force.h"
#include "stability/gains.h"
#include "stability/simulation/ode_integrator.h"
#include "stability/simulation/swarm.h"
#include "stability/tasks/task.h"

namespace swarmcert::stability {

struct ContinuousFlightOptions {
  OdeMethod method = OdeMethod::kAdams;
  double relative = 1e-8;
  double absolute_scale = 1;  ///< times 1e-9 m, 1e-8 m/s, 1e-10 (quaternion), 1e-7 rad/s, 1e-9 N, 1e-10 m s
  bool events = true;
  double battery_V = 4.1;
  double ground_m = 0.05;
};

/// An event that ended a smooth segment of the flight.
struct FlightEvent {
  enum class What { kThrustLimit, kIntegralClamp, kIntegralRelease, kGround } what;
  int vehicle;
  double time_s;
};

class ContinuousFlight {
 public:
  /// Force on a vehicle in addition to its effects, in the world frame; must be smooth between the task's knots.
  using Disturbance = std::function<Eigen::Vector3d(int vehicle, double time_s)>;

  /// @param swarm, task must outlive this.
  /// @throws std::invalid_argument if a model has a delay, which an ordinary differential equation cannot have;
  ///     files::InputError if the network lacks a kind.
  ContinuousFlight(Swarm& swarm, const Gains& gains, const Task& task, const ContinuousFlightOptions& options,
                   const files::Network* network = nullptr, Disturbance disturbance = nullptr);
  ~ContinuousFlight();

  /// Advances the flight to `time_s`. @throws IntegrationError.
  void advance(double time_s);

  double time_s() const;
  /// Returns a vehicle's state, see StateIndex.
  const double* state(int vehicle) const;
  const std::vector<FlightEvent>& events() const { return events_; }
  long evaluations() const;

 private:
  struct Vehicle;
  struct Inputs;
  Inputs inputs_of(int vehicle, double t, const double* y);
  void derivative(double t, const double* y, double* dy);
  void watch(double t, const double* y, double* g);
  void meet(int event, double t, double* y);
  void fly_to(double end_s, double limit_s);
  const double* expand(const double* solved);
  void start(double t, const double* y);

  Swarm& swarm_;
  const Task& task_;
  const ContinuousFlightOptions options_;
  const Disturbance disturbance_;
  std::vector<double> knots_s_;
  std::vector<Vehicle> vehicles_;
  std::vector<std::unique_ptr<DeepSetForce>> networks_;  ///< by kind
  std::vector<VehicleInput> inputs_;
  std::vector<FlightEvent> events_;
  std::vector<std::size_t> moving_;  ///< the states that change: without motor lag the rotors' do not
  std::vector<double> y_, dy_;       ///< all states: the vehicles', then their controllers'
  std::vector<double> at_;           ///< the state returned by state()
  std::unique_ptr<OdeIntegrator> integrator_;
};

}  // namespace swarmcert::stability
