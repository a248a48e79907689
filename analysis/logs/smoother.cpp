#include "analysis/logs/smoother.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace swarmcert::logs {

std::vector<double> local_derivative(const SignalTable& table, const std::vector<double>& series,
                                     double window_s, int degree, int derivative) {
  const std::size_t n = table.size();
  std::vector<double> result(n, std::numeric_limits<double>::quiet_NaN());
  const double half_us = 0.5e6 * window_s;
  std::size_t first = 0, end = 0, stretch = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (table.restarts[i] != 0) stretch = first = i;
    while (first < i && table.time_us[first] < table.time_us[i] - half_us) ++first;
    if (end <= i) end = i + 1;
    while (end < n && table.restarts[end] == 0 && table.time_us[end] <= table.time_us[i] + half_us) ++end;
    if (first < stretch) first = stretch;
    // tau = (t - t_i) / half: the sums of its powers are the normal equations.
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    int count = 0;
    for (std::size_t k = first; k < end; ++k) {
      if (!std::isfinite(series[k])) continue;
      const double tau = (table.time_us[k] - table.time_us[i]) / half_us;
      const Eigen::Vector4d powers(1, tau, tau * tau, tau * tau * tau);
      normal += powers * powers.transpose();
      right += series[k] * powers;
      ++count;
    }
    if (count < degree + 1) continue;
    const int m = degree + 1;
    const Eigen::LDLT<Eigen::MatrixXd> solver(normal.topLeftCorner(m, m));
    const Eigen::VectorXd c = solver.solve(right.head(m));
    const double scale = std::pow(2 / window_s, derivative) * (derivative == 2 ? 2 : derivative == 3 ? 6 : 1);
    result[i] = c[derivative] * scale;
  }
  return result;
}

}  // namespace swarmcert::logs
