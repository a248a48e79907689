#include "analysis/logs/smoother.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace swarmcert::logs {

namespace {

/// The coefficient of tau^power of the least-squares polynomial that has these normal equations.
template <int Degree>
double fitted_coefficient(const Eigen::Matrix4d& normal, const Eigen::Vector4d& right, int power) {
  using Matrix = Eigen::Matrix<double, Degree + 1, Degree + 1>;
  const Eigen::LDLT<Matrix> solver(normal.topLeftCorner<Degree + 1, Degree + 1>());
  return solver.solve(right.head<Degree + 1>())[power];
}

/// The normal equations of a polynomial in tau, of which the solver reads the lower triangle.
struct NormalEquations {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  int count = 0;

  template <int Degree>
  void add(double tau, double value) {
    const double powers[4] = {1, tau, tau * tau, tau * tau * tau};
    for (int row = 0; row <= Degree; ++row) {
      for (int column = 0; column <= row; ++column) matrix(row, column) += powers[row] * powers[column];
      right[row] += value * powers[row];
    }
    ++count;
  }
};

template <int Degree>
std::vector<double> derivative_of_fits(const SignalTable& table, const std::vector<double>& series,
                                       double window_s, int derivative) {
  const std::size_t n = table.size();
  std::vector<double> result(n, std::numeric_limits<double>::quiet_NaN());
  const double half_us = 0.5e6 * window_s;
  const double scale = std::pow(2 / window_s, derivative) * (derivative == 2 ? 2 : derivative == 3 ? 6 : 1);
  std::size_t first = 0, end = 0, stretch = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (table.restarts[i] != 0) stretch = first = i;
    while (first < i && table.time_us[first] < table.time_us[i] - half_us) ++first;
    if (end <= i) end = i + 1;
    while (end < n && table.restarts[end] == 0 && table.time_us[end] <= table.time_us[i] + half_us) ++end;
    if (first < stretch) first = stretch;
    NormalEquations sums;  // of tau = (t - t_i) / half
    for (std::size_t k = first; k < end; ++k)
      if (std::isfinite(series[k]))
        sums.add<Degree>((table.time_us[k] - table.time_us[i]) / half_us, series[k]);
    if (sums.count > Degree)
      result[i] = fitted_coefficient<Degree>(sums.matrix, sums.right, derivative) * scale;
  }
  return result;
}

}  // namespace

std::vector<double> local_derivative(const SignalTable& table, const std::vector<double>& series,
                                     double window_s, int degree, int derivative) {
  switch (degree) {
    case 1:
      return derivative_of_fits<1>(table, series, window_s, derivative);
    case 2:
      return derivative_of_fits<2>(table, series, window_s, derivative);
    default:
      return derivative_of_fits<3>(table, series, window_s, derivative);
  }
}

}  // namespace swarmcert::logs
