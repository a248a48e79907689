/// @file Searches for the clock offsets and the wake delay that best explain how vehicles disturb each other.
///
/// Let o_i be the time by which the clock of vehicle i is ahead and tau the time that a wake takes to arrive. Then the
/// force on i at a reading of its clock depends on the position of j in its log at that reading plus o_j - o_i - tau.
/// The search maximises J(o, tau), the part of all forces together that is explained by the maps. Differences of o
/// around a cycle of vehicles that feel one another add up to zero, so tau cannot be confused with a clock offset.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "analysis/identification/clocks/clock_interplay.h"

namespace swarmcert::identification {

/// Offsets and delay in steps of kClockStep_s.
struct ClockSteps {
  std::vector<int> clock;
  int delay = 0;
};

class ClockSearch {
 public:
  /// Two clocks that are constrained to be equal; {0, 0}: no constraint.
  using Tie = std::pair<int, int>;

  /// @param interplays one per vehicle, each with all others in the same order
  /// @param clock_of clock of each vehicle; several vehicles may share one
  /// @param clocks number of clocks
  ClockSearch(std::vector<Interplay> interplays, std::vector<int> clock_of, int clocks);

  /// Returns J in N^2; minus infinity if two clocks are further apart than the grid allows.
  /// @param without a tenth to leave out; -1: none
  double value(const ClockSteps& steps, int without = -1);
  /// Returns the best steps, starting from the pairs of vehicles one by one and then from all together; without a tie,
  /// also from the best result with each tie.
  ClockSteps best(const Tie& tie = {0, 0});
  /// Returns the nearest local maximum.
  ClockSteps climbed(ClockSteps from, int without, const Tie& tie = {0, 0});
  /// Returns the vertex of the parabola through the steps around `steps`: clock offsets from the first clock, s.
  Eigen::VectorXd offsets_s(const ClockSteps& steps, int without);

  /// Returns whether the vehicles of clock `felt` explain part of the force on a vehicle of clock `feels`.
  bool feels(int feels, int felt, const ClockSteps& steps);
  bool is_rich() const;
  int records() const;
  double squares_N2() const;

 private:
  std::vector<int> shifts_of(std::size_t vehicle, const ClockSteps& steps) const;
  void measure_pairs();
  double pairs_value(const ClockSteps& steps, const std::vector<char>& placed) const;
  void place_best(ClockSteps& steps, std::vector<char>& placed, const Tie& tie, bool anew) const;

  std::vector<Interplay> interplays_;
  std::vector<int> clock_of_;
  int clocks_;
  /// [vehicle][other vehicle][shift - smallest shift]: explained by that other vehicle alone.
  std::vector<std::vector<std::vector<double>>> pairs_;
};

}  // namespace swarmcert::identification
