/// @file Pairs of nearby vehicles, in groups of eight, for effects between vehicles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stability/bodies/rigid_bodies.h"

namespace swarmcert::stability {

/// Gather-and-add plan in lines of kRowLength: each part of a line of sums takes its terms from one line of numbers.
class LaneSums {
 public:
  struct Part {
    alignas(kRowLength * sizeof(std::int64_t)) std::int64_t from[kRowLength] = {};  ///< positions in the line
    std::int64_t mask[kRowLength] = {};  ///< all bits set, or none, in which case 0 is added
    int line = 0;
  };

  void clear(int count);
  /// Adds number `from` to sum number `to`. Terms are added in the order of the calls.
  void add(int to, int from);
  int count() const { return count_; }
  const std::vector<Part>& parts(int line) const { return parts_[static_cast<std::size_t>(line)]; }

 private:
  int count_ = 0;
  std::vector<std::vector<Part>> parts_;  ///< by line of sums
};

/// Pairs of a vehicle and one of its neighbours.
class SwarmPairs {
 public:
  /// Traversal order of the pairs of one state of the swarm, or of two states together. The pairs are dense: first
  /// those with each vehicle's first neighbour, then those with its second, and so on, so that few parts make up the
  /// sums.
  class Layout {
   public:
    int states() const { return states_; }
    /// Number of pairs of all states. The arrays cover whole lines of kRowLength; the padding pairs a vehicle with
    /// itself.
    int count() const { return count_; }
    int lines() const { return static_cast<int>(lines_for(static_cast<std::size_t>(count_))); }
    /// Index of the two vehicles in the rows of a swarm's state: row_index(vehicle, kVehicleStateSize). For the second
    /// of two states, kRowLength more.
    const std::int64_t* own() const { return own_.data(); }
    const std::int64_t* other() const { return other_.data(); }
    const double* constants() const { return constants_.data(); }
    /// Sums over the pairs of each vehicle that has pairs.
    const LaneSums& sums() const { return sums_; }
    /// Maps those sums to the vehicles of a state: each vehicle gets its sum, or nothing.
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
  /// Adds a pair. The neighbours of a vehicle must be added one after another, in the order of summation.
  /// @param constant Effect::pair_constant() of the neighbour.
  void add(int vehicle, int neighbour, double constant);

  bool empty() const { return pairs_.empty(); }
  int count() const { return static_cast<int>(pairs_.size()); }
  /// Number of lines for the swarm's vehicles; see AlignedLines.
  int lines() const { return static_cast<int>(lines_for(static_cast<std::size_t>(vehicles_))); }
  /// Returns the layout for `states` states, 1 or 2; the layout of one state if the vehicles fill more than one line.
  const Layout& layout(int states) const;
  /// Size of the scratch memory of Effect::add_force_z(), in lines of kRowLength.
  std::size_t scratch_lines() const;

 private:
  struct Pair {
    int neighbour;
    double constant;
  };
  /// A vehicle that has pairs: `count` entries of pairs_ starting at `first`.
  struct Vehicle {
    int number, first, count;
  };
  void lay_out(int states, Layout* layout) const;

  int vehicles_;
  std::vector<Pair> pairs_;
  std::vector<Vehicle> with_pairs_;
  mutable Layout layouts_[2];  ///< for one state and for two; built on demand
};

}  // namespace swarmcert::stability
