#include "stability/bounds/enclosures/enclosed_state.h"

namespace swarmcert::stability {
namespace {

double length_above(const std::vector<double>& w) { return norm_above(IntervalVector(w.begin(), w.end())); }

}  // namespace

EnclosedStep::EnclosedStep(const IntervalMatrix& A, double step_s, double size)
    : matrix(exponential_sum(A * Interval(step_s))) {
  // size^18/18! (1 + size/19 + ...) with size <= 1, and 18! > 6.4e15. The series is below 1.06; the factor 1.1 also
  // covers round-off.
  remainder = 1.1 * nth_power(Interval(size * 1.000001), kExponentialTerms).upper / 6.4e15;
}

EnclosedState::EnclosedState(const IntervalVector& initial) {
  for (const Interval& x : initial) {
    w.push_back(middle(x));
    error = up(error + (x.upper - x.lower));
  }
}

double EnclosedState::largest_norm() const { return up(length_above(w) + error); }

Interval EnclosedState::value(const IntervalVector& row, double row_norm) const {
  const double missed = up(row_norm * error);
  return dot(row, w) + Interval(-missed, missed);
}

void EnclosedState::advance(const EnclosedStep& step) {
  std::vector<double> next(w.size());
  Interval missed;
  for (std::size_t i = 0; i < w.size(); ++i) {
    Interval total;
    for (std::size_t j = 0; j < w.size(); ++j) total += step.matrix(i, j) * w[j];
    next[i] = middle(total);
    const double half = farthest(total, next[i]);
    missed += Interval(half) * half;
  }
  error = up(up(error + sqrt(missed).upper) + up(step.remainder * length_above(w)));
  w = std::move(next);
}

}  // namespace swarmcert::stability
