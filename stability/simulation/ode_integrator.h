/// @file Adaptive integration with events, by SUNDIALS: the one place that knows its interface.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace swarmcert::stability {

/// Thrown where the solver gave up: nothing computed so far is a result.
struct IntegrationError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class OdeMethod {
  kBdf,        ///< CVODE, BDF with a dense Newton iteration: few evaluations, for small systems
  kAdams,      ///< CVODE, Adams with fixed-point iteration: for many states
  kRungeKutta  ///< ARKODE, explicit Dormand-Prince 5(4): a method of another family, for cross-checks
};

/// y' = f(t, y) with local error control. Not for several threads at once.
class OdeIntegrator {
 public:
  /// f: reads y [size], writes dy [size].
  using Derivative = std::function<void(double t, const double* y, double* dy)>;
  /// g: writes as many values as there are events; an event is where one changes sign.
  using Events = std::function<void(double t, const double* y, double* g)>;

  /// @param absolute tolerance of each component, [size].
  OdeIntegrator(OdeMethod method, Derivative derivative, double relative,
                const std::vector<double>& absolute);
  ~OdeIntegrator();
  OdeIntegrator(const OdeIntegrator&) = delete;
  OdeIntegrator& operator=(const OdeIntegrator&) = delete;

  /// From now on advance() stops where one of `count` values changes sign.
  void watch(int count, Events events);

  /// Starts anew from (t, y): after a jump of the derivative its history is worth nothing.
  void start(double t, const double* y);

  /// Integrates to `target`, or to the next event before it. May step beyond `target` and interpolate back, but never
  /// evaluates f beyond `limit`, where the next jump of the derivative may lie.
  /// @return the indices of the events that stopped it; empty if it reached `target`.
  /// @throws IntegrationError if the tolerances cannot be met.
  std::vector<int> advance(double target, double limit);

  double time() const;
  const double* state() const;
  /// Calls of f so far.
  long evaluations() const;

 private:
  struct Solver;
  std::unique_ptr<Solver> solver_;
};

}  // namespace swarmcert::stability
