/// @file Equations of motion of many vehicles side by side: up to eight at a time where the processor can.
///
/// All numbers lie in rows of eight vehicles, a cache line each: see row_index(). Places are then known when the code is
/// compiled, and no register straddles two lines.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "stability/vehicle_state.h"

namespace swarmcert::stability {

inline constexpr int kRowLength = 8;

/// Where row 0 of a vehicle lies among numbers of `rows` rows; row r lies r * kRowLength further on.
inline std::size_t row_index(int vehicle, int rows) {
  return static_cast<std::size_t>(vehicle / kRowLength * rows * kRowLength + vehicle % kRowLength);
}

/// How many lines of kRowLength hold `count` numbers.
inline std::size_t lines_for(std::size_t count) { return (count + kRowLength - 1) / kRowLength; }

/// Zeros, in lines of kRowLength.
class Rows {
 public:
  explicit Rows(std::size_t lines = 1) : lines_(lines) {}
  double* data() { return lines_.data()->at; }
  const double* data() const { return lines_.data()->at; }

 private:
  struct alignas(kRowLength * sizeof(double)) Line {
    double at[kRowLength] = {};
  };
  std::vector<Line> lines_;
};

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

  double& at(int row, int vehicle) { return rows_.data()[row_index(vehicle, kNumRows) + row * kRowLength]; }

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
  int size_;
  Rows rows_;
  std::unique_ptr<const Choice> choice_;  ///< of the code for this processor
};

}  // namespace swarmcert::stability
