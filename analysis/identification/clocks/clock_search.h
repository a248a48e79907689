/// @file Offsets of several clocks and the delay of wakes that explain most of how vehicles disturb each other.
///
/// With o_i by how much the clock of vehicle i is ahead and tau the time that a wake takes, the force on i at a reading
/// of its clock goes with where the log of j has its vehicle at that reading plus o_j - o_i - tau. Sought are the o and
/// the tau whose maps explain most of all forces together: J(o, tau). Differences of o around a circle of vehicles that
/// feel one another add up to zero, so that tau is no clock's.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "analysis/identification/clocks/clock_interplay.h"

namespace swarmcert::identification {

/// In steps of kClockStep_s.
struct ClockSteps {
  std::vector<int> clock;
  int delay = 0;
};

class ClockSearch {
 public:
  /// Two clocks that are held equal; {0, 0}: none are.
  using Tie = std::pair<int, int>;

  /// @param interplays one per vehicle, each with all others in the same order.
  /// @param clock_of each vehicle; several vehicles may share one. @param clocks how many there are
  ClockSearch(std::vector<Interplay> interplays, std::vector<int> clock_of, int clocks);

  /// J, N^2; minus infinity where two clocks are further apart than the grid. @param without a tenth; -1: none
  double value(const ClockSteps& steps, int without = -1);
  /// From the pairs of vehicles, each by itself, then of all together; without a tie also from the best of each tie.
  ClockSteps best(const Tie& tie = {0, 0});
  /// The nearest maximum.
  ClockSteps climbed(ClockSteps from, int without, const Tie& tie = {0, 0});
  /// The top of the parabola through the steps around `steps`: offsets of the clocks against the first, s.
  Eigen::VectorXd offsets_s(const ClockSteps& steps, int without);

  /// Whether what the vehicles of clock `felt` do explains a share of the force on a vehicle of `feels`.
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
  /// [vehicle][other vehicle][shift - the least shift]: explained by that one alone.
  std::vector<std::vector<std::vector<double>>> pairs_;
};

}  // namespace swarmcert::identification
