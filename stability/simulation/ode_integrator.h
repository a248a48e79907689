/// @file Adaptive integration with events, by SUNDIALS; no other file uses its interface.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace swarmcert::stability {

/// Thrown when the solver fails; nothing computed so far is then a result.
struct IntegrationError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

enum class OdeMethod {
  kBdf,        ///< CVODE, BDF with a dense Newton iteration: few evaluations, for small systems
  kAdams,      ///< CVODE, Adams with fixed-point iteration: for many states
  kRungeKutta  ///< ARKODE, explicit Dormand-Prince 5(4): a different family, for cross-checks
};

/// Integrates y' = f(t, y) with local error control. Not thread-safe.
class OdeIntegrator {
 public:
  /// f: reads y [size], writes dy [size].
  using Derivative = std::function<void(double t, const double* y, double* dy)>;
  /// g: writes one value per event; an event occurs where its value changes sign.
  using Events = std::function<void(double t, const double* y, double* g)>;

  /// @param absolute tolerance of each component, [size].
  OdeIntegrator(OdeMethod method, Derivative derivative, double relative,
                const std::vector<double>& absolute);
  ~OdeIntegrator();
  OdeIntegrator(const OdeIntegrator&) = delete;
  OdeIntegrator& operator=(const OdeIntegrator&) = delete;

  /// Makes advance() stop wherever one of `count` values changes sign.
  void watch(int count, Events events);

  /// Restarts from (t, y). Required after a jump of the derivative, which invalidates the solver's history.
  void start(double t, const double* y);

  /// Integrates to `target`, or to the next event before it. May step beyond `target` and interpolate back, but never
  /// evaluates f beyond `limit`, where the next jump of the derivative may lie.
  /// @return the indices of the events at which it stopped; empty if it reached `target`.
  /// @throws IntegrationError if the tolerances cannot be met.
  std::vector<int> advance(double target, double limit);

  double time() const;
  const double* state() const;
  /// Returns the number of evaluations of f so far.
  long evaluations() const;

 private:
  struct Solver;
  std::unique_ptr<Solver> solver_;
};

}  // namespace swarmcert::stability
