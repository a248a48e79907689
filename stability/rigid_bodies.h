/// @file Equations of motion of many vehicles side by side: up to eight at a time where the processor can.
///
/// All numbers lie in rows: row r of vehicle i at [r * stride + i], the stride being the number of vehicles rounded up
/// to the widest block.
#pragma once

#include <memory>
#include <vector>

#include "stability/vehicle_state.h"

namespace swarmcert::stability {

class RigidBodies {
 public:
  /// Rows of what acts on a vehicle and of what it is.
  enum Row : int {
    kCommand = 0,       ///< four rotor commands, N
    kForce = 4,         ///< outer force in the world, N
    kTorque = 7,        ///< outer torque in the body, N m
    kMoving = 10,       ///< 1, or 0 for a vehicle that stands still but for its rotors
    kInverseMass = 11,  ///< 1/kg
    kOffset = 12,       ///< lever of a rotor about x and y, m
    kYaw = 13,          ///< torque per thrust, m
    kLagRate = 14,      ///< 1 / tau of the motors, 1/s
    kLagShare = 15,     ///< gain of the motor lag
    kInertia = 16,
    kInverseInertia = 19,
    kNumRows = 22
  };

  /// Vehicles beyond `size` up to a whole block stand still.
  explicit RigidBodies(int size);
  ~RigidBodies();

  int stride() const { return stride_; }
  double& at(int row, int vehicle) { return rows_[static_cast<std::size_t>(row * stride_ + vehicle)]; }
  double at(int row, int vehicle) const { return rows_[static_cast<std::size_t>(row * stride_ + vehicle)]; }

  /// derivative = d state / dt.
  /// @param stabilise rate in 1/s at which |q| is drawn to 1; else 0.
  void derivative(const double* state, double stabilise, double* derivative) const;

  /// One of the four stages, 0 to 3, of a classical Runge-Kutta step.
  /// @param start state before the step; the last stage makes it the state after.
  /// @param state where the next stage evaluates; read by all but the first.
  /// @param sum   scratch.
  void stage(int which, double step_s, double* start, double* state, double* sum) const;

 private:
  struct Choice;
  int size_, stride_;
  std::vector<double> rows_;
  std::unique_ptr<const Choice> choice_;  ///< of the code for this processor
};

}  // namespace swarmcert::stability
