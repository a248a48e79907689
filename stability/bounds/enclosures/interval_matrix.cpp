#include "stability/bounds/enclosures/interval_matrix.h"

#include <Eigen/LU>

namespace swarmcert::stability {

using Eigen::MatrixXd;

IntervalMatrix operator*(const IntervalMatrix& a, const IntervalMatrix& b) {
  IntervalMatrix result(a.size(), b.columns());
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.columns(); ++j) {
      Interval total;
      for (std::size_t k = 0; k < a.columns(); ++k) total += a(i, k) * b(k, j);
      result(i, j) = total;
    }
  }
  return result;
}

IntervalMatrix operator*(IntervalMatrix m, Interval factor) {
  for (std::size_t i = 0; i < m.size(); ++i)
    for (std::size_t j = 0; j < m.columns(); ++j) m(i, j) = m(i, j) * factor;
  return m;
}

IntervalMatrix& operator+=(IntervalMatrix& a, const IntervalMatrix& b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < a.columns(); ++j) a(i, j) += b(i, j);
  return a;
}

IntervalVector operator*(const IntervalVector& row, const IntervalMatrix& m) {
  IntervalVector result(m.columns());
  for (std::size_t j = 0; j < m.columns(); ++j) {
    for (std::size_t k = 0; k < row.size(); ++k) result[j] += row[k] * m(k, j);
  }
  return result;
}

Interval dot(const IntervalVector& a, const std::vector<double>& b) {
  Interval total;
  for (std::size_t i = 0; i < a.size(); ++i) total += a[i] * b[i];
  return total;
}

double norm_above(const IntervalVector& v) {
  Interval total;
  for (const Interval& x : v) total += Interval(x.mag()) * x.mag();
  return sqrt(total).upper;
}

double norm_above(const IntervalMatrix& m) {
  Interval squares;
  for (std::size_t i = 0; i < m.size(); ++i)
    for (std::size_t j = 0; j < m.columns(); ++j) squares += Interval(m(i, j).mag()) * m(i, j).mag();
  return sqrt(squares).upper;
}

IntervalMatrix exponential_sum(const IntervalMatrix& m) {
  const auto n = static_cast<Eigen::Index>(m.size());
  IntervalMatrix term(MatrixXd::Identity(n, n));
  IntervalMatrix total = term;
  for (int k = 1; k < kExponentialTerms; ++k) {
    term = term * m * (Interval(1) / Interval(k));
    total += term;
  }
  return total;
}

std::optional<IntervalMatrix> inverse(const MatrixXd& m) {
  const MatrixXd approximate = m.inverse();
  IntervalMatrix left = IntervalMatrix(approximate) * IntervalMatrix(m);
  IntervalMatrix right(approximate);
  const std::size_t n = left.size();
  for (std::size_t k = 0; k < n; ++k) {
    const Interval pivot = left(k, k);
    if (!pivot.is_positive()) return std::nullopt;
    for (std::size_t j = 0; j < n; ++j) {
      left(k, j) = left(k, j) / pivot;
      right(k, j) = right(k, j) / pivot;
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (i == k) continue;
      const Interval factor = left(i, k);
      for (std::size_t j = 0; j < n; ++j) {
        left(i, j) = left(i, j) - factor * left(k, j);
        right(i, j) = right(i, j) - factor * right(k, j);
      }
    }
  }
  return right;
}

bool is_positive_definite(IntervalMatrix m) {
  const std::size_t n = m.size();
  for (std::size_t k = 0; k < n; ++k) {
    if (!m(k, k).is_positive()) return false;
    for (std::size_t i = k + 1; i < n; ++i) {
      const Interval factor = m(i, k) / m(k, k);
      for (std::size_t j = i; j < n; ++j) {
        m(i, j) = m(i, j) - factor * m(k, j);
        m(j, i) = m(i, j);
      }
    }
  }
  return true;
}

}  // namespace swarmcert::stability
