/// @file Equations of motion of many vehicles side by side: up to eight at a time where the processor can.
///
/// All numbers lie in rows of eight vehicles, a cache line each: see row_index(). Places are then known when the code
/// is compiled, and no register straddles two lines.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "stability/bodies/vehicle_state.h"

namespace swarmcert::stability {

inline constexpr int kRowLength = 8;

/// Where row 0 of a vehicle lies among numbers of `rows` rows; row r lies r * kRowLength further on.
inline std::size_t row_index(int vehicle, int rows) {
  const auto number = static_cast<std::size_t>(vehicle);
  constexpr std::size_t kLength = kRowLength;
  return number / kLength * (static_cast<std::size_t>(rows) * kLength) + number % kLength;
}

/// How many lines of kRowLength hold `count` numbers.
inline std::size_t lines_for(std::size_t count) { return (count + kRowLength - 1) / kRowLength; }

/// Zeros, in lines of kRowLength.
template <typename Number>
class AlignedLines {
 public:
  explicit AlignedLines(std::size_t lines = 1) : lines_(lines) {}
  /// For at least so many.
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
    kLaterForceZ = 22,  ///< in place of the third kForce in the second and the last stage of look-ahead steps
    kDisturbanceZ = 23,  ///< that part of kForce's third, and of kLaterForceZ, which effects are added to
    kRotorThrust = 24,   ///< sum of rotor forces, and their torque: left by the first stage of a step
    kRotorTorque = 25,
    kNumRows = 28
  };

  /// Vehicles beyond `size` up to a whole block stand still.
  explicit RigidBodies(int size);
  ~RigidBodies();

  double& at(int row, int vehicle) { return rows_.data()[row_index(vehicle, kNumRows) + row * kRowLength]; }
  /// A row's first line; those of further vehicles lie kNumRows * kRowLength apart.
  double* row(int which) { return rows_.data() + which * kRowLength; }

  /// Whether some kLagRate is not 0: where rotors do not lag, their states stay as they are.
  void set_lagging(bool lags) { lags_ = lags; }
  /// Whether all vehicles move: stages then need not ask which. Lanes beyond them fall freely.
  void set_all_moving(bool move) { all_move_ = move; }

  /// derivative = d state / dt.
  /// @param stabilise rate in 1/s at which |q| is drawn to 1; else 0.
  void derivative(const double* state, double stabilise, double* derivative) const;

  /// One of the four stages, 0 to 3, of a classical Runge-Kutta step.
  /// @param start state before the step; the last stage makes it the state after.
  /// @param state where the next stage evaluates; read by all but the first.
  /// @param sum   scratch.
  void stage(int which, double step_s, double* start, double* state, double* sum);
  /// Stages `first`, 0 or 2, and the next, whose outer force along z is kLaterForceZ.
  void two_stages(int first, double step_s, double* start, double* state, double* sum);

  /// Positions of `ahead` = positions of `start` + step_s * d position / dt at `state`: where the state after the one
  /// that is being computed will be evaluated, since positions follow velocities one stage late.
  void drift(double step_s, const double* start, const double* state, double* ahead) const;

  /// Quaternions of length 1.
  void normalise(double* state) const;

 private:
  struct Choice;
  int size_;
  bool lags_ = true, all_move_ = false;
  Rows rows_;
  std::unique_ptr<const Choice> choice_;  ///< of the code for this processor
};

}  // namespace swarmcert::stability
