#include "stability/bounds/contracting_system.h"

#include <Eigen/Dense>
#include <cmath>

namespace swarmcert::stability {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::optional<ContractingSystem> contracting(const TransferFunction& h) {
  return contracting(IntervalVector(h.numerator.begin(), h.numerator.end()),
                     IntervalVector(h.denominator.begin(), h.denominator.end()));
}

std::optional<ContractingSystem> contracting(const IntervalVector& numerator,
                                             const IntervalVector& denominator) {
  const std::size_t n = denominator.size() - 1;
  const auto size = static_cast<Index>(n);
  double slowest = 1e300;
  double fastest = 0;
  Polynomial middle;
  for (const Interval& x : denominator) middle.push_back(x.lo + (x.hi - x.lo) / 2);
  for (const std::complex<double>& pole : poles(middle)) {
    slowest = std::min(slowest, -pole.real());
    fastest = std::max(fastest, std::abs(pole));
  }
  if (!(slowest > 0)) return std::nullopt;
  // The companion in time units of 1/scale, a power of two so that scaling is exact: x_k = y^(k) / scale^k.
  const int exponent = static_cast<int>(std::lround(std::log2(fastest)));
  const double scale = std::ldexp(1.0, exponent);
  IntervalMatrix companion(n);
  MatrixXd approximate = MatrixXd::Zero(size, size);
  std::vector<Interval> a(n + 1);  // monic, scaled
  for (std::size_t k = 0; k <= n; ++k) {
    a[k] = denominator[k] / denominator[n] / Interval(std::ldexp(1.0, exponent * static_cast<int>(n - k)));
  }
  for (std::size_t k = 0; k + 1 < n; ++k) {
    companion(k, k + 1) = 1;
    approximate(static_cast<Index>(k), static_cast<Index>(k) + 1) = 1;
  }
  for (std::size_t k = 0; k < n; ++k) {
    companion(n - 1, k) = -a[k];
    approximate(size - 1, static_cast<Index>(k)) = -(a[k].lo + a[k].hi) / 2;
  }
  // Lyapunov: (A + alpha)'P + P(A + alpha) = -I, P = R'R.
  const double alpha = 0.8 * slowest / scale;
  const MatrixXd shifted = approximate + alpha * MatrixXd::Identity(size, size);
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
  const Eigen::LLT<MatrixXd> factor(P);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const MatrixXd R = factor.matrixU();
  const std::optional<IntervalMatrix> R_inverse = inverse(R);
  if (!R_inverse) return std::nullopt;

  ContractingSystem system{IntervalMatrix(R) * companion * *R_inverse, {}, 0, {}};
  for (double share : {0.95, 0.5, 0.1}) {
    IntervalMatrix test(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        test(i, j) = -(system.A(i, j) + system.A(j, i)) * Interval(0.5);
        if (i == j) test(i, j) = test(i, j) - Interval(share * alpha);
      }
    }
    if (is_positive_definite(test)) {
      system.alpha = share * alpha;
      break;
    }
  }
  if (system.alpha == 0) return std::nullopt;

  // Initial state: y^(k)(0+)/scale^k from the numerator, as in the exact series division.
  IntervalVector initial(n);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t power = n - 1 - k;
    Interval c = power < numerator.size() ? numerator[power] / denominator[n] /
                                                Interval(std::ldexp(1.0, exponent * static_cast<int>(k)))
                                          : Interval(0);
    for (std::size_t j = 0; j < k; ++j) c = c - a[n - k + j] * initial[j];
    initial[k] = c;
  }
  system.b.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      system.b[i] += Interval(R(static_cast<Index>(i), static_cast<Index>(k))) * initial[k];
    }
  }
  IntervalVector antiderivative(n);  // -(a_1 x_0 + ... + a_n x_(n-1))/a_0
  for (std::size_t k = 0; k < n; ++k) antiderivative[k] = -a[k + 1] / a[0];
  system.rows[0] = antiderivative * *R_inverse;
  IntervalVector derivative(n);
  derivative[0] = 1;
  for (std::size_t d = 0; d < 3; ++d) {
    system.rows[d + 1] = derivative * *R_inverse;
    derivative = derivative * companion;
  }
  // Back to seconds: y^(k) = scale^k x_k, int dt = (1/scale) int; powers of two are exact.
  const double factors[] = {1 / scale, 1, scale, scale * scale};
  for (std::size_t r = 0; r < 4; ++r) {
    for (Interval& x : system.rows[r]) x = x * Interval(factors[r]);
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) system.A(i, j) = system.A(i, j) * Interval(scale);
  }
  system.alpha *= scale;
  return system;
}

}  // namespace swarmcert::stability
