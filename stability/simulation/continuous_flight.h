/// @file The continuous closed loop: flight code in double as a function of the state, the plant by SUNDIALS.
///
/// The same swarm, laws and tasks as the sampled loop, but nothing is sampled: the controller, its integrals and the
/// network's prediction follow the state at every instant. It is another system; the two differ by about 0.1 mm in a
/// transient. Integration stops at the task's knots and at events: thrust reaching its limit, an integral reaching
/// its clamp, a vehicle reaching the ground. Quaternions are pulled to unit length by the equations themselves and
/// never normalised inside the solver.
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
  double absolute_scale = 1;  ///< of 1e-9 m, 1e-8 m/s, 1e-10 (quaternion), 1e-7 rad/s, 1e-9 N, 1e-10 m s
  bool events = true;
  double battery_V = 4.1;
  double ground_m = 0.05;
};

/// Something that ended a smooth piece of the flight.
struct FlightEvent {
  enum class What { kThrustLimit, kIntegralClamp, kIntegralRelease, kGround } what;
  int vehicle;
  double time_s;
};

class ContinuousFlight {
 public:
  /// Force on a vehicle beside its effects, in the world; must be smooth between the task's knots.
  using Disturbance = std::function<Eigen::Vector3d(int vehicle, double time_s)>;

  /// @param swarm, task must outlive this.
  /// @throws std::invalid_argument if a model has a delay: a differential equation has none; files::InputError if the
  ///   network lacks a kind.
  ContinuousFlight(Swarm& swarm, const Gains& gains, const Task& task, const ContinuousFlightOptions& options,
                   const files::Network* network = nullptr, Disturbance disturbance = nullptr);
  ~ContinuousFlight();

  /// Flies on to `time_s`. @throws IntegrationError.
  void advance(double time_s);

  double time_s() const;
  /// A vehicle's state, see StateIndex.
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
  std::vector<std::size_t>
      moving_;                  ///< numbers of the state that change: without motor lag the rotors' do not
  std::vector<double> y_, dy_;  ///< all numbers: the vehicles' states, then their controllers'
  std::vector<double> at_;      ///< the state that state() shows
  std::unique_ptr<OdeIntegrator> integrator_;
};

}  // namespace swarmcert::stability
