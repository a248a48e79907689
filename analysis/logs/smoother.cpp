#include "analysis/logs/smoother.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <optional>

namespace swarmcert::logs {
namespace {

/// The least-squares polynomial in tau through the finite ones among values[first] to values[end - 1]; nothing if these
/// are too few.
/// @param from, half tau = (t - from) / half
template <int Degree>
std::optional<Eigen::Matrix<double, Degree + 1, 1>> fit(const std::vector<double>& times,
                                                        const std::vector<double>& values, std::size_t first,
                                                        std::size_t end, double from, double half) {
  Eigen::Matrix<double, Degree + 1, Degree + 1> matrix;  // of which the solver reads only the lower triangle
  Eigen::Matrix<double, Degree + 1, 1> right;
  // Plain arrays and fixed loop counts keep the sums in registers.
  double sums[Degree + 1][Degree + 1] = {}, products[Degree + 1] = {}, powers[Degree + 1] = {1};
  int count = 0;
  for (std::size_t k = first; k < end; ++k) {
    if (!std::isfinite(values[k])) continue;
    const double tau = (times[k] - from) / half;
#pragma GCC unroll 4
    for (int row = 0; row <= Degree; ++row) {
      if (row > 0) powers[row] = powers[row - 1] * tau;
#pragma GCC unroll 4
      for (int column = 0; column <= row; ++column) sums[row][column] += powers[row] * powers[column];
      products[row] += values[k] * powers[row];
    }
    ++count;
  }
  if (count <= Degree) return std::nullopt;
  matrix.setZero();
  for (int row = 0; row <= Degree; ++row) {
    for (int column = 0; column <= row; ++column) matrix(row, column) = sums[row][column];
    right[row] = products[row];
  }
  return matrix.ldlt().solve(right);
}

template <int Degree>
std::vector<std::vector<double>> derivatives_of_fits(const SignalTable& table,
                                                     const std::vector<double>& series, double window_s,
                                                     const std::vector<int>& derivatives) {
  const std::size_t n = table.size();
  std::vector<std::vector<double>> results(derivatives.size(),
                                           std::vector<double>(n, std::numeric_limits<double>::quiet_NaN()));
  const double half_us = 0.5e6 * window_s;
  std::vector<double> scales;
  for (const int order : derivatives)
    scales.push_back(std::pow(2 / window_s, order) * (order == 2 ? 2 : order == 3 ? 6 : 1));
  std::size_t first = 0, end = 0, stretch = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (table.restarts[i] != 0) stretch = first = i;
    while (first < i && table.time_us[first] < table.time_us[i] - half_us) ++first;
    if (end <= i) end = i + 1;
    while (end < n && table.restarts[end] == 0 && table.time_us[end] <= table.time_us[i] + half_us) ++end;
    if (first < stretch) first = stretch;
    const auto fitted = fit<Degree>(table.time_us, series, first, end, table.time_us[i], half_us);
    for (std::size_t d = 0; fitted && d < derivatives.size(); ++d)
      results[d][i] = (*fitted)[derivatives[d]] * scales[d];
  }
  return results;
}

}  // namespace

std::vector<std::vector<double>> local_derivatives(const SignalTable& table,
                                                   const std::vector<double>& series, double window_s,
                                                   int degree, const std::vector<int>& derivatives) {
  return degree == 2 ? derivatives_of_fits<2>(table, series, window_s, derivatives)
                     : derivatives_of_fits<3>(table, series, window_s, derivatives);
}

}  // namespace swarmcert::logs
