#include "analysis/identification/clocks/clock_search.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "nn/base/doubles.h"

namespace swarmcert::identification {
namespace {

constexpr int kLeastShift = -kClockSteps - kWakeSteps;
/// Fraction of the variance of a vehicle's vertical force that its neighbours must explain, divided among them.
constexpr double kLeastInterplay = 0.1;

bool is_on_grid(const ClockSteps& steps) {
  const auto [low, high] = std::minmax_element(steps.clock.begin(), steps.clock.end());
  return *high - *low <= kClockSteps && steps.delay >= 0 && steps.delay <= kWakeSteps;
}

void hold(const ClockSearch::Tie& tie, ClockSteps& steps) {
  steps.clock[static_cast<std::size_t>(tie.second)] = steps.clock[static_cast<std::size_t>(tie.first)];
}

}  // namespace

ClockSearch::ClockSearch(std::vector<Interplay> interplays, std::vector<int> clock_of, int clocks)
    : interplays_(std::move(interplays)), clock_of_(std::move(clock_of)), clocks_(clocks) {}

bool ClockSearch::is_rich() const {
  return std::all_of(interplays_.begin(), interplays_.end(),
                     [](const Interplay& one) { return one.is_rich(); });
}

int ClockSearch::records() const {
  int records = 0;
  for (const Interplay& one : interplays_) records += one.size();
  return records;
}

double ClockSearch::squares_N2() const {
  double squares_N2 = 0;
  for (const Interplay& one : interplays_) squares_N2 += one.total();
  return squares_N2;
}

std::vector<int> ClockSearch::shifts_of(std::size_t vehicle, const ClockSteps& steps) const {
  std::vector<int> shifts;
  const auto offset = [&](std::size_t v) { return steps.clock[static_cast<std::size_t>(clock_of_[v])]; };
  for (std::size_t other = 0; other < interplays_.size(); ++other)
    if (other != vehicle) shifts.push_back(offset(other) - offset(vehicle) - steps.delay);
  return shifts;
}

double ClockSearch::value(const ClockSteps& steps, int without) {
  if (!is_on_grid(steps)) return -kInfinity;
  double sum = 0;
  for (std::size_t v = 0; v < interplays_.size(); ++v)
    sum += interplays_[v].explained(shifts_of(v, steps), without);
  return sum;
}

void ClockSearch::measure_pairs() {
  const std::size_t count = interplays_.size();
  pairs_.assign(count, std::vector<std::vector<double>>(count));
  for (std::size_t v = 0; v < count; ++v) {
    for (std::size_t other = 0; other < count; ++other) {
      if (other == v) continue;
      std::vector<int> shifts(count - 1, Interplay::kAbsent);
      for (int shift = kLeastShift; shift <= kClockSteps; ++shift) {
        shifts[other < v ? other : other - 1] = shift;
        pairs_[v][other].push_back(interplays_[v].explained(shifts));
      }
    }
  }
}

/// Returns what is explained by pairs of vehicles whose clocks have already been placed.
double ClockSearch::pairs_value(const ClockSteps& steps, const std::vector<char>& placed) const {
  if (!is_on_grid(steps)) return -kInfinity;
  const auto is_placed = [&](std::size_t v) { return placed[static_cast<std::size_t>(clock_of_[v])] != 0; };
  double sum = 0;
  for (std::size_t v = 0; v < pairs_.size(); ++v) {
    if (!is_placed(v)) continue;
    const std::vector<int> shifts = shifts_of(v, steps);
    for (std::size_t other = 0; other < pairs_.size(); ++other) {
      if (other == v || !is_placed(other)) continue;
      const int shift = shifts[other < v ? other : other - 1];
      sum += pairs_[v][other][static_cast<std::size_t>(shift - kLeastShift)];
    }
  }
  return sum;
}

/// Places the clock that explains most together with those already placed; `anew`: places each of them once more.
void ClockSearch::place_best(ClockSteps& steps, std::vector<char>& placed, const Tie& tie, bool anew) const {
  ClockSteps best = steps;
  int chosen = -1;
  double most = anew ? pairs_value(steps, placed) : -kInfinity;
  for (int k = 1; k < clocks_; ++k) {
    const auto at = static_cast<std::size_t>(k);
    if ((k == tie.second && tie.first != tie.second) || (placed[at] != 0) != anew) continue;
    std::vector<char> with = placed;
    with[at] = 1;
    if (k == tie.first) with[static_cast<std::size_t>(tie.second)] = 1;
    for (int o = -kClockSteps; o <= kClockSteps; ++o) {
      for (int delay = 0; delay <= kWakeSteps; ++delay) {
        ClockSteps tried = steps;
        tried.clock[at] = o;
        tried.delay = delay;
        hold(tie, tried);
        const double value = pairs_value(tried, with);
        if (!(value > most)) continue;
        most = value;
        best = tried;
        chosen = k;
      }
    }
  }
  if (chosen < 0) return;
  steps = best;
  placed[static_cast<std::size_t>(chosen)] = 1;
  if (chosen == tie.first) placed[static_cast<std::size_t>(tie.second)] = 1;
}

ClockSteps ClockSearch::best(const Tie& tie) {
  if (pairs_.empty()) measure_pairs();
  ClockSteps steps = {std::vector<int>(static_cast<std::size_t>(clocks_), 0), 0};
  std::vector<char> placed(static_cast<std::size_t>(clocks_), 0);
  placed[0] = 1;
  if (tie.first == 0) placed[static_cast<std::size_t>(tie.second)] = 1;
  for (int k = 1; k < clocks_; ++k) place_best(steps, placed, tie, false);
  for (int round = 0; round < 2 * clocks_; ++round) place_best(steps, placed, tie, true);
  steps = climbed(steps, -1, tie);
  if (tie.first != tie.second) return steps;
  // Moving one clock at a time stops below the maximum if two must move together, so also start with each two tied.
  for (int a = 0; a < clocks_; ++a) {
    for (int b = a + 1; b < clocks_; ++b) {
      const ClockSteps other = climbed(best({a, b}), -1);
      if (value(other) > value(steps)) steps = other;
    }
  }
  return steps;
}

ClockSteps ClockSearch::climbed(ClockSteps from, int without, const Tie& tie) {
  constexpr int kReach = 2;
  double most = value(from, without);
  for (bool moved = true; moved;) {
    moved = false;
    for (int k = 0; k < clocks_; ++k) {
      if (k == tie.second && tie.first != tie.second) continue;
      const ClockSteps here = from;
      for (int o = -kReach; o <= kReach; ++o) {
        for (int delay = -kReach; delay <= kReach; ++delay) {
          ClockSteps tried = here;
          // The first clock is fixed, because only differences matter; the delay is tried separately.
          tried.clock[static_cast<std::size_t>(k)] += k == 0 ? 0 : o;
          tried.delay += delay;
          hold(tie, tried);
          const double now = value(tried, without);
          if (!(now > most)) continue;
          most = now;
          from = tried;
          moved = true;
        }
      }
    }
  }
  return from;
}

Eigen::VectorXd ClockSearch::offsets_s(const ClockSteps& steps, int without) {
  // Coordinates: clocks 1, 2, ..., then the delay unless it is at an end of its range.
  const bool has_delay = steps.delay > 0 && steps.delay < kWakeSteps;
  const int n = clocks_ - 1 + (has_delay ? 1 : 0);
  const auto at = [&](int i, int di, int j, int dj) {
    ClockSteps moved = steps;
    for (const auto& [k, d] : {std::pair(i, di), std::pair(j, dj)})
      (k + 1 < clocks_ ? moved.clock[static_cast<std::size_t>(k + 1)] : moved.delay) += d;
    return value(moved, without);
  };
  const double middle = value(steps, without);
  Eigen::VectorXd slope(n);
  Eigen::MatrixXd bend(n, n);
  for (int i = 0; i < n; ++i) {
    slope(i) = (at(i, 1, i, 0) - at(i, -1, i, 0)) / 2;
    bend(i, i) = at(i, 1, i, 0) - 2 * middle + at(i, -1, i, 0);
    for (int j = 0; j < i; ++j)
      bend(i, j) = bend(j, i) = (at(i, 1, j, 1) - at(i, 1, j, -1) - at(i, -1, j, 1) + at(i, -1, j, -1)) / 4;
  }
  Eigen::VectorXd offsets_s = Eigen::VectorXd::Zero(clocks_);
  for (int k = 1; k < clocks_; ++k) offsets_s(k) = kClockStep_s * steps.clock[static_cast<std::size_t>(k)];
  if (!slope.allFinite() || !bend.allFinite()) return offsets_s;  // at the edge of the grid
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(bend);
  if (!(parts.eigenvalues().maxCoeff() < 0)) return offsets_s;
  const Eigen::VectorXd top = -bend.partialPivLu().solve(slope);
  offsets_s.tail(clocks_ - 1) += kClockStep_s * top.head(clocks_ - 1).cwiseMax(-1).cwiseMin(1);
  return offsets_s;
}

bool ClockSearch::feels(int feels, int felt, const ClockSteps& steps) {
  const double least = kLeastInterplay / static_cast<double>(interplays_.size() - 1);
  for (std::size_t v = 0; v < interplays_.size(); ++v) {
    if (clock_of_[v] != feels) continue;
    std::vector<int> shifts = shifts_of(v, steps);
    const double with = interplays_[v].explained(shifts);
    for (std::size_t other = 0; other < interplays_.size(); ++other)
      if (other != v && clock_of_[other] == felt) shifts[other < v ? other : other - 1] = Interplay::kAbsent;
    if (with - interplays_[v].explained(shifts) > least * interplays_[v].total()) return true;
  }
  return false;
}

}  // namespace swarmcert::identification
