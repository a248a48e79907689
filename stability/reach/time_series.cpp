#include "stability/reach/time_series.h"

namespace swarmcert::stability {
namespace {

AffineForm number(std::size_t k) { return static_cast<double>(k); }

}  // namespace

AffineForm TimeSeries::at(Interval t) const {
  AffineForm value;
  for (std::size_t k = c.size(); k-- > 0;) value = value * AffineForm(t) + c[k];
  return value;
}

TimeSeries operator+(const TimeSeries& a, const TimeSeries& b) {
  TimeSeries sum = a;
  sum.c.resize(std::max(a.c.size(), b.c.size()));
  for (std::size_t k = 0; k < b.c.size(); ++k) sum.c[k] = sum.c[k] + b.c[k];
  return sum;
}

TimeSeries operator-(const TimeSeries& a) {
  TimeSeries result = a;
  for (AffineForm& x : result.c) x = -x;
  return result;
}

TimeSeries operator-(const TimeSeries& a, const TimeSeries& b) { return a + -b; }

TimeSeries operator*(const TimeSeries& a, const TimeSeries& b) {
  const std::size_t size = std::max(a.c.size(), b.c.size());
  TimeSeries product{AffineVector(size)};
  for (std::size_t i = 0; i < a.c.size(); ++i) {
    for (std::size_t j = 0; j < b.c.size() && i + j < size; ++j)
      product.c[i + j] = product.c[i + j] + a.c[i] * b.c[j];
  }
  return product;
}

TimeSeries operator/(const TimeSeries& a, const TimeSeries& b) {
  const AffineForm inverse = AffineForm(1) / b.c[0];
  TimeSeries quotient{AffineVector(std::max(a.c.size(), b.c.size()))};
  for (std::size_t k = 0; k < quotient.c.size(); ++k) {
    AffineForm rest = a[k];
    for (std::size_t j = 1; j <= k; ++j) rest = rest - b[j] * quotient.c[k - j];
    quotient.c[k] = rest * inverse;
  }
  return quotient;
}

std::pair<TimeSeries, TimeSeries> sin_and_cos(const TimeSeries& x) {
  TimeSeries s{AffineVector(x.c.size())}, c = s;
  s.c[0] = sin(x.c[0]);
  c.c[0] = cos(x.c[0]);
  for (std::size_t k = 1; k < x.c.size(); ++k) {  // k s_k = sum of j x_j c_(k-j), and c' = -x' s
    for (std::size_t j = 1; j <= k; ++j) {
      const AffineForm slope = number(j) * x.c[j];
      s.c[k] = s.c[k] + slope * c.c[k - j];
      c.c[k] = c.c[k] - slope * s.c[k - j];
    }
    s.c[k] = s.c[k] / number(k);
    c.c[k] = c.c[k] / number(k);
  }
  return {s, c};
}

}  // namespace swarmcert::stability
