/// @file The map from one period of a sampled loop to the next, enclosed in integers. Not for users.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "stability/checker/fixed_point.h"
#include "stability/checker/sampled_gain_bounds.h"

namespace swarmcert::check {

/// An interval with fixed-point endpoints.
struct FixedRange {
  Integer lower, upper;

  FixedRange() = default;
  explicit FixedRange(const Rational& x) : lower(floor_fixed(x)), upper(ceil_fixed(x)) {}
  explicit FixedRange(const Integer& fixed) : lower(fixed), upper(fixed) {}
  void add(const FixedRange& other) { lower += other.lower, upper += other.upper; }
  void add_product(const FixedRange& a, const FixedRange& b) {
    const std::array<Integer, 4> ends = {a.lower * b.lower, a.lower * b.upper, a.upper * b.lower,
                                         a.upper * b.upper};
    lower += *std::min_element(ends.begin(), ends.end()) >> kBits;
    upper += (*std::max_element(ends.begin(), ends.end()) >> kBits) + 1;
  }
  Integer middle() const { return (lower + upper) >> 1; }
  Integer magnitude() const { return std::max<Integer>(abs(lower), abs(upper)); }
};
using FixedRangeRow = std::vector<FixedRange>;
using FixedRanges = std::vector<FixedRangeRow>;

/// Layout of the state before the control of a period: e, e', lag outputs, the integral, past commands (newest first).
/// After the control, the new command precedes the past ones.
struct SampledLayout {
  std::size_t plant = 0, command = 0, past = 0, newest = 0;
  Rational shift_s;  ///< part of a period during which the older command still acts

  explicit SampledLayout(const SampledWitness& loop);
  std::size_t size() const { return command + past; }
};

/// Returns the map from the state before to the state after the control, [size + 1 x size].
Square control_of(const SampledWitness& loop, const SampledLayout& at);
/// Returns the map from the state after the control to the state before the next period's control, [size x size + 1].
/// @throws std::runtime_error if a lag is too short compared with the period.
FixedRanges hold_of(const SampledWitness& loop, const SampledLayout& at);
/// Returns hold * control.
FixedRanges period_ranges(const FixedRanges& hold, const Square& control);

/// The map M, and the norm |r| = sqrt(r P r') of rows over its states.
struct PeriodMap {
  std::size_t n = 0;
  FixedRanges M;
  std::vector<Integer> middle;  ///< of M, row by row
  Integer spread;               ///< every entry of M is within this of `middle`
  Square P;
  std::vector<Integer> scaled_P;    ///< over 2^kFormBits
  Integer from_largest;             ///< |r| <= this times the largest |r_i|
  std::vector<Integer> coordinate;  ///< |r_i| <= this times |r|
  Rational gap;                     ///< 1 - contraction

  /// @throws std::runtime_error unless P proves that |r M| <= contraction |r| for every M in the ranges.
  PeriodMap(const SampledWitness& loop, FixedRanges map);

 private:
  void enclose_middle();
  void measure_norm();
  void check_contraction(const Rational& factor) const;
};

}  // namespace swarmcert::check
