/// @file Effects with their own states, which the simulation integrates together with the vehicle's state.
#pragma once

#include "stability/effects/effect.h"

namespace swarmcert::stability {

/// An effect whose force depends on states with their own differential equation, such as the swing of a load. All
/// states are zero at rest. columns() is the force at rest; identification uses stream(), which computes the states
/// from the logged motion of the vehicle.
class StateEffect : public Effect {
 public:
  using Effect::Effect;
  std::unique_ptr<ColumnStream> stream(const double* shape) const override = 0;

  virtual int num_states() const = 0;

  /// Computes the wrench on the vehicle, and d states / dt. The effect may depend on the vehicle's acceleration, which
  /// in turn depends on the effect: implementations solve for both.
  /// @param others_W_N sum of all other forces on the vehicle: rotors, gravity and other effects.
  /// @param states     [num_states()].
  /// @param rates      [num_states()], overwritten.
  virtual Wrench act(const Instant& now, const Eigen::Vector3d& others_W_N, const double* coefficients,
                     const double* shape, const double* states, double* rates) const = 0;
};

}  // namespace swarmcert::stability
