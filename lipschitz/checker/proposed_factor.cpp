#include "lipschitz/checker/proposed_factor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace swarmcert::check {
namespace {

constexpr int kUnitExponent = -60;

/// The rows of a lower triangle, each from its first column that may be nonzero.
using Triangle = std::vector<std::vector<double>>;

/// Returns s with 2^(2 s) x in [1/4, 1], which scales a diagonal entry x > 0 to order one.
long scale_exponent(const Dyadic& x) {
  const long magnitude = static_cast<long>(mpz_sizeinbase(x.mantissa.get_mpz_t(), 2)) + x.exponent;
  return -((magnitude + (magnitude > 0 ? 1 : 0)) / 2);
}

/// Returns the sum of a_k b_k, computed in four partial sums that vectorise.
double inner_product(const double* a, const double* b, int count) {
  double lanes[4] = {};
  int k = 0;
  for (; k + 4 <= count; k += 4)
    for (int lane = 0; lane < 4; ++lane) lanes[lane] += a[k + lane] * b[k + lane];
  for (; k < count; ++k) lanes[0] += a[k] * b[k];
  return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

/// Replaces a matrix by its Cholesky factor, whose rows begin in the same columns. Rows marked as empty are set to
/// zero. Returns false if the factorisation breaks down.
bool factorise(Triangle& rows, const std::vector<bool>& is_empty) {
  std::vector<int> first;
  for (std::size_t i = 0; i < rows.size(); ++i)
    first.push_back(static_cast<int>(i + 1) - static_cast<int>(rows[i].size()));
  for (int i = 0; i < static_cast<int>(rows.size()); ++i) {
    std::vector<double>& row = rows[static_cast<std::size_t>(i)];
    if (is_empty[static_cast<std::size_t>(i)]) {
      std::fill(row.begin(), row.end(), 0.0);
      continue;
    }
    for (int j = first[static_cast<std::size_t>(i)]; j <= i; ++j) {
      const std::vector<double>& other = rows[static_cast<std::size_t>(j)];
      const int first_i = first[static_cast<std::size_t>(i)], first_j = first[static_cast<std::size_t>(j)];
      const int from = std::max(first_i, first_j);
      const double rest =
          row[static_cast<std::size_t>(j - first_i)] -
          inner_product(row.data() + (from - first_i), other.data() + (from - first_j), j - from);
      const double pivot = other.back();
      if (j < i) {
        row[static_cast<std::size_t>(j - first_i)] = pivot == 0 ? 0.0 : rest / pivot;
      } else if (rest > 0 && std::isfinite(rest)) {
        row.back() = std::sqrt(rest);
      } else {
        return false;
      }
    }
  }
  return true;
}

}  // namespace

double to_double(const Dyadic& x) {
  signed long exponent = 0;
  const double fraction = mpz_get_d_2exp(&exponent, x.mantissa.get_mpz_t());
  const long total = exponent + x.exponent;
  if (total > 2000) return std::copysign(std::numeric_limits<double>::infinity(), fraction);
  return total < -2000 ? 0.0 : std::ldexp(fraction, static_cast<int>(total));
}

std::optional<Factor> proposed_factor(const SymmetricMatrix& p) {
  const int n = p.size();
  Factor factor;
  factor.unit_exponent = kUnitExponent;
  std::vector<bool> is_empty;
  for (int i = 0; i < n; ++i) {
    const Dyadic& diagonal = p.at(i, i);
    if (diagonal.sign() < 0) return std::nullopt;
    is_empty.push_back(diagonal.sign() == 0);
    factor.scale.push_back(is_empty.back() ? 0 : scale_exponent(diagonal));
  }
  Triangle scaled;
  std::vector<double> row_sums(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    int first = p.first(i);
    while (first < i && p.at(i, first).sign() == 0) ++first;
    scaled.emplace_back();
    for (int j = first; j <= i; ++j) {
      Dyadic entry = p.at(i, j);
      entry.exponent += factor.scale[i] + factor.scale[j];
      scaled.back().push_back(to_double(entry));
      row_sums[static_cast<std::size_t>(i)] += std::abs(scaled.back().back());
      if (j < i) row_sums[static_cast<std::size_t>(j)] += std::abs(scaled.back().back());
    }
  }
  const double widest_row = n == 0 ? 0 : *std::max_element(row_sums.begin(), row_sums.end());
  if (!std::isfinite(widest_row)) return std::nullopt;

  // Rounding P, factorising and rounding R change the row sums of E by a small multiple of 2^-53 times the row sums of
  // P and n. The exact check below decides whether the shift was sufficient.
  for (double shift = 0x1p-53 * (n + widest_row); shift < 1e-7; shift *= 8) {
    Triangle rows = scaled;
    for (std::vector<double>& row : rows) row.back() -= shift;
    if (!factorise(rows, is_empty)) return std::nullopt;
    factor.rows.assign(static_cast<std::size_t>(n), {});
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (const double entry : rows[i])
        factor.rows[i].emplace_back(std::nearbyint(std::ldexp(entry, -kUnitExponent)));
    if (shows_positive_semidefinite(p, factor)) return factor;
  }
  return std::nullopt;
}

}  // namespace swarmcert::check
