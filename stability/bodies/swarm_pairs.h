/// @file Pairs of vehicles that are close, in groups of eight, for effects between vehicles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stability/bodies/rigid_bodies.h"

namespace swarmcert::stability {

/// Sums of some numbers that lie in lines of kRowLength: each part of a line of sums comes from one line of numbers.
class LaneSums {
 public:
  struct Part {
    alignas(kRowLength * sizeof(std::int64_t)) std::int64_t from[kRowLength] = {};  ///< places in the line
    std::int64_t mask[kRowLength] = {};  ///< all bits set, or none: 0 is added
    int line = 0;
  };

  void clear(int count);
  /// Adds number `from` to sum number `to`: in the order of calls.
  void add(int to, int from);
  int count() const { return count_; }
  const std::vector<Part>& parts(int line) const { return parts_[static_cast<std::size_t>(line)]; }

 private:
  int count_ = 0;
  std::vector<std::vector<Part>> parts_;  ///< by line of sums
};

/// Pairs of a vehicle and a neighbour.
class SwarmPairs {
 public:
  /// How to go through the pairs of one state of the swarm, or of two together. Pairs are dense, first those with each
  /// vehicle's first neighbour, then those with its second, and so on: few parts make the sums.
  class Layout {
   public:
    int states() const { return states_; }
    /// Pairs, of all states. There are numbers for whole lines of kRowLength: those to spare are of a vehicle with
    /// itself.
    int count() const { return count_; }
    int lines() const { return static_cast<int>(lines_for(static_cast<std::size_t>(count_))); }
    /// Where the two lie in the rows of a swarm's state: row_index(vehicle, kVehicleStateSize). In the second of two
    /// states, kRowLength further.
    const std::int64_t* own() const { return own_.data(); }
    const std::int64_t* other() const { return other_.data(); }
    const double* constants() const { return constants_.data(); }
    /// Of pairs' numbers, for each vehicle that has pairs.
    const LaneSums& sums() const { return sums_; }
    /// Of those sums, for each vehicle of a state: its sum, or nothing.
    const LaneSums& of_vehicles(int state) const { return of_vehicles_[state]; }

   private:
    friend class SwarmPairs;
    int states_ = 0, count_ = 0;
    AlignedLines<std::int64_t> own_, other_;
    Rows constants_;
    LaneSums sums_, of_vehicles_[2];
  };

  explicit SwarmPairs(int vehicles = 0) : vehicles_(vehicles) {}

  void clear();
  /// The neighbours of each vehicle come one after another, in the order in which they count.
  /// @param constant Effect::pair_constant() of the neighbour.
  void add(int vehicle, int neighbour, double constant);

  bool empty() const { return pairs_.empty(); }
  int count() const { return static_cast<int>(pairs_.size()); }
  /// AlignedLines of the swarm's vehicles.
  int lines() const { return static_cast<int>(lines_for(static_cast<std::size_t>(vehicles_))); }
  /// For `states` states, 1 or 2; that of one state where vehicles fill more than a line.
  const Layout& layout(int states) const;
  /// Scratch of Effect::add_force_z(), in lines of kRowLength.
  std::size_t scratch_lines() const;

 private:
  struct Pair {
    int neighbour;
    double constant;
  };
  /// A vehicle that has pairs: `count` of pairs_ from `first` on.
  struct Vehicle {
    int number, first, count;
  };
  void lay_out(int states, Layout* layout) const;

  int vehicles_;
  std::vector<Pair> pairs_;
  std::vector<Vehicle> with_pairs_;
  mutable Layout layouts_[2];  ///< for one state and for two; made when asked for
};

}  // namespace swarmcert::stability
