#include "analysis/residuals/learning_error.h"

#include <algorithm>
#include <array>

#include "analysis/residuals/force_residual.h"

namespace swarmcert::residuals {
namespace {

Axes axes(const std::array<std::vector<double>, 4>& values, double p) {
  std::array<double, 4> q{};
  for (std::size_t k = 0; k < 4; ++k) {
    std::vector<double> copy = values[k];
    q[k] = p >= 1 && !copy.empty() ? *std::max_element(copy.begin(), copy.end()) : quantile(copy, p);
  }
  return {q[0], q[1], q[2], q[3]};
}

}  // namespace

Eigen::Vector4d with_norm(const Eigen::Vector3d& v) {
  return {std::abs(v[0]), std::abs(v[1]), std::abs(v[2]), v.norm()};
}

LearningError::Quantiles quantiles(const std::vector<Eigen::Vector4d>& values) {
  std::array<std::vector<double>, 4> columns;
  for (const Eigen::Vector4d& value : values) {
    for (std::size_t k = 0; k < 4; ++k) columns[k].push_back(value[static_cast<int>(k)]);
  }
  return {axes(columns, 0.5), axes(columns, 0.95), axes(columns, 0.99), axes(columns, 1)};
}

std::vector<ErrorWindow> error_windows(const Track& track, const std::vector<Eigen::Vector3d>& r) {
  std::vector<ErrorWindow> windows;
  ErrorWindow window;
  double start_s = 0, last_s = 0;
  bool open = false;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  AccelerometerFilter filter(LearningError::kBandwidth_hz, 1);
  const auto close = [&] {
    if (open && last_s - start_s > LearningError::kWindow_s / 2) windows.push_back(window);
    open = false;
  };
  for (std::size_t i = 0; i < r.size(); ++i) {
    const double time_s = track.instants[i].time_s;
    const bool breaks = track.restarts[i] != 0 || (i > 0 && track.cut[i - 1] != Cut::kNone);
    if (track.cut[i] != Cut::kNone) {
      close();
      continue;
    }
    if (breaks) {
      close();
      filter.restart();
    }
    Eigen::Matrix3Xd value = r[i];
    filter.advance(time_s, value);
    const Eigen::Vector3d now = value.col(0);
    if (open && time_s - start_s >= LearningError::kWindow_s) close();
    if (!open) {
      window = {with_norm(now), Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero(), Eigen::Vector4d::Zero()};
      start_s = time_s;
      open = true;
    } else {
      const double step_s = time_s - last_s;
      const Eigen::Vector4d change = with_norm(now - last);
      window.amplitude = window.amplitude.cwiseMax(with_norm(now));
      window.rate = window.rate.cwiseMax(change / step_s);
      window.variation += change;
      window.impulse += step_s * with_norm(now);
    }
    last = now;
    last_s = time_s;
  }
  close();
  return windows;
}

LearningError learning_error(const std::vector<Eigen::Vector4d>& bias,
                             const std::vector<ErrorWindow>& windows) {
  std::vector<Eigen::Vector4d> amplitude, rate, variation, impulse;
  for (const ErrorWindow& window : windows) {
    amplitude.push_back(window.amplitude);
    rate.push_back(window.rate);
    variation.push_back(window.variation);
    impulse.push_back(window.impulse);
  }
  LearningError result;
  result.windows = windows.size();
  result.bias_N = quantiles(bias);
  result.amplitude_N = quantiles(amplitude);
  result.rate_N_s = quantiles(rate);
  result.variation_N = quantiles(variation);
  result.impulse_N_s = quantiles(impulse);
  return result;
}

}  // namespace swarmcert::residuals
