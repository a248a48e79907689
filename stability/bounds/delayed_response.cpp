// Impulse responses with a delay T, by the method of steps. With z = L^-1[1/(denominator + feedback e^(-Ts))],
//   a_n z^(n) = -sum_{k<n} a_k z^(k) - sum_j b_j z^(j)(t - T),   z^(n-1)(0+) = 1/a_n,   z = 0 for t < 0,
// and y = sum_k c_k z^(k). feedback has degree below n, so nothing but continuous pieces is ever fed back.
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "stability/bounds/response_pieces.h"
#include "stability/bounds/zero_scan.h"

namespace swarmcert::stability {
namespace {

constexpr int kTerms = 14;
/// Longest stretch in units of 1/rate: 0.4^14/14! is below rounding, and so a stretch has few zeros.
constexpr double kStretch = 0.4;
/// The response has ended where a whole second of slow time stays below this part of its peak.
constexpr double kNegligible = 1e-17;
constexpr long kMostPieces = 20'000'000;

/// Bounds the moduli of the poles of the loop without its delay (Cauchy's bound on scaled coefficients).
double rate_of(const TransferFunction& y) {
  const Polynomial total = sum(y.denominator, y.feedback);
  double rate = 0;
  const std::size_t n = total.size() - 1;
  for (std::size_t k = 0; k < n; ++k) {
    rate = std::max(rate, 2 * std::pow(std::abs(total[k] / total[n]), 1 / static_cast<double>(n - k)));
  }
  return rate;
}

/// (i + k)! / i!: what k derivatives make of the coefficient of u^(i + k).
double rising(std::size_t i, std::size_t k) {
  double result = 1;
  for (std::size_t j = 1; j <= k; ++j) result *= static_cast<double>(i + j);
  return result;
}

/// Adds `factor` times derivative `order` of p to `to`, as far as `to` reaches. No heap: this runs a million times.
void add_derivative(const Polynomial& p, std::size_t order, double factor, Polynomial& to) {
  for (std::size_t i = 0; i + order < p.size() && i < to.size(); ++i) {
    to[i] += factor * p[i + order] * rising(i, order);
  }
}

/// The first `count` derivatives of p at u, by Horner's rule for all at once.
void derivatives_at(const Polynomial& p, double u, std::size_t count, double* out) {
  std::fill(out, out + count, 0.0);
  for (std::size_t i = p.size(); i-- > 0;) {
    for (std::size_t k = count; k-- > 1;) out[k] = out[k] * u + out[k - 1];
    out[0] = out[0] * u + p[i];
  }
  for (std::size_t k = 2; k < count; ++k) out[k] *= rising(0, k);
}

class Steps {
 public:
  explicit Steps(const TransferFunction& y) : y_(y), order_(y.denominator.size() - 1) {
    per_delay_ = std::max(1, static_cast<int>(std::ceil(y.delay_s * rate_of(y) / kStretch)));
    length_ = y.delay_s / per_delay_;
    state_.assign(order_, 0.0);
    state_.back() = 1 / y.denominator[order_];
  }

  double length() const { return length_; }
  const std::vector<double>& state() const { return state_; }

  /// The next piece of y; the state is then that of its end.
  Polynomial next() {
    const std::size_t terms = order_ + kTerms;
    Polynomial z(terms, 0.0);
    double factorial = 1;
    for (std::size_t k = 0; k < order_; ++k) {
      if (k > 0) factorial *= static_cast<double>(k);
      z[k] = state_[k] / factorial;
    }
    Polynomial driven(terms, 0.0);  // sum_j b_j z^(j)(t - T)
    if (past_.size() == static_cast<std::size_t>(per_delay_)) {
      for (std::size_t j = 0; j < y_.feedback.size(); ++j) {
        add_derivative(past_.front(), j, y_.feedback[j], driven);
      }
    }
    const double leading = y_.denominator[order_];
    for (std::size_t i = 0; i + order_ < terms; ++i) {
      // Coefficient i of: leading z^(n) = -sum a_k z^(k) - driven.
      double right = -driven[i];
      for (std::size_t k = 0; k < order_; ++k) right -= y_.denominator[k] * z[i + k] * rising(i, k);
      z[i + order_] = right / (leading * rising(i, order_));
    }
    derivatives_at(z, length_, order_, state_.data());
    past_.push_back(z);
    if (past_.size() > static_cast<std::size_t>(per_delay_)) past_.pop_front();
    Polynomial result(terms, 0.0);
    for (std::size_t k = 0; k < y_.numerator.size(); ++k) add_derivative(z, k, y_.numerator[k], result);
    return result;
  }

 private:
  const TransferFunction& y_;
  std::size_t order_;
  int per_delay_ = 1;
  double length_ = 0;
  std::vector<double> state_;
  std::deque<Polynomial> past_;
};

void four_derivatives(const Polynomial& p, double u, double* out) { derivatives_at(p, u, 4, out); }

}  // namespace

ResponseNorms delayed_norms(const TransferFunction& y) {
  Steps steps(y);
  Polynomial piece = steps.next();
  double at_start[4];
  four_derivatives(piece, 0, at_start);
  ZeroScan scan(0, at_start[0], at_start[1]);
  // The slowest time that the loop can have decides how long it must stay small.
  const Polynomial total = sum(y.denominator, y.feedback);
  double slowest = std::numeric_limits<double>::infinity();
  for (const std::complex<double>& pole : poles(total)) slowest = std::min(slowest, std::abs(pole));
  const double patience_s = 2 * 3.15 / slowest + y.delay_s;
  double integral = 0;
  double error = 0;  // of the sum of the pieces (Kahan)
  double peak = 0;
  double quiet_since_s = 0;
  double t_s = 0;
  for (long i = 0; i < kMostPieces; ++i) {
    double at_end[4];
    four_derivatives(piece, 0, at_start);
    four_derivatives(piece, steps.length(), at_end);
    if (ZeroScan::has_event(at_start, at_end)) scan.add(piece, steps.length(), integral);
    double part = 0;
    for (std::size_t k = piece.size(); k-- > 0;) {
      part = (part + piece[k] / static_cast<double>(k + 1)) * steps.length();
    }
    const double corrected = part - error;
    const double next = integral + corrected;
    error = (next - integral) - corrected;
    integral = next;
    t_s += steps.length();
    peak = std::max(peak, std::abs(at_end[0]));
    if (std::abs(at_end[0]) > kNegligible * peak) quiet_since_s = t_s;
    if (t_s - quiet_since_s > patience_s) return scan.finish(integral);
    piece = steps.next();
  }
  ResponseNorms endless;
  endless.integral_abs = endless.max = endless.step_max_abs = endless.variation = endless.slope_max_abs =
      endless.curvature_integral = std::numeric_limits<double>::infinity();
  return endless;
}

std::vector<double> delayed_samples(const TransferFunction& y, double step_s, int count) {
  Steps steps(y);
  Polynomial piece = steps.next();
  double start_s = 0;
  std::vector<double> result;
  for (int i = 0; i < count; ++i) {
    const double t_s = i * step_s;
    while (t_s >= start_s + steps.length()) {
      start_s += steps.length();
      piece = steps.next();
    }
    result.push_back(value(piece, t_s - start_s));
  }
  return result;
}

}  // namespace swarmcert::stability
