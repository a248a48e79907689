#include "stability/reach/affine_form.h"

#include "stability/bounds/enclosures/interval_functions.h"

namespace swarmcert::stability {
namespace {

/// Eight times the round-off of an operation, relative to the sizes of its operands; the rest covers the round-off of
/// computing these sizes, for up to 2^40 symbols.
constexpr double kRoundOff = 0x1p-50;
/// More than what products lose to underflow.
constexpr double kLostInProducts = 0x1p-900;

/// An upper bound on a sum of `terms` products of numbers that are not negative, from its value in floating point.
double above(double sum, std::size_t terms) { return sum * (1 + 0x1p-52 * static_cast<double>(terms + 16)); }

double slope_sizes(const AffineForm& x) {
  double sum = 0;
  for (const double a : x.slopes) sum += std::abs(a);
  return above(sum, x.slopes.size());
}

/// f(x) from f(c), f'(c) and f'' over all x.
AffineForm by_taylor(AffineForm x, Interval value, Interval slope, Interval bend) {
  const double most = x.deviation();
  x.centre = 0;
  return x * slope + AffineForm(value + Interval(0.5) * bend * square(Interval(0, most)));
}

Interval within_one(Interval x) { return {std::max(x.lower, -1.0), std::min(x.upper, 1.0)}; }

}  // namespace

AffineForm::AffineForm(Interval values)
    : centre(values.lower / 2 + values.upper / 2),
      radius(values.lower == values.upper ? 0
                                          : std::max(up(values.upper - centre), up(centre - values.lower))) {
  if (!std::isfinite(centre)) centre = 0, radius = kInfinity;
}

double AffineForm::deviation() const { return up(slope_sizes(*this) + radius); }

Interval AffineForm::range() const { return Interval(centre) + Interval(-deviation(), deviation()); }

Interval AffineForm::largest(std::size_t count) const {
  const AffineForm free = without_symbols_from(count);
  double most = 0;
  for (const double a : free.slopes) most += std::abs(a);
  const double error = above(free.radius + kRoundOff * static_cast<double>(count) * most, 0);
  return Interval(centre) + Interval(most) + Interval(-error, error);
}

AffineForm AffineForm::without_symbols_from(std::size_t k) const {
  AffineForm rest, kept = *this;
  if (k >= slopes.size()) return kept;
  rest.slopes.assign(slopes.begin() + static_cast<std::ptrdiff_t>(k), slopes.end());
  kept.slopes.resize(k);
  kept.radius = up(radius + slope_sizes(rest));
  return kept;
}

AffineForm symbol(std::size_t k) {
  AffineForm result;
  result.slopes.resize(k + 1);
  result.slopes[k] = 1;
  return result;
}

AffineForm operator+(const AffineForm& a, const AffineForm& b) {
  if (a.is_zero()) return b;
  if (b.is_zero()) return a;
  const bool is_longer = a.slopes.size() >= b.slopes.size();
  const AffineForm& other = is_longer ? b : a;
  AffineForm sum = is_longer ? a : b;
  sum.centre += other.centre;
  for (std::size_t k = 0; k < other.slopes.size(); ++k) sum.slopes[k] += other.slopes[k];
  sum.radius = above(a.radius + b.radius + kRoundOff * (std::abs(sum.centre) + slope_sizes(sum)), 0);
  return sum;
}

AffineForm operator-(const AffineForm& a) {
  AffineForm result = a;
  result.centre = -a.centre;
  for (double& slope : result.slopes) slope = -slope;
  return result;
}

AffineForm operator-(const AffineForm& a, const AffineForm& b) { return a + -b; }

AffineForm operator*(const AffineForm& a, const AffineForm& b) {
  if (a.is_zero() || b.is_zero()) return {};
  const double size_a = slope_sizes(a), size_b = slope_sizes(b), A = std::abs(a.centre),
               B = std::abs(b.centre);
  AffineForm product(a.centre * b.centre);
  product.slopes.resize(std::max(a.slopes.size(), b.slopes.size()));
  for (std::size_t k = 0; k < a.slopes.size(); ++k) product.slopes[k] = a.slopes[k] * b.centre;
  for (std::size_t k = 0; k < b.slopes.size(); ++k) product.slopes[k] += a.centre * b.slopes[k];
  product.radius = above(A * b.radius + B * a.radius + (size_a + a.radius) * (size_b + b.radius) +
                             kRoundOff * (A * B + A * size_b + B * size_a) + kLostInProducts,
                         0);
  if (!(product.radius < kInfinity)) return whole_line();
  return product;
}

AffineForm operator/(const AffineForm& a, const AffineForm& b) {
  const Interval all = b.range(), one(1), centre(b.centre);
  if (!all.is_positive() && !all.is_negative()) return whole_line();
  return a * by_taylor(b, one / centre, -one / (centre * centre), Interval(2) / (all * all * all));
}

AffineForm sin(const AffineForm& x) {
  if (x.is_zero()) return {};
  const Interval value = sin_of(x.centre);
  return by_taylor(x, value, cos_of(x.centre), within_one(-value + Interval(-x.deviation(), x.deviation())));
}

AffineForm cos(const AffineForm& x) {
  if (x.is_zero()) return 1;
  const Interval value = cos_of(x.centre);
  return by_taylor(x, value, -sin_of(x.centre), within_one(-value + Interval(-x.deviation(), x.deviation())));
}

AffineForm sigmoid(const AffineForm& x) {
  const Interval one(1), value = one / (one + exp(-Interval(x.centre))), all = one / (one + exp(-x.range()));
  const Interval bend = all * (one - all) * (one - all - all);
  constexpr double kMost = 0.09623;  // 1/sqrt(108), rounded up
  return by_taylor(x, value, value * (one - value),
                   {std::max(bend.lower, -kMost), std::min(bend.upper, kMost)});
}

AffineForm relu(const AffineForm& x) {
  const Interval all = x.range();
  if (all.lower >= 0) return x;
  if (all.upper <= 0) return 0;
  // For any slope in [0, 1], relu(x) - slope x is in [0, gap]: it is largest at one of the ends.
  const double slope = std::min(1.0, all.upper / (all.upper - all.lower));
  const Interval at_lower = -Interval(slope) * Interval(all.lower);
  const Interval at_upper = Interval(all.upper) - Interval(slope) * Interval(all.upper);
  return AffineForm(slope) * x + AffineForm(Interval(0, std::max(at_lower.upper, at_upper.upper)));
}

std::size_t symbols(const AffineVector& x) {
  std::size_t count = 0;
  for (const AffineForm& one : x) count = std::max(count, one.slopes.size());
  return count;
}

AffineVector with_radii_as_symbols(AffineVector x, std::size_t first) {
  for (AffineForm& one : x) {
    if (one.radius == 0) continue;
    one.slopes.resize(++first);
    std::swap(one.slopes.back(), one.radius);
  }
  return x;
}

AffineForm weighted_sum(double bias, const double* weights, const AffineVector& x) {
  AffineForm sum(bias);
  sum.slopes.resize(symbols(x));
  double sizes = std::abs(bias);
  for (std::size_t j = 0; j < x.size(); ++j) {
    const double weight = weights[j];
    sum.centre += weight * x[j].centre;
    double size = std::abs(x[j].centre) + x[j].radius;
    for (std::size_t k = 0; k < x[j].slopes.size(); ++k) {
      sum.slopes[k] += weight * x[j].slopes[k];
      size += std::abs(x[j].slopes[k]);
    }
    sizes += std::abs(weight) * size;
    sum.radius += std::abs(weight) * x[j].radius;
  }
  const std::size_t terms = x.size() + sum.slopes.size();
  sum.radius = above(
      sum.radius + kRoundOff * static_cast<double>(x.size() + 1) * above(sizes, terms) + kLostInProducts,
      terms);
  return sum;
}

}  // namespace swarmcert::stability
