/// @file Numbers that folding computes: exact where a double holds them, else the nearest double with an error bound.
#pragma once

#include <vector>

namespace swarmcert::files {

/// A real number within `radius` of `value`.
struct Enclosed {
  double value = 0;
  double radius = 0;  ///< 0: `value` is the number itself
};

/// The product. Exact where a double holds it.
Enclosed times(const Enclosed& a, const Enclosed& b);

/// The quotient a / b, for b.value != 0 and b.radius < |b.value|. Exact where a double holds it.
Enclosed divided(const Enclosed& a, const Enclosed& b);

/// The square root of a >= 0. Exact where a double holds it.
Enclosed square_root(const Enclosed& a);

/// A sum of numbers and products without rounding: an expansion of doubles that do not overlap (J. R. Shewchuk,
/// "Adaptive precision floating-point arithmetic", 1997). Rounded once, when it is read.
class ExactSum {
 public:
  void add(const Enclosed& a);
  void add_product(const Enclosed& a, const Enclosed& b);

  /// The sum, rounded to nearest; not finite if a partial sum exceeded the range of double.
  Enclosed value() const;

  void clear();

 private:
  void add_exactly(double x);

  std::vector<double> parts_;  ///< ascending in magnitude
  double radius_ = 0;
};

/// An upper bound of the Euclidean norm of `numbers`.
double norm_up(const std::vector<double>& numbers);

}  // namespace swarmcert::files
