/// @file Small matrices of intervals. Not for users.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "nn/base/interval.h"

namespace swarmcert::stability {

using IntervalVector = std::vector<Interval>;

inline double middle(Interval x) { return x.lower + (x.upper - x.lower) / 2; }
/// Returns the distance from `centre` to the farthest point of x, rounded up.
inline double farthest(Interval x, double centre) { return up(std::max(x.upper - centre, centre - x.lower)); }

class IntervalMatrix {
 public:
  explicit IntervalMatrix(std::size_t n) : IntervalMatrix(n, n) {}
  IntervalMatrix(std::size_t rows, std::size_t columns)
      : rows_(rows), columns_(columns), entries_(rows * columns) {}
  explicit IntervalMatrix(const Eigen::MatrixXd& m)
      : IntervalMatrix(static_cast<std::size_t>(m.rows()), static_cast<std::size_t>(m.cols())) {
    for (std::size_t i = 0; i < rows_; ++i) {
      for (std::size_t j = 0; j < columns_; ++j)
        (*this)(i, j) = m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  std::size_t size() const { return rows_; }
  std::size_t columns() const { return columns_; }
  Interval& operator()(std::size_t i, std::size_t j) { return entries_[i * columns_ + j]; }
  Interval operator()(std::size_t i, std::size_t j) const { return entries_[i * columns_ + j]; }

 private:
  std::size_t rows_, columns_;
  std::vector<Interval> entries_;
};

IntervalMatrix operator*(const IntervalMatrix& a, const IntervalMatrix& b);
IntervalMatrix operator*(IntervalMatrix m, Interval factor);
IntervalMatrix& operator+=(IntervalMatrix& a, const IntervalMatrix& b);
IntervalVector operator*(const IntervalVector& row, const IntervalMatrix& m);
Interval dot(const IntervalVector& a, const std::vector<double>& b);

/// Returns an upper bound on the Euclidean norm.
double norm_above(const IntervalVector& v);
/// Returns an upper bound on the Frobenius norm.
double norm_above(const IntervalMatrix& m);

inline constexpr int kExponentialTerms = 18;
/// Returns the sum of the first kExponentialTerms terms m^k/k! of exp(m).
IntervalMatrix exponential_sum(const IntervalMatrix& m);

/// Encloses the inverse of a matrix by interval Gauss-Jordan elimination of (approximate inverse times m), which is
/// nearly the identity. Returns nothing if a pivot may vanish.
std::optional<IntervalMatrix> inverse(const Eigen::MatrixXd& m);

/// Returns true if every symmetric matrix in `m` is proved positive definite: interval Cholesky with positive pivots.
bool is_positive_definite(IntervalMatrix m);

}  // namespace swarmcert::stability
