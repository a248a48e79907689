#include "stability/bounds/loops/impulse_response.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/bounds/loops/response_pieces.h"

namespace swarmcert::stability {
namespace {

bool has_delay(const TransferFunction& y) { return y.delay_s > 0 && !y.feedback.empty(); }

TransferFunction without_delay(const TransferFunction& y) {
  return {y.numerator, sum(y.denominator, y.feedback), {}, 0};
}

std::complex<double> value_at(const Polynomial& p, std::complex<double> s) {
  std::complex<double> result = 0;
  for (std::size_t i = p.size(); i-- > 0;) result = result * s + p[i];
  return result;
}

/// Returns |p(jw)|^2 as a polynomial in w^2.
Polynomial squared_modulus(const Polynomial& p) {
  Polynomial real;  // in w^2
  Polynomial imaginary;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const double sign = (i / 2) % 2 == 0 ? 1 : -1;
    (i % 2 == 0 ? real : imaginary).push_back(sign * p[i]);
  }
  Polynomial result = product(real, real);
  if (!imaginary.empty()) {
    Polynomial squared = product(imaginary, imaginary);
    squared.insert(squared.begin(), 0.0);
    result = sum(result, squared);
  }
  return result;
}

/// Returns true if all zeros have negative real parts: the first column of the Routh array has constant sign.
bool all_left(const Polynomial& denominator) {
  std::vector<double> upper;  // descending powers, every second one
  std::vector<double> lower;
  for (std::size_t i = denominator.size(); i-- > 0;) {
    ((denominator.size() - 1 - i) % 2 == 0 ? upper : lower).push_back(denominator[i]);
  }
  while (!lower.empty()) {
    if (!(upper[0] > 0) || !(lower[0] > 0)) return false;
    std::vector<double> next;
    for (std::size_t k = 0; k + 1 < upper.size(); ++k) {
      next.push_back(upper[k + 1] - upper[0] / lower[0] * (k + 1 < lower.size() ? lower[k + 1] : 0));
    }
    upper = std::move(lower);
    lower = std::move(next);
  }
  return upper[0] > 0;
}

}  // namespace

double delay_margin(const Polynomial& denominator, const Polynomial& feedback) {
  if (!all_left(sum(denominator, feedback))) return 0;
  Polynomial difference = sum(squared_modulus(denominator), scaled(squared_modulus(feedback), -1));
  while (!difference.empty() && difference.back() == 0) difference.pop_back();
  double margin_s = kInfinity;
  for (const std::complex<double>& root : poles(difference)) {
    if (!(root.real() > 0) || std::abs(root.imag()) > 1e-7 * std::abs(root)) continue;
    const double w = std::sqrt(root.real());
    const std::complex<double> s(0, w);
    // denominator = -feedback e^(-jwT): the angle by which feedback must be rotated.
    double angle = std::arg(-value_at(feedback, s) / value_at(denominator, s));
    if (angle <= 0) angle += 2 * std::acos(-1.0);
    margin_s = std::min(margin_s, angle / w);
  }
  return margin_s;
}

bool is_stable(const TransferFunction& y) {
  if (!all_left(without_delay(y).denominator)) return false;
  return !has_delay(y) || y.delay_s < delay_margin(y.denominator, y.feedback);
}

ResponseNorms response_norms(const TransferFunction& y) {
  if (!is_stable(y)) {
    ResponseNorms unbounded;
    unbounded.integral = unbounded.integral_abs = unbounded.max = unbounded.step_max_abs =
        unbounded.variation = unbounded.slope_max_abs = unbounded.curvature_integral = kInfinity;
    unbounded.min = -kInfinity;
    return unbounded;
  }
  return has_delay(y) ? delayed_norms(y) : rational_norms(without_delay(y));
}

std::vector<double> sampled_response(const TransferFunction& y, double step_s, int count) {
  return has_delay(y) ? delayed_samples(y, step_s, count) : rational_samples(without_delay(y), step_s, count);
}

}  // namespace swarmcert::stability
