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

/// s^power p(s)
inline Polynomial times_s_to(int power, Polynomial p) {
  p.insert(p.begin(), static_cast<std::size_t>(power), 0.0);
  return p;
}

inline Polynomial derivative_of(const Polynomial& p) {
  Polynomial result;
  for (std::size_t i = 1; i < p.size(); ++i) result.push_back(static_cast<double>(i) * p[i]);
  return result;
}

/// Returns (i + k)! / i!, the factor of the coefficient of s^(i + k) after k derivatives. Exact below 2^53.
inline double rising_factorial(std::size_t i, std::size_t k) {
  double result = 1;
  for (std::size_t j = 1; j <= k; ++j) result *= static_cast<double>(i + j);
  return result;
}

/// Evaluates p at s by Horner's rule.
inline double value(const Polynomial& p, double s) {
  double result = 0;
  for (std::size_t i = p.size(); i-- > 0;) result = result * s + p[i];
  return result;
}

}  // namespace swarmcert::stability
