/// @file A task cut into time slices: the setpoints of the vehicles in each slice, relative to one another.
#pragma once

#include <vector>

#include "nn/base/interval.h"
#include "stability/tasks/task.h"

namespace swarmcert::analysis {

/// Setpoints of one vehicle during slices with the same setpoints. Unless noted otherwise, members enclose the
/// setpoints of these slices and of the `memory_s` before them.
struct Stretch {
  int vehicle = 0;
  std::vector<Interval>
      state;  ///< layout of learned_force.h: offsets and relative velocities, own height and velocity
  Interval acceleration_m_s2[3];      ///< a_d per axis
  Interval acceleration_now_m_s2[3];  ///< over the slices alone
  Interval jerk_m_s3[3];              ///< over the slices and the `held_s` before them
};

struct Motion {
  int vehicles = 0;
  double slice_s = 0;
  int slices = 0;
  std::vector<Stretch> stretches;            ///< without duplicates, of all vehicles
  std::vector<std::vector<int>> stretch_of;  ///< [vehicle][slice]: index into `stretches`
};

inline constexpr double kSlice_s = 0.0125;

/// Returns the longest slice length of whole periods, at most `longest_s`, that divides `duration_s`; `longest_s` if
/// there is none.
double whole_periods_s(double duration_s, double period_s, double longest_s);

/// Cuts a task into slices of at most `longest_s` that align with the task's knots if these are multiples of the slice.
/// @param memory_s maximum age of the states on which a controller may act.
/// @param held_s time for which it holds a command.
/// @returns no slices if the task has no enclosure.
Motion sliced(const stability::Task& task, int vehicles, double memory_s, double longest_s = kSlice_s,
              double held_s = 0);

}  // namespace swarmcert::analysis
