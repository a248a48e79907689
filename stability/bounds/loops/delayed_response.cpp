// Impulse responses with a delay T, by the method of steps. With z = L^-1[1/(denominator + feedback e^(-Ts))],
//   a_n z^(n) = -sum_{k<n} a_k z^(k) - sum_j b_j z^(j)(t - T),   z^(n-1)(0+) = 1/a_n,   z = 0 for t < 0,
// and y = sum_k c_k z^(k). The degree of `feedback` is below n, so only continuous functions are fed back.
#include <algorithm>
#include <cmath>
#include <limits>

#include "stability/bounds/loops/response_pieces.h"
#include "stability/bounds/loops/zero_scan.h"

namespace swarmcert::stability {
namespace {

constexpr int kTerms = 14;
/// Longest segment in units of 1/rate: 0.4^14/14! is below round-off, and a segment this short has few zeros.
constexpr double kStretch = 0.4;
/// The response has ended when it stays below this fraction of its peak for a whole period of the slowest mode.
constexpr double kNegligible = 1e-17;
/// A slow mode is considered alone when nothing else exceeds this fraction of the peak. Round-off errors are smaller.
constexpr double kHidden = 1e-11;
constexpr long kMostPieces = 20'000'000;

/// Returns a bound on the moduli of the poles of the loop without its delay (Cauchy's bound on scaled coefficients).
double rate_of(const TransferFunction& y) {
  const Polynomial total = sum(y.denominator, y.feedback);
  double rate = 0;
  const std::size_t n = total.size() - 1;
  for (std::size_t k = 0; k < n; ++k) {
    rate = std::max(rate, 2 * std::pow(std::abs(total[k] / total[n]), 1 / static_cast<double>(n - k)));
  }
  return rate;
}

/// A real mode c e^(st) of y that is slower than all others; c = 0: there is none.
struct SlowMode {
  double s = 0, c = 0;
  double others_1_s = 0;  ///< smallest modulus of the other poles, of the loop without its delay

  double at(double t_s) const { return c == 0 ? 0 : c * std::exp(s * t_s); }
};

/// Finds the slow mode by Newton's method on D(s) = denominator + feedback e^(-Ts), starting from the slowest pole
/// without delay; c is the residue numerator/D' there.
SlowMode slow_mode(const TransferFunction& y) {
  SlowMode mode;
  std::vector<std::complex<double>> all = poles(sum(y.denominator, y.feedback));
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return std::abs(a) < std::abs(b); });
  if (all.size() < 2 || all[0].imag() != 0 || !(all[0].real() < 0)) return mode;
  mode.others_1_s = std::abs(all[1]);
  const Polynomial denominator_slope = derivative_of(y.denominator),
                   feedback_slope = derivative_of(y.feedback);
  double s = all[0].real();
  for (int i = 0; i < 50 && s < 0; ++i) {
    const double late = std::exp(-y.delay_s * s);
    const double f = value(y.denominator, s) + value(y.feedback, s) * late;
    const double slope =
        value(denominator_slope, s) + (value(feedback_slope, s) - y.delay_s * value(y.feedback, s)) * late;
    const double next = s - f / slope;
    if (std::abs(next - s) <= 1e-15 * std::abs(s)) {
      mode.s = next;
      mode.c = value(y.numerator, next) / slope;
      break;
    }
    s = next;
  }
  return mode;
}

/// Computes the first `count` derivatives of p at u, all at once by Horner's rule.
void derivatives_at(const Polynomial& p, double u, std::size_t count, double* out) {
  std::fill(out, out + count, 0.0);
  for (std::size_t i = p.size(); i-- > 0;) {
    for (std::size_t k = count; k-- > 1;) out[k] = out[k] * u + out[k - 1];
    out[0] = out[0] * u + p[i];
  }
  for (std::size_t k = 2; k < count; ++k) out[k] *= rising_factorial(0, k);
}

class Steps {
 public:
  explicit Steps(const TransferFunction& y)
      : y_(y), order_(y.denominator.size() - 1), terms_(order_ + kTerms) {
    per_delay_ = std::max(1, static_cast<int>(std::ceil(y.delay_s * rate_of(y) / kStretch)));
    length_ = y.delay_s / per_delay_;
    state_.assign(order_, 0.0);
    state_.back() = 1 / y.denominator[order_];
    past_.assign(static_cast<std::size_t>(per_delay_), Polynomial(terms_, 0.0));
    driven_.assign(terms_, 0.0);
    result_.assign(terms_, 0.0);
    for (std::size_t k = 0; k <= order_; ++k) {
      for (std::size_t i = 0; i < terms_; ++i) rising_.push_back(rising_factorial(i, k));
    }
  }

  double length() const { return length_; }

  /// Returns the next piece of y, valid until the next call. Does not allocate, since it runs a million times.
  const Polynomial& next() {
    // The oldest piece of z drives the new one, which then overwrites it.
    Polynomial& z = past_[newest_];
    newest_ = (newest_ + 1) % past_.size();
    combine(y_.feedback, z, driven_);
    std::fill(z.begin(), z.end(), 0.0);
    double factorial = 1;
    for (std::size_t k = 0; k < order_; ++k) {
      if (k > 0) factorial *= static_cast<double>(k);
      z[k] = state_[k] / factorial;
    }
    const double* const highest = rising_of(order_);
    for (std::size_t i = 0; i + order_ < terms_; ++i) {
      // Coefficient i of: leading z^(n) = -sum a_k z^(k) - driven.
      double right = -driven_[i];
      for (std::size_t k = 0; k < order_; ++k) right -= y_.denominator[k] * z[i + k] * rising_of(k)[i];
      z[i + order_] = right / (y_.denominator[order_] * highest[i]);
    }
    derivatives_at(z, length_, order_, state_.data());
    combine(y_.numerator, z, result_);
    return result_;
  }

 private:
  /// Returns (i + k)! / i!, indexed by i.
  const double* rising_of(std::size_t k) const { return rising_.data() + k * terms_; }

  /// to = sum_k factors[k] p^(k)
  void combine(const Polynomial& factors, const Polynomial& p, Polynomial& to) const {
    std::fill(to.begin(), to.end(), 0.0);
    for (std::size_t k = 0; k < factors.size(); ++k) {
      if (factors[k] == 0) continue;
      for (std::size_t i = 0; i + k < terms_; ++i) to[i] += factors[k] * p[i + k] * rising_of(k)[i];
    }
  }

  const TransferFunction& y_;
  std::size_t order_, terms_;
  int per_delay_ = 1;
  double length_ = 0;
  std::vector<double> state_, rising_;
  std::vector<Polynomial> past_;  ///< ring buffer: the pieces of z over one delay, zero before the start
  std::size_t newest_ = 0;
  Polynomial driven_, result_;
};

void four_derivatives(const Polynomial& p, double u, double* out) { derivatives_at(p, u, 4, out); }

}  // namespace

ResponseNorms delayed_norms(const TransferFunction& y) {
  Steps steps(y);
  double at_start[4], at_end[4];
  const Polynomial* piece = &steps.next();
  four_derivatives(*piece, 0, at_start);
  ZeroScan scan(0, at_start[0], at_start[1]);
  // The slowest time constant of the loop determines how long the response must stay small.
  const Polynomial total = sum(y.denominator, y.feedback);
  double slowest = std::numeric_limits<double>::infinity();
  for (const std::complex<double>& pole : poles(total)) slowest = std::min(slowest, std::abs(pole));
  const double patience_s = 2 * 3.15 / slowest + y.delay_s;
  // Once only a slow real mode is left, no more pieces are needed: its integral is known in closed form. Other modes
  // may be hidden near their zero crossings, but not for this long.
  const SlowMode slow = slow_mode(y);
  const double alone_s = y.delay_s + 2 / slow.others_1_s;
  double alone_since_s = 0;
  double steepest = 0;
  std::vector<double> over(piece->size());
  for (std::size_t k = 0; k < over.size(); ++k) over[k] = 1 / static_cast<double>(k + 1);
  double integral = 0;
  double error = 0;  // of the sum of the pieces (Kahan)
  double peak = 0;
  double quiet_since_s = 0;
  double t_s = 0;
  for (long i = 0; i < kMostPieces; ++i) {
    four_derivatives(*piece, 0, at_start);
    four_derivatives(*piece, steps.length(), at_end);
    if (ZeroScan::has_event(at_start, at_end)) scan.add(*piece, steps.length(), integral);
    double part = 0;
    for (std::size_t k = piece->size(); k-- > 0;) part = (part + (*piece)[k] * over[k]) * steps.length();
    const double corrected = part - error;
    const double next = integral + corrected;
    error = (next - integral) - corrected;
    integral = next;
    t_s += steps.length();
    peak = std::max(peak, std::abs(at_end[0]));
    if (std::abs(at_end[0]) > kNegligible * peak) quiet_since_s = t_s;
    if (t_s - quiet_since_s > patience_s) return scan.finish(integral);
    if (slow.c != 0) {
      steepest = std::max(steepest, std::abs(at_end[1]));
      const double left = slow.at(t_s);
      if (!(std::abs(at_end[0] - left) <= kHidden * peak &&
            std::abs(at_end[1] - slow.s * left) <= kHidden * steepest)) {
        alone_since_s = t_s;
      }
      if (t_s - alone_since_s > alone_s) return scan.finish(integral - left / slow.s);
    }
    piece = &steps.next();
  }
  ResponseNorms endless;
  endless.integral_abs = endless.max = endless.step_max_abs = endless.variation = endless.slope_max_abs =
      endless.curvature_integral = std::numeric_limits<double>::infinity();
  return endless;
}

std::vector<double> delayed_samples(const TransferFunction& y, double step_s, int count) {
  Steps steps(y);
  const Polynomial* piece = &steps.next();
  double start_s = 0;
  std::vector<double> result;
  for (int i = 0; i < count; ++i) {
    const double t_s = i * step_s;
    while (t_s >= start_s + steps.length()) {
      start_s += steps.length();
      piece = &steps.next();
    }
    result.push_back(value(*piece, t_s - start_s));
  }
  return result;
}

}  // namespace swarmcert::stability
