/// @file Polynomials with real coefficients, in ascending powers.
#pragma once

#include <cstddef>
#include <vector>

namespace swarmcert::stability {

/// p[0] + p[1] s + p[2] s^2 + ...
using Polynomial = std::vector<double>;

inline Polynomial product(const Polynomial& a, const Polynomial& b) {
  Polynomial result(a.size() + b.size() - 1, 0.0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) result[i + j] += a[i] * b[j];
  }
  return result;
}

inline Polynomial sum(Polynomial a, const Polynomial& b) {
  if (a.size() < b.size()) a.resize(b.size(), 0.0);
  for (std::size_t i = 0; i < b.size(); ++i) a[i] += b[i];
  return a;
}

inline Polynomial scaled(Polynomial p, double factor) {
  for (double& c : p) c *= factor;
  return p;
}

/// By Horner's rule.
inline double value(const Polynomial& p, double s) {
  double result = 0;
  for (std::size_t i = p.size(); i-- > 0;) result = result * s + p[i];
  return result;
}

}  // namespace swarmcert::stability
