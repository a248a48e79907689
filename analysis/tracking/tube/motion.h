/// @file A task cut into slices of time: where vehicles should be in each, relative to one another.
#pragma once

#include <vector>

#include "nn/base/interval.h"
#include "stability/tasks/task.h"

namespace swarmcert::analysis {

/// What one vehicle should do during slices that ask for the same: everything encloses the set points of these slices
/// and of `memory_s` before them, where nothing else is said.
struct Stretch {
  int vehicle = 0;
  std::vector<Interval>
      state;  ///< see learned_force.h: offsets and relative velocities, own height and velocity
  Interval acceleration_m_s2[3];                   ///< a_d per axis
  Interval acceleration_now_m_s2[3];               ///< of the slices alone
  Interval jerk_m_s3[3];                           ///< of the slices and of `held_s` before them
  std::vector<double> relative_acceleration_m_s2;  ///< per neighbour, largest |a_j - a|
};

struct Motion {
  int vehicles = 0;
  double slice_s = 0;
  int slices = 0;
  std::vector<Stretch> stretches;            ///< each once, of all vehicles
  std::vector<std::vector<int>> stretch_of;  ///< [vehicle][slice]: index into `stretches`
};

inline constexpr double kSlice_s = 0.0125;

/// The longest slices of whole periods, at most `longest_s`, that divide `duration_s`; `longest_s` where there are
/// none.
double whole_periods_s(double duration_s, double period_s, double longest_s);

/// Slices of at most `longest_s` that begin and end with the task's knots where these are multiples of it.
/// @param memory_s how old the states are that a controller may act upon.
/// @param held_s for how long it holds a command.
/// @returns no slices where the task has no enclosure.
Motion sliced(const stability::Task& task, int vehicles, double memory_s, double longest_s = kSlice_s,
              double held_s = 0);

}  // namespace swarmcert::analysis
