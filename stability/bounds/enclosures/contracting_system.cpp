#include "stability/bounds/enclosures/contracting_system.h"

#include <Eigen/Dense>
#include <cmath>

namespace swarmcert::stability {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Solves (A + alpha)'P + P(A + alpha) = -I in floating point; the result is a proposal that is verified later.
MatrixXd lyapunov(const MatrixXd& shifted) {
  const Index size = shifted.rows();
  MatrixXd kronecker = MatrixXd::Zero(size * size, size * size);
  for (Index i = 0; i < size; ++i) {
    for (Index j = 0; j < size; ++j) {
      for (Index k = 0; k < size; ++k) {
        kronecker(i * size + j, k * size + j) += shifted(k, i);
        kronecker(i * size + j, i * size + k) += shifted(k, j);
      }
    }
  }
  VectorXd right = VectorXd::Zero(size * size);
  for (Index i = 0; i < size; ++i) right[i * size + i] = -1;
  const VectorXd solution = kronecker.fullPivLu().solve(right);
  MatrixXd P(size, size);
  for (Index i = 0; i < size; ++i) {
    for (Index j = 0; j < size; ++j) P(i, j) = (solution[i * size + j] + solution[j * size + i]) / 2;
  }
  return P;
}

/// Returns the largest of a few rates for which (A + A')/2 + rate <= 0 is proved; 0 if none is.
double proved_rate(const IntervalMatrix& A, std::size_t n, double alpha) {
  for (const double share : {0.95, 0.5, 0.1}) {
    IntervalMatrix test(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        test(i, j) = -(A(i, j) + A(j, i)) * Interval(0.5);
        if (i == j) test(i, j) = test(i, j) - Interval(share * alpha);
      }
    }
    if (is_positive_definite(test)) return share * alpha;
  }
  return 0;
}

/// The companion matrix in time units of 2^-exponent s, a power of two, so that the scaling is exact:
/// x_k = y^(k) / 2^(k exponent).
struct Companion {
  int exponent = 0;
  std::vector<Interval> a;  ///< the denominator, monic and scaled
  IntervalMatrix matrix;
  MatrixXd approximate;

  Companion(const IntervalVector& denominator, int of_exponent)
      : exponent(of_exponent), a(denominator.size()), matrix(denominator.size() - 1) {
    const std::size_t n = denominator.size() - 1;
    const auto size = static_cast<Index>(n);
    approximate = MatrixXd::Zero(size, size);
    for (std::size_t k = 0; k <= n; ++k)
      a[k] = denominator[k] / denominator[n] / Interval(std::ldexp(1.0, exponent * static_cast<int>(n - k)));
    for (std::size_t k = 0; k + 1 < n; ++k) {
      matrix(k, k + 1) = 1;
      approximate(static_cast<Index>(k), static_cast<Index>(k) + 1) = 1;
    }
    for (std::size_t k = 0; k < n; ++k) {
      matrix(n - 1, k) = -a[k];
      approximate(size - 1, static_cast<Index>(k)) = -middle(a[k]);
    }
  }

  /// Returns y^(k)(0+) / 2^(k exponent) from the numerator, by exact series division.
  IntervalVector initial(const IntervalVector& numerator, const Interval& leading) const {
    const std::size_t n = a.size() - 1;
    IntervalVector y(n);
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t power = n - 1 - k;
      Interval c = power < numerator.size() ? numerator[power] / leading /
                                                  Interval(std::ldexp(1.0, exponent * static_cast<int>(k)))
                                            : Interval(0);
      for (std::size_t j = 0; j < k; ++j) c = c - a[n - k + j] * y[j];
      y[k] = c;
    }
    return y;
  }
};

/// Computes the rows that give int y, y, y' and y'' from R x, in the companion's unit of time.
void read_off(const Companion& companion, const IntervalMatrix& R_inverse, ContractingSystem& system) {
  const std::size_t n = companion.a.size() - 1;
  IntervalVector antiderivative(n);  // -(a_1 x_0 + ... + a_n x_(n-1))/a_0
  for (std::size_t k = 0; k < n; ++k) antiderivative[k] = -companion.a[k + 1] / companion.a[0];
  system.rows[0] = antiderivative * R_inverse;
  IntervalVector derivative(n);
  derivative[0] = 1;
  for (std::size_t d = 0; d < 3; ++d) {
    system.rows[d + 1] = derivative * R_inverse;
    derivative = derivative * companion.matrix;
  }
}

/// Converts back to seconds: y^(k) = scale^k x_k, int dt = (1/scale) int; powers of two are exact.
void scale_time(double scale, ContractingSystem& system) {
  const double factors[] = {1 / scale, 1, scale, scale * scale};
  for (std::size_t r = 0; r < 4; ++r) {
    for (Interval& x : system.rows[r]) x = x * Interval(factors[r]);
  }
  system.A = system.A * Interval(scale);
  system.alpha *= scale;
}

}  // namespace

std::optional<ContractingSystem> contracting(const IntervalVector& numerator,
                                             const IntervalVector& denominator) {
  const std::size_t n = denominator.size() - 1;
  double slowest = 1e300;
  double fastest = 0;
  Polynomial centre;
  for (const Interval& x : denominator) centre.push_back(middle(x));
  for (const std::complex<double>& pole : poles(centre)) {
    slowest = std::min(slowest, -pole.real());
    fastest = std::max(fastest, std::abs(pole));
  }
  if (!(slowest > 0)) return std::nullopt;
  const Companion companion(denominator, static_cast<int>(std::lround(std::log2(fastest))));
  const double scale = std::ldexp(1.0, companion.exponent);
  const double alpha = 0.8 * slowest / scale;
  const auto size = static_cast<Index>(n);
  // P = R'R.
  const Eigen::LLT<MatrixXd> factor(lyapunov(companion.approximate + alpha * MatrixXd::Identity(size, size)));
  if (factor.info() != Eigen::Success) return std::nullopt;
  const MatrixXd R = factor.matrixU();
  const std::optional<IntervalMatrix> R_inverse = inverse(R);
  if (!R_inverse) return std::nullopt;

  ContractingSystem system{IntervalMatrix(R) * companion.matrix * *R_inverse, {}, 0, {}};
  system.alpha = proved_rate(system.A, n, alpha);
  if (system.alpha == 0) return std::nullopt;
  const IntervalVector initial = companion.initial(numerator, denominator[n]);
  system.b.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      system.b[i] += Interval(R(static_cast<Index>(i), static_cast<Index>(k))) * initial[k];
    }
  }
  read_off(companion, *R_inverse, system);
  scale_time(scale, system);
  return system;
}

}  // namespace swarmcert::stability
