#include "stability/bounds/enclosures/verified_delay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "nn/base/doubles.h"
#include "stability/bounds/enclosures/local_polynomial.h"

namespace swarmcert::stability {
namespace {

/// One less than the terms of a LocalPolynomial, which leaves room for the antiderivative.
constexpr std::size_t kPieceTerms = kLocalTerms - 1;
/// Longest segment in units of 1/rate.
constexpr double kLongest = 0.4;
/// The trajectory is truncated once all of x has been below this value for one delay.
constexpr double kCut = 1e-11;
/// Factor that turns sums and products of a few dozen positive doubles, rounded to nearest, into upper bounds.
constexpr double kAbove = 1 + 1e-13;

using Piece = std::array<double, kPieceTerms>;

class DelayedSteps {
 public:
  DelayedSteps(const TransferFunction& y, long most_pieces)
      : y_(y), order_(y.denominator.size() - 1), most_pieces_(most_pieces) {
    // Cauchy's bound on the poles of the loop without the delay, rounded to a power of two so that its powers are
    // exact.
    double rate = 0;
    for (std::size_t k = 0; k < order_; ++k) {
      const double a = y.denominator[k] + (k < y.feedback.size() ? y.feedback[k] : 0);
      rate = std::max(rate,
                      2 * std::pow(std::abs(a / y.denominator[order_]), 1 / static_cast<double>(order_ - k)));
    }
    unit_ = std::ldexp(1.0, static_cast<int>(std::lround(std::log2(rate / 2))));
    int halvings = 0;
    while (std::ldexp(y.delay_s, -halvings) * rate > kLongest) ++halvings;
    length_ = std::ldexp(y.delay_s, -halvings);
    per_delay_ = static_cast<std::size_t>(1) << halvings;
    for (std::size_t k = 0; k <= order_; ++k) {
      for (std::size_t i = 0; i < kPieceTerms; ++i) rising_[k][i] = rising_factorial(i, k);
    }
  }

  std::size_t order() const { return order_; }
  double length_s() const { return length_; }
  double unit_1_s() const { return unit_; }

  struct Column {
    std::vector<double> integral, most;  ///< upper bounds for |x_i|
    double residual = 0;                 ///< total variation, upper bound
  };

  /// Computes the column of X that starts at x_l = 1. Calls visit(piece) with the pieces of z.
  /// @returns nothing if it does not decay within the maximum number of pieces.
  template <class Visit>
  std::optional<Column> column(std::size_t l, Visit&& visit) const {
    Column result{std::vector<double>(order_), std::vector<double>(order_), 0};
    std::vector<Interval> at(order_);
    at[l] = std::ldexp(1.0, std::ilogb(unit_) * static_cast<int>(l));
    std::vector<Piece> past(per_delay_, Piece{});
    std::size_t newest = 0;
    std::size_t quiet = 0;
    for (long i = 0; i < most_pieces_; ++i) {
      Piece& slot = past[newest];
      newest = (newest + 1) % past.size();
      const Piece driving = slot;
      slot = next(at, driving);
      const Piece& z = slot;
      visit(z);
      double largest = 0;
      double scale = 1;
      for (std::size_t k = 0; k < order_; ++k, scale /= unit_) {
        result.residual += abs(Interval(z[k]) * Interval(rising_[k][0]) - at[k]).upper * scale * kAbove;
        const double most = most_of(z, k) * scale * kAbove;
        result.most[k] = std::max(result.most[k], most);
        result.integral[k] += most * length_ * kAbove;
        largest = std::max(largest, most);
        at[k] = value_at_end(z, k);
      }
      result.residual += missed(z, driving) * length_ * scale * unit_ * kAbove;
      if (!(largest < 1e12)) return std::nullopt;
      quiet = largest < kCut ? quiet + 1 : 0;
      if (quiet <= per_delay_) continue;
      // The truncation: all of x jumps to zero, and for one more delay the feedback of the past is missing.
      double fed_back = 0;
      double power = 1;
      for (const double b : y_.feedback) fed_back += std::abs(b) * power, power *= unit_;
      result.residual += kCut * static_cast<double>(order_) * kAbove;
      result.residual +=
          kCut * fed_back * y_.delay_s / std::abs(y_.denominator[order_]) * scale * unit_ * kAbove;
      const double rounding = 1 + 2.3e-16 * 16 * static_cast<double>(i + 8);
      result.residual *= rounding;
      for (double& x : result.integral) x *= rounding;
      return result;
    }
    return std::nullopt;
  }

  /// Returns sum_k factors[k] z^(k + shift), in intervals.
  LocalPolynomial combined(const Polynomial& factors, const Piece& z, std::size_t shift) const {
    LocalPolynomial result;
    for (std::size_t k = 0; k < factors.size(); ++k) {
      if (factors[k] == 0) continue;
      for (std::size_t i = 0; i + k + shift < kPieceTerms; ++i) {
        result.c[i] += Interval(factors[k]) * (Interval(z[i + k + shift]) * Interval(rising_[k + shift][i]));
      }
    }
    return result;
  }

 private:
  /// Returns the Taylor polynomial from approximately `at`, driven by the piece one delay earlier.
  Piece next(const std::vector<Interval>& at, const Piece& driving) const {
    Piece z{};
    for (std::size_t k = 0; k < order_; ++k)
      z[k] = (at[k].lower + (at[k].upper - at[k].lower) / 2) / rising_[k][0];
    for (std::size_t i = 0; i + order_ < kPieceTerms; ++i) {
      double right = 0;
      for (std::size_t k = 0; k < order_; ++k) right -= y_.denominator[k] * z[i + k] * rising_[k][i];
      for (std::size_t k = 0; k < y_.feedback.size() && i + k < kPieceTerms; ++k) {
        right -= y_.feedback[k] * driving[i + k] * rising_[k][i];
      }
      z[i + order_] = right / (y_.denominator[order_] * rising_[order_][i]);
    }
    return z;
  }

  /// Approximates sup |z^(k)| on the segment.
  double most_of(const Piece& z, std::size_t k) const {
    double total = 0;
    for (std::size_t i = kPieceTerms - k; i-- > 0;)
      total = total * length_ + std::abs(z[i + k]) * rising_[k][i];
    return total;
  }

  Interval value_at_end(const Piece& z, std::size_t k) const {
    Interval total;
    for (std::size_t i = kPieceTerms - k; i-- > 0;) {
      total = total * Interval(length_) + Interval(z[i + k]) * Interval(rising_[k][i]);
    }
    return total;
  }

  /// Approximates the supremum of the defect of z in z^(n) = -(sum a_k z^(k) + sum b_k driving^(k))/a_n.
  double missed(const Piece& z, const Piece& driving) const {
    double total = 0;
    for (std::size_t i = kPieceTerms; i-- > 0;) {
      Interval rest;
      for (std::size_t k = 0; k <= order_ && i + k < kPieceTerms; ++k) {
        rest += Interval(y_.denominator[k]) * (Interval(z[i + k]) * Interval(rising_[k][i]));
      }
      for (std::size_t k = 0; k < y_.feedback.size() && i + k < kPieceTerms; ++k) {
        rest += Interval(y_.feedback[k]) * (Interval(driving[i + k]) * Interval(rising_[k][i]));
      }
      total = total * length_ + rest.mag();
    }
    return total / std::abs(y_.denominator[order_]);
  }

  const TransferFunction& y_;
  std::size_t order_;
  long most_pieces_;
  double unit_ = 1, length_ = 0;  ///< 1/s, s
  std::size_t per_delay_ = 1;
  std::array<std::array<double, kPieceTerms>, kPieceTerms> rising_{};
};

/// Accumulates the norms of the approximation of y, piece by piece.
class PieceNorms {
 public:
  PieceNorms(const DelayedSteps& steps, const TransferFunction& y, Interval unit, bool integrates)
      : steps_(steps), y_(y), unit_(unit), integrates_(integrates) {}

  void operator()(const Piece& z) {
    const LocalPolynomial y = in_unit(steps_.combined(y_.numerator, z, 0));
    const LocalPolynomial slope = in_unit(steps_.combined(y_.numerator, z, 1));
    const double end = steps_.length_s();
    LocalPolynomial Y;
    Y.c[0] = sum_;
    for (std::size_t i = 0; i + 1 < Y.c.size(); ++i)
      Y.c[i + 1] = y.c[i] / Interval(static_cast<double>(i + 1));
    const auto area = [end](const LocalPolynomial& f, const LocalPolynomial& F) {
      AbsoluteIntegral integral;
      integral.add(f, F, 0, end, kLocalDepth);
      return integral.finish();
    };
    if (integrates_) {
      norms_.rate += area(y, Y);
      norms_.amplitude += area(slope, y);
      const LocalPolynomial bend = in_unit(steps_.combined(y_.numerator, z, 2));
      raise_supremum(y, slope, 0, end, kLocalDepth, least_edge_, norms_.edge);
      raise_supremum(slope, bend, 0, end, kLocalDepth, least_impulse_, norms_.impulse);
    } else {
      norms_.amplitude += area(y, Y);
      raise_supremum(Y, y, 0, end, kLocalDepth, least_edge_, norms_.edge);
      raise_supremum(y, slope, 0, end, kLocalDepth, least_impulse_, norms_.impulse);
      sum_ = Y.at(end);
    }
  }

  const VerifiedNorms& norms() const { return norms_; }

 private:
  LocalPolynomial in_unit(LocalPolynomial p) const {
    for (Interval& c : p.c) c = c * unit_;
    return p;
  }

  const DelayedSteps& steps_;
  const TransferFunction& y_;
  Interval unit_;
  bool integrates_;
  Interval sum_;  ///< int y so far
  VerifiedNorms norms_;
  double least_edge_ = 0, least_impulse_ = 0;
};

}  // namespace

std::optional<VerifiedNorms> norms_by_steps(const TransferFunction& y, bool integrates, long most_pieces) {
  if (!is_stable(y)) return std::nullopt;
  const DelayedSteps steps(y, most_pieces);
  const std::size_t n = steps.order();
  if (n + 4 > kPieceTerms || y.feedback.size() > n || y.numerator.size() + (integrates ? 1 : 0) > n) {
    return std::nullopt;
  }
  double slowest = kInfinity;  // without the delay; accurate enough to predict the number of pieces
  for (const std::complex<double>& pole : poles(sum(y.denominator, y.feedback))) {
    slowest = std::min(slowest, -pole.real());
  }
  if (!(-std::log(kCut) / slowest / steps.length_s() < static_cast<double>(most_pieces))) return std::nullopt;
  // y = numerator z, where z starts at z^(n-1) = 1/a_n, is the last column times this unit.
  const Interval unit = Interval(1) / (Interval(y.denominator[n]) *
                                       nth_power(Interval(steps.unit_1_s()), static_cast<int>(n) - 1));
  PieceNorms pieces(steps, y, unit, integrates);
  std::vector<double> integral(n);
  std::vector<double> most(n);
  double rho = 0;
  double rho_of_y = 0;
  for (std::size_t l = n; l-- > 0;) {
    const auto found = l + 1 == n ? steps.column(l, pieces) : steps.column(l, [](const Piece&) {});
    if (!found || !(found->residual < 0.5)) return std::nullopt;
    rho = std::max(rho, found->residual);
    if (l + 1 == n) rho_of_y = found->residual;
    for (std::size_t i = 0; i < n; ++i) {
      integral[i] = std::max(integral[i], found->integral[i]);
      most[i] = std::max(most[i], found->most[i]);
    }
  }
  // Bounds the error of numerator z^(shift).
  const auto error = [&](const std::vector<double>& size, std::size_t shift) {
    double total = 0;
    // Exact for a power of two.
    double power = std::ldexp(1.0, std::ilogb(steps.unit_1_s()) * static_cast<int>(shift));
    for (std::size_t k = 0; k < y.numerator.size(); ++k, power *= steps.unit_1_s()) {
      total += std::abs(y.numerator[k]) * power * size[k + shift];
    }
    return total * unit.mag() * rho_of_y / (1 - rho) * kAbove * kAbove;
  };
  const auto widened = [](Interval x, double by) {
    return Interval(std::max(0.0, down(x.lower - by)), up(x.upper + by));
  };
  VerifiedNorms norms = pieces.norms();
  const std::size_t slope = integrates ? 1 : 0;
  norms.rate = integrates ? widened(norms.rate, error(integral, 0)) : Interval(kInfinity);
  norms.edge = widened(norms.edge, integrates ? error(most, 0) : error(integral, 0));
  norms.amplitude = widened(norms.amplitude, error(integral, slope));
  norms.impulse = widened(norms.impulse, error(most, slope));
  if (!std::isfinite(norms.amplitude.upper)) return std::nullopt;
  norms.delay_gain = (norms.amplitude.upper - norms.amplitude.lower) / (2 * norms.amplitude.upper);
  return norms;
}

}  // namespace swarmcert::stability
