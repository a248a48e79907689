/// @file Exact arithmetic for the checker: finite doubles are dyadic rationals, which are closed under sums and
/// products.
#pragma once

#include <gmpxx.h>

#include <cmath>
#include <vector>

namespace swarmcert::check {

/// mantissa * 2^exponent; nothing is ever rounded.
struct Dyadic {
  mpz_class mantissa;
  long exponent = 0;

  Dyadic() = default;
  Dyadic(mpz_class m, long e) : mantissa(std::move(m)), exponent(e) {}
  /// @param x finite.
  Dyadic(double x) {  // NOLINT(google-explicit-constructor): exact, so no information is lost
    int e = 0;
    mantissa = std::ldexp(std::frexp(x, &e), 53);  // an integer below 2^53
    const mp_bitcnt_t zeros = mantissa == 0 ? 0 : mpz_scan1(mantissa.get_mpz_t(), 0);
    mantissa >>= zeros;  // keeps the mantissas of later products short
    exponent = e - 53 + static_cast<long>(zeros);
  }

  int sign() const { return sgn(mantissa); }
  Dyadic& operator+=(const Dyadic& b) {
    if (b.sign() == 0) return *this;
    if (sign() == 0) return *this = b;
    if (b.exponent >= exponent) {
      mantissa += b.mantissa << static_cast<mp_bitcnt_t>(b.exponent - exponent);
    } else {
      mantissa = (mantissa << static_cast<mp_bitcnt_t>(exponent - b.exponent)) + b.mantissa;
      exponent = b.exponent;
    }
    return *this;
  }
  friend Dyadic operator-(const Dyadic& a) { return {-a.mantissa, a.exponent}; }
  friend Dyadic operator+(Dyadic a, const Dyadic& b) { return a += b; }
  friend Dyadic operator-(Dyadic a, const Dyadic& b) { return a += -b; }
  friend Dyadic operator*(const Dyadic& a, const Dyadic& b) {
    return {a.mantissa * b.mantissa, a.exponent + b.exponent};
  }
  friend bool operator>=(const Dyadic& a, const Dyadic& b) { return (a - b).sign() >= 0; }
  friend bool operator<(const Dyadic& a, const Dyadic& b) { return !(a >= b); }
};

inline Dyadic absolute(const Dyadic& x) { return x.sign() < 0 ? -x : x; }

/// [rows x cols], row-major.
struct Matrix {
  int rows;
  int cols;
  std::vector<Dyadic> entries;

  Matrix(int row_count, int col_count)
      : rows(row_count), cols(col_count), entries(static_cast<std::size_t>(row_count) * col_count) {}
  Matrix(int row_count, int col_count, const std::vector<double>& values)
      : rows(row_count), cols(col_count), entries(values.begin(), values.end()) {}
  Dyadic& operator()(int i, int j) { return entries[static_cast<std::size_t>(i) * cols + j]; }
  const Dyadic& operator()(int i, int j) const { return entries[static_cast<std::size_t>(i) * cols + j]; }
};

}  // namespace swarmcert::check
