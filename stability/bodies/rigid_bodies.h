/// @file Equations of motion of many vehicles, up to eight at a time where the processor allows.
///
/// All numbers are stored in rows of eight vehicles, one cache line each; see row_index(). Offsets are thus
/// compile-time constants, and no register load straddles two cache lines.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "stability/bodies/vehicle_state.h"

namespace swarmcert::stability {

inline constexpr int kRowLength = 8;

/// Returns the index of row 0 of a vehicle in storage with `rows` rows; row r is r * kRowLength further on.
inline std::size_t row_index(int vehicle, int rows) {
  const auto number = static_cast<std::size_t>(vehicle);
  constexpr std::size_t kLength = kRowLength;
  return number / kLength * (static_cast<std::size_t>(rows) * kLength) + number % kLength;
}

/// Returns the number of lines of kRowLength that hold `count` numbers.
inline std::size_t lines_for(std::size_t count) { return (count + kRowLength - 1) / kRowLength; }

/// Zero-initialised storage in aligned lines of kRowLength numbers.
template <typename Number>
class AlignedLines {
 public:
  explicit AlignedLines(std::size_t lines = 1) : lines_(lines) {}
  /// Grows the storage to at least `lines` lines.
  void make_room(std::size_t lines) {
    if (lines > lines_.size()) lines_.resize(lines);
  }
  Number* data() { return lines_.data()->at; }
  const Number* data() const { return lines_.data()->at; }

 private:
  struct alignas(kRowLength * sizeof(Number)) Line {
    Number at[kRowLength] = {};
  };
  std::vector<Line> lines_;
};
using Rows = AlignedLines<double>;

class RigidBodies {
 public:
  /// Rows of the forces on a vehicle and of its parameters.
  enum Row : int {
    kCommand = 0,       ///< four rotor commands, N
    kForce = 4,         ///< external force in the world, N
    kTorque = 7,        ///< external torque in the body frame, N m
    kMoving = 10,       ///< 1, or 0 for a vehicle whose state is frozen except for its rotors
    kInverseMass = 11,  ///< 1/kg
    kOffset = 12,       ///< lever of a rotor about x and y, m
    kYaw = 13,          ///< torque per thrust, m
    kLagRate = 14,      ///< 1 / tau of the motors, 1/s
    kLagShare = 15,     ///< gain of the motor lag
    kInertia = 16,
    kInverseInertia = 19,
    kLaterForceZ = 22,   ///< replaces the third kForce in the second and the last stage of look-ahead steps
    kDisturbanceZ = 23,  ///< part of the third kForce, and of kLaterForceZ, to which effects are added
    kRotorThrust = 24,   ///< sum of the rotor forces, then their torque; written by the first stage of a step
    kRotorTorque = 25,
    kNumRows = 28
  };

  /// Lanes between `size` and the end of the last block are vehicles that do not move.
  explicit RigidBodies(int size);
  ~RigidBodies();

  double& at(int row, int vehicle) { return rows_.data()[row_index(vehicle, kNumRows) + row * kRowLength]; }
  /// Returns the first line of a row; the lines of further vehicles follow every kNumRows * kRowLength numbers.
  double* row(int which) { return rows_.data() + which * kRowLength; }

  /// Sets whether some kLagRate is nonzero. Without lag, the rotor states stay as they are.
  void set_lagging(bool lags) { lags_ = lags; }
  /// Sets whether all vehicles move, in which case the stages need not test kMoving. The unused lanes then fall freely.
  void set_all_moving(bool move) { all_move_ = move; }

  /// Computes derivative = d state / dt.
  /// @param stabilise rate in 1/s at which |q| is pulled towards 1; 0: not at all.
  void derivative(const double* state, double stabilise, double* derivative) const;

  /// Computes stage `which`, 0 to 3, of a classical Runge-Kutta step.
  /// @param start state before the step; the last stage overwrites it with the state after the step.
  /// @param state where the next stage evaluates; read by all stages but the first.
  /// @param sum   scratch.
  void stage(int which, double step_s, double* start, double* state, double* sum);
  /// Computes stage `first`, 0 or 2, and the stage after it, whose external force along z is kLaterForceZ.
  void two_stages(int first, double step_s, double* start, double* state, double* sum);

  /// Sets the positions of `ahead` to those of `start` + step_s * d position / dt at `state`. This is where the stage
  /// after the one being computed will be evaluated, since positions follow velocities one stage late.
  void drift(double step_s, const double* start, const double* state, double* ahead) const;

  /// Scales the quaternions to length 1.
  void normalise(double* state) const;

 private:
  struct Choice;
  int size_;
  bool lags_ = true, all_move_ = false;
  Rows rows_;
  std::unique_ptr<const Choice> choice_;  ///< code path for this processor
};

}  // namespace swarmcert::stability
