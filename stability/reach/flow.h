/// @file All solutions of a differential equation from a set of states, step by step.
#pragma once

#include <functional>

#include "stability/reach/time_series.h"

namespace swarmcert::stability {

/// x' = f(x), applied to series in time.
using VectorField = std::function<std::vector<TimeSeries>(const std::vector<TimeSeries>&)>;

/// Contains x(t) for 0 <= t <= duration and every solution of x' = f(x) from a set of states.
struct FlowStep {
  /// Per state: x(t) = sum of c[k] t^k. The last c contains x^(k)/k! at all times of the step (Lagrange).
  std::vector<TimeSeries> x;
  std::vector<TimeSeries> everywhere;  ///< the Taylor coefficients at all times of the step
  Interval duration;                   ///< s

  /// Returns the states at time t, with round-off and remainders as new symbols.
  AffineVector at(Interval t) const;
};

/// Encloses the solutions over one step.
///
/// The coefficients below `order` come from the states x; the last one, c_K, from a box B that is verified to contain
/// the solutions: sum_(k < K) c_k [0, h]^k + c_K(B) [0, h]^K lies in the interior of B, so that no solution can leave B
/// (Nedialkov, Jackson, Pryce, Reliable Computing 2001). States whose coefficients are exactly 0 have B = {0}, which
/// must make their f exactly 0: then the others solve the equation with these at 0, and there is no second solution.
/// @throws std::invalid_argument if `order` is below 2.
/// @throws std::domain_error if no such B is found: the step is too long.
FlowStep flow(const VectorField& f, const AffineVector& x, Interval duration, std::size_t order);

/// Returns the field of a step that begins in the given states: a controller's outputs are held over a step.
using SampledField = std::function<VectorField(const AffineVector& start)>;

/// Encloses the solutions over `steps` steps, each from where the one before ends.
/// @throws std::domain_error as flow().
std::vector<FlowStep> reach(const SampledField& field, AffineVector x, Interval duration, int steps,
                            std::size_t order);

/// The largest or the smallest value of a state over all solutions and times.
struct Extreme {
  Interval value;        ///< contains it
  std::size_t step = 0;  ///< where it is about attained
  double time_s = 0;     ///< from the beginning of that step
};
enum class Side { kLargest, kSmallest };

/// Encloses an extreme of state i from step `first` on. Outer bound: between the ends of a cell of length d, every
/// solution is within d^2/8 max|x_i''| of its chord. Inner bound: the value at the ends of cells.
/// @param cells per step.
/// @param initial number of leading symbols that stand for initial states, each of which can occur
Extreme extreme(const std::vector<FlowStep>& steps, std::size_t first, std::size_t i, Side side, int cells,
                std::size_t initial);

}  // namespace swarmcert::stability
