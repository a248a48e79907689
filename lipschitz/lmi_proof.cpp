#include "lipschitz/lmi_proof.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace swarmcert::lipschitz {
namespace {

using check::Dyadic;
using check::Factor;
using check::Matrix;

constexpr int kUnitExponent = -60;

/// s with 2^(2 s) x in [1/4, 1]: scales a diagonal entry x > 0 to order one.
long scale_exponent(const Dyadic& x) {
  const long magnitude = static_cast<long>(mpz_sizeinbase(x.mantissa.get_mpz_t(), 2)) + x.exponent;
  return -((magnitude + (magnitude > 0 ? 1 : 0)) / 2);
}

}  // namespace

double to_double(const Dyadic& x) {
  signed long exponent = 0;
  const double fraction = mpz_get_d_2exp(&exponent, x.mantissa.get_mpz_t());
  const long total = exponent + x.exponent;
  if (total > 2000) return std::copysign(std::numeric_limits<double>::infinity(), fraction);
  return total < -2000 ? 0.0 : std::ldexp(fraction, static_cast<int>(total));
}

double sqrt_up(double rho) {
  const auto is_enough = [rho](double x) { return Dyadic(x) * Dyadic(x) >= Dyadic(rho); };
  double root = std::sqrt(rho);
  while (!is_enough(root)) root = std::nextafter(root, std::numeric_limits<double>::infinity());
  while (root > 0 && is_enough(std::nextafter(root, 0.0))) root = std::nextafter(root, 0.0);
  return root;
}

std::optional<Factor> find_factor(const Matrix& p) {
  const int n = p.rows;
  Factor factor;
  factor.unit_exponent = kUnitExponent;
  Eigen::MatrixXd scaled = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    if (p(i, i).sign() < 0) return std::nullopt;
    factor.scale.push_back(p(i, i).sign() == 0 ? 0 : scale_exponent(p(i, i)));
  }
  std::vector<int> first_column;
  double widest_row = 0;
  for (int i = 0; i < n; ++i) {
    int first = i;
    double row_sum = 0;
    for (int j = 0; j < n; ++j) {
      if (p(i, j).sign() == 0) continue;
      first = std::min(first, j);
      Dyadic entry = p(i, j);
      entry.exponent += factor.scale[i] + factor.scale[j];
      scaled(i, j) = to_double(entry);
      row_sum += std::abs(scaled(i, j));
    }
    first_column.push_back(first);
    widest_row = std::max(widest_row, row_sum);
  }
  if (!std::isfinite(widest_row)) return std::nullopt;

  // Rounding P, factorising and rounding R perturb row sums of E by a small multiple of 2^-53 times P's row sums
  // and n; the exact check below decides whether the shift was enough.
  for (double shift = 0x1p-53 * (n + widest_row); shift < 1e-7; shift *= 8) {
    Eigen::MatrixXd shifted = scaled;
    shifted.diagonal().array() -= shift;
    for (int i = 0; i < n; ++i) {
      if (p(i, i).sign() == 0) shifted(i, i) = 1;  // an empty row: its part of R is dropped again below
    }
    const Eigen::LLT<Eigen::MatrixXd> llt(shifted);
    if (llt.info() != Eigen::Success) return std::nullopt;
    const Eigen::MatrixXd& l = llt.matrixLLT();
    factor.rows.assign(static_cast<std::size_t>(n), {});
    for (int i = 0; i < n; ++i) {
      for (int j = first_column[i]; j <= i; ++j) {
        const double entry = p(i, i).sign() == 0 ? 0.0 : std::nearbyint(std::ldexp(l(i, j), -kUnitExponent));
        factor.rows[i].emplace_back(entry);
      }
    }
    if (check::shows_positive_semidefinite(p, factor)) return factor;
  }
  return std::nullopt;
}

std::optional<UpperProof> prove(const std::vector<Matrix>& stages, double rho, const std::vector<double>& t) {
  UpperProof proof;
  proof.rho = rho;
  proof.t = t;
  if (!(rho > 0) || !std::isfinite(rho)) return std::nullopt;
  for (const double multiplier : t) {
    if (!(multiplier >= 0) || !std::isfinite(multiplier)) return std::nullopt;
  }
  std::optional<Factor> factor = find_factor(check::lipschitz_lmi(stages, rho, {t.begin(), t.end()}));
  if (!factor) return std::nullopt;
  proof.factor = std::move(*factor);
  proof.upper = UpperBound(sqrt_up(rho));
  return proof;
}

}  // namespace swarmcert::lipschitz
