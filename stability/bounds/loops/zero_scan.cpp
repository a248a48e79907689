#include "stability/bounds/loops/zero_scan.h"

#include <algorithm>
#include <cmath>

namespace swarmcert::stability {
namespace {

double integral_to(const Polynomial& p, double u) {
  double result = 0;
  for (std::size_t i = p.size(); i-- > 0;) result = (result + p[i] / static_cast<double>(i + 1)) * u;
  return result;
}

bool changes_sign(double a, double b) { return (a < 0 && b > 0) || (a > 0 && b < 0); }

/// Finds the zero of p in (from, to), where p changes sign: bisection until no double is left inside the bracket.
double zero(const Polynomial& p, double from, double to) {
  const bool rises = value(p, from) < 0;
  for (int i = 0; i < 200; ++i) {
    const double middle = from + (to - from) / 2;
    if (middle <= from || middle >= to) break;
    ((value(p, middle) < 0) == rises ? from : to) = middle;
  }
  return from + (to - from) / 2;
}

/// Returns the zeros of p in (0, length) at which the sign changes, given those of its derivative.
std::vector<double> zeros(const Polynomial& p, double length, const std::vector<double>& extrema) {
  std::vector<double> result;
  double from = 0;
  std::vector<double> ends = extrema;
  ends.push_back(length);
  for (const double to : ends) {
    if (changes_sign(value(p, from), value(p, to))) result.push_back(zero(p, from, to));
    from = to;
  }
  return result;
}

}  // namespace

ZeroScan::ZeroScan(double initial_integral, double y0, double slope0)
    : initial_integral_(initial_integral),
      last_integral_(initial_integral),
      last_value_(y0),
      last_slope_(slope0) {
  norms_.max = std::max(0.0, y0);
  norms_.min = std::min(0.0, y0);
  norms_.slope_max_abs = std::abs(slope0);
}

bool ZeroScan::has_event(const double* at_start, const double* at_end) {
  for (int k = 0; k < 4; ++k) {
    if (changes_sign(at_start[k], at_end[k])) return true;
  }
  return false;
}

void ZeroScan::integral_event(double integral) {
  ++integrals_;
  last_area_ = std::abs(integral - last_integral_);
  norms_.integral_abs += last_area_;
  norms_.step_max_abs = std::max(norms_.step_max_abs, std::abs(integral - initial_integral_));
  last_integral_ = integral;
}

void ZeroScan::value_event(double y) {
  norms_.max = std::max(norms_.max, y);
  norms_.min = std::min(norms_.min, y);
  ++values_;
  last_swing_ = std::abs(y - last_value_);
  norms_.variation += last_swing_;
  last_value_ = y;
}

void ZeroScan::slope_event(double slope) {
  norms_.slope_max_abs = std::max(norms_.slope_max_abs, std::abs(slope));
  ++slopes_;
  last_slope_swing_ = std::abs(slope - last_slope_);
  norms_.curvature_integral += last_slope_swing_;
  last_slope_ = slope;
}

void ZeroScan::add(const Polynomial& piece, double length, double integral_at_start) {
  const Polynomial slope = derivative_of(piece);
  const Polynomial curvature = derivative_of(slope);
  const Polynomial jerk = derivative_of(curvature);
  const std::vector<double> turns = zeros(jerk, length, {});
  const std::vector<double> inflections = zeros(curvature, length, turns);
  const std::vector<double> extrema = zeros(slope, length, inflections);
  for (const double u : inflections) slope_event(value(slope, u));
  for (const double u : extrema) value_event(value(piece, u));
  for (const double u : zeros(piece, length, extrema)) {
    integral_event(integral_at_start + integral_to(piece, u));
  }
}

ResponseNorms ZeroScan::finish_oscillation(double final_integral, double ratio) const {
  ResponseNorms result = norms_;
  const double rest = ratio / (1 - ratio);
  result.integral_abs += last_area_ * rest;
  result.variation += last_swing_ * rest;
  result.curvature_integral += last_slope_swing_ * rest;
  result.step_max_abs = std::max(result.step_max_abs, std::abs(final_integral - initial_integral_));
  result.integral = final_integral - initial_integral_;
  return result;
}

ResponseNorms ZeroScan::finish(double final_integral) const {
  ZeroScan last = *this;
  last.integral_event(final_integral);
  last.value_event(0);
  last.slope_event(0);
  last.norms_.integral = final_integral - initial_integral_;
  return last.norms_;
}

}  // namespace swarmcert::stability
