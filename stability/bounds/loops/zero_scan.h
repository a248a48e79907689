/// @file Norms of a smooth function given as a sequence of polynomial pieces.
#pragma once

#include <algorithm>

#include "stability/bounds/loops/impulse_response.h"

namespace swarmcert::stability {

/// Processes a function piece by piece, in order, and accumulates ResponseNorms. Each piece must be short compared with
/// the function's fastest mode: a piece may have one zero of y'', and up to two zeros of y' and of y.
class ZeroScan {
 public:
  /// @param initial_integral Y(0), where Y' = y.
  ZeroScan(double initial_integral, double y0, double slope0);

  /// Adds a piece in which y = p(u), 0 <= u <= length.
  /// @param integral_at_start Y at its start.
  void add(const Polynomial& piece, double length, double integral_at_start);

  /// Returns true if y or one of its first three derivatives (the four values at either end of a segment) changes its
  /// sign. A segment without a sign change needs no piece.
  static bool has_event(const double* at_start, const double* at_end);

  /// @param final_integral Y(oo); y and its derivatives vanish there.
  ResponseNorms finish(double final_integral) const;

  /// Returns the smallest of the numbers of zeros found of y, y' and y''.
  long least_events() const { return std::min({integrals_, values_, slopes_}); }

  /// Like finish(), if the rest of the response is a single decaying oscillation: the areas between zeros then shrink
  /// by `ratio` from one to the next and sum to a geometric series.
  ResponseNorms finish_oscillation(double final_integral, double ratio) const;

 private:
  void integral_event(double integral);
  void value_event(double y);
  void slope_event(double slope);

  ResponseNorms norms_;
  double initial_integral_;
  double last_integral_;
  double last_value_;
  double last_slope_;
  long integrals_ = 0, values_ = 0, slopes_ = 0;
  double last_area_ = 0, last_swing_ = 0, last_slope_swing_ = 0;
};

}  // namespace swarmcert::stability
