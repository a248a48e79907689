/// @file Numbers computed by folding: exact if representable as a double, else the nearest double with an error bound.
#pragma once

#include <vector>

namespace swarmcert::files {

/// A real number within `radius` of `value`.
struct Enclosed {
  double value = 0;
  double radius = 0;  ///< 0: `value` is exact
};

/// Returns the product; exact if a double can represent it.
Enclosed times(const Enclosed& a, const Enclosed& b);

/// Returns the quotient a / b, for b.value != 0 and b.radius < |b.value|; exact if a double can represent it.
Enclosed divided(const Enclosed& a, const Enclosed& b);

/// Returns the square root of a >= 0; exact if a double can represent it.
Enclosed square_root(const Enclosed& a);

/// Accumulates numbers and products without rounding, as an expansion of non-overlapping doubles (J. R. Shewchuk,
/// "Adaptive precision floating-point arithmetic", 1997). The sum is rounded once, when it is read.
class ExactSum {
 public:
  void add(const Enclosed& a);
  void add_product(const Enclosed& a, const Enclosed& b);

  /// Returns the sum, rounded to nearest; not finite if a partial sum exceeded the range of double.
  Enclosed value() const;

  void clear();

 private:
  void add_exactly(double x);

  std::vector<double> parts_;  ///< in ascending order of magnitude
  double radius_ = 0;
};

/// Returns an upper bound on the Euclidean norm of `numbers`.
double norm_up(const std::vector<double>& numbers);

}  // namespace swarmcert::files
