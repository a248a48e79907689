/// @file Pairs of vehicles that meet, in lines of eight: what effects between vehicles need to treat many at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stability/rigid_bodies.h"

namespace swarmcert::stability {

/// Pairs of a vehicle and a neighbour, dense, and for each vehicle the places of its pairs among them.
class SwarmPairs {
 public:
  explicit SwarmPairs(int vehicles = 0) : lines_(lines_for(static_cast<std::size_t>(vehicles))) {}

  void clear() { pairs_.clear(); }
  /// The neighbours of each vehicle come one after another, in the order in which they count.
  /// @param constant Effect::pair_constant() of the neighbour.
  void add(int vehicle, int neighbour, double constant) { pairs_.push_back({vehicle, neighbour, constant}); }
  /// After the last add().
  void close();

  bool empty() const { return pairs_.empty(); }
  /// Pairs, rounded up to lines of kRowLength: those to spare are of a vehicle with itself.
  int count() const { return count_; }
  /// Where the two lie in the rows of a swarm's state: row_index(vehicle, kVehicleStateSize).
  const std::int64_t* own() const { return own_.data(); }
  const std::int64_t* other() const { return other_.data(); }
  const double* constants() const { return constants_.data(); }
  /// AlignedLines of the swarm's vehicles.
  int lines() const { return static_cast<int>(lines_); }
  /// The k-th pairs of a line's vehicles are slot k of the line: slots first_slot(line) to first_slot(line + 1).
  int first_slot(int line) const { return first_slot_[static_cast<std::size_t>(line)]; }
  /// [slots * kRowLength]: index of a pair, and all bits set; or 0 and none where a vehicle has fewer pairs.
  const std::int64_t* slots() const { return slots_.data(); }
  const std::int64_t* masks() const { return masks_.data(); }

 private:
  struct Pair {
    int vehicle, neighbour;
    double constant;
  };
  std::size_t lines_;
  std::vector<Pair> pairs_;
  int count_ = 0;
  std::vector<int> first_slot_;
  AlignedLines<std::int64_t> own_, other_, slots_, masks_;
  Rows constants_;
};

}  // namespace swarmcert::stability
