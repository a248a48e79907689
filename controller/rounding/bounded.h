/// @file A number type that bounds the difference between float and double over a set of inputs. Host only.
///
/// A Bounded represents two numbers over a set of inputs: the results of the float instance and of the double instance
/// of a formula. It holds an interval that contains both and a bound on the distance between them. Each operation
/// performs a standard rounding error analysis (Higham 2002, chapter 2):
///   fl(x op y) = (x op y)(1 + d) + e,  |d| <= u, |e| <= 2^-150 for float (u = 2^-24) and less for double (u = 2^-53),
///   |x_f y_f - x_d y_d| <= |x_f| |y_f - y_d| + |y_d| |x_f - x_d|,
/// and similarly for the other operations, derived there. The bounds themselves are computed in double. Each is a sum
/// of fewer than 16 rounded terms of one sign, so increasing it by 2^-48 of its value makes it an upper bound.
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "controller/scalar.h"

namespace swarmcert::controller {

/// Thrown if the outcome of a comparison depends on the position in the input set, so float and double may differ.
class Undecided : public std::runtime_error {
 public:
  Undecided() : std::runtime_error("the set of inputs reaches both sides of a comparison") {}
};

class Bounded {
 public:
  Bounded() = default;
  /// A constant in the source; the float instance rounds it to float.
  explicit Bounded(double constant)
      : lower_(constant),
        upper_(constant),
        error_(std::fabs(static_cast<double>(static_cast<float>(constant)) - constant)) {
    widen(error_);
  }
  explicit Bounded(int constant) : Bounded(static_cast<double>(constant)) {}

  /// Returns any double in [lower, upper]; the float instance gets the nearest float.
  static Bounded input(double lower, double upper) {
    Bounded b;
    b.lower_ = lower;
    b.upper_ = upper;
    b.error_ = up(kUnit * b.magnitude() + kUnderflow);
    b.widen(b.error_);
    return b;
  }
  static Bounded input(double largest) { return input(-largest, largest); }
  /// Returns numbers in [lower, upper] that differ by at most `error`.
  static Bounded of(double lower, double upper, double error) {
    Bounded b;
    b.lower_ = lower;
    b.upper_ = upper;
    b.error_ = error;
    return b;
  }

  double lower() const { return lower_; }
  double upper() const { return upper_; }
  double error() const { return error_; }
  double magnitude() const { return std::max(std::fabs(lower_), std::fabs(upper_)); }

  /// Returns the same numbers with the additional knowledge that the double one is in [lower, upper].
  Bounded within(double lower, double upper) const {
    Bounded b = *this;
    b.lower_ = std::max(lower_, lower - error_);
    b.upper_ = std::min(upper_, upper + error_);
    return b;
  }

  friend Bounded operator+(const Bounded& a, const Bounded& b) {
    return rounded_result(a.lower_ + b.lower_, a.upper_ + b.upper_, a.error_ + b.error_);
  }
  friend Bounded operator-(const Bounded& a) { return of(-a.upper_, -a.lower_, a.error_); }
  friend Bounded operator-(const Bounded& a, const Bounded& b) { return a + -b; }

  /// |x_f / y_f - x_d / y_d| = |(x_f - x_d) + (x_d / y_d)(y_d - y_f)| / |y_f|.
  friend Bounded operator/(const Bounded& a, const Bounded& b) {
    const double least = b.lower_ > 0 ? b.lower_ : b.upper_ < 0 ? -b.upper_ : 0;
    if (least == 0) throw Undecided();
    const auto [lower, upper] =
        std::minmax({a.lower_ / b.lower_, a.lower_ / b.upper_, a.upper_ / b.lower_, a.upper_ / b.upper_});
    const double largest = up(std::max(std::fabs(lower), std::fabs(upper)));
    return rounded_result(lower, upper, (a.error_ + largest * b.error_) / least);
  }

  friend bool operator<(const Bounded& a, const Bounded& b) {
    if (a.upper_ < b.lower_) return true;
    if (a.lower_ >= b.upper_) return false;
    throw Undecided();
  }
  friend bool operator>(const Bounded& a, const Bounded& b) { return b < a; }
  friend bool operator<=(const Bounded& a, const Bounded& b) { return !(b < a); }
  friend bool operator>=(const Bounded& a, const Bounded& b) { return !(a < b); }

  friend Bounded product(const Bounded& a, const Bounded& b) {
    auto [lower, upper] =
        std::minmax({a.lower_ * b.lower_, a.lower_ * b.upper_, a.upper_ * b.lower_, a.upper_ * b.upper_});
    // The product of an object with itself is nonnegative, which interval arithmetic alone would not show.
    if (&a == &b && lower < 0) lower = 0;
    return rounded_result(lower, upper, a.magnitude() * b.error_ + b.magnitude() * a.error_);
  }

  /// Uses |sqrt x_f - sqrt x_d| <= |x_f - x_d| / (2 sqrt(least)), and <= sqrt |x_f - x_d| at zero. Returns 0 for
  /// negative numbers.
  friend Bounded square_root(const Bounded& a) {
    const double lower = std::max(a.lower_, 0.0), upper = std::max(a.upper_, 0.0);
    const double near_zero = std::sqrt(a.error_);
    const double error = lower > 0 ? std::min(near_zero, a.error_ / (2 * std::sqrt(lower))) : near_zero;
    return rounded_result(std::sqrt(lower), std::sqrt(upper), error);
  }

  /// The following three functions are 1-Lipschitz in their arguments.
  friend Bounded absolute(const Bounded& a) {
    const double lower = a.lower_ > 0 ? a.lower_ : a.upper_ < 0 ? -a.upper_ : 0;
    return of(lower, a.magnitude(), a.error_);
  }
  friend Bounded clamp(const Bounded& x, const Bounded& lower, const Bounded& upper) {
    return of(std::min(std::max(x.lower_, lower.lower_), upper.lower_),
              std::min(std::max(x.upper_, lower.upper_), upper.upper_),
              std::max({x.error_, lower.error_, upper.error_}));
  }
  friend Bounded positive_part(const Bounded& x) {
    return of(std::max(x.lower_, 0.0), std::max(x.upper_, 0.0), x.error_);
  }

 private:
  static constexpr double kUnit = 0x1p-24;  ///< unit roundoff of float
  static constexpr double kDoubleUnit = 0x1p-53;
  static constexpr double kUnderflow = 0x1p-149;  ///< more than the underflow errors of both formats together

  /// Returns an upper bound on a sum of nonnegative terms that was computed in double.
  static double up(double x) { return x * (1 + 0x1p-48) + 0x1p-1070; }

  void widen(double by) {
    lower_ -= up(by + 0x1p-48 * std::fabs(lower_));
    upper_ += up(by + 0x1p-48 * std::fabs(upper_));
  }

  /// Returns the result of an operation whose exact results are in [lower, upper] and differ by at most `error`.
  static Bounded rounded_result(double lower, double upper, double error) {
    Bounded b = of(lower, upper, 0);
    const double rounding = b.magnitude() * (1 + 0x1p-48);
    b.error_ = up(error + rounding * (kUnit + kDoubleUnit) + kUnderflow);
    b.widen(rounding * kUnit + kUnderflow);
    return b;
  }

  double lower_ = 0, upper_ = 0;
  double error_ = 0;
};

}  // namespace swarmcert::controller
