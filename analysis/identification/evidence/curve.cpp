#include "analysis/identification/evidence/curve.h"

#include <algorithm>

namespace swarmcert::evidence {
namespace {

double quantile(std::vector<double>& values, double fraction) {
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace

Curve::Curve(std::vector<double>& values)
    : lower_(quantile(values, 0.005)), upper_(quantile(values, 0.995)) {}

Curve::Values Curve::operator()(double value) const {
  const double x = std::clamp((value - lower_) / (upper_ - lower_), 0.0, 1.0) * (kSize - 3);
  const int first = std::min(static_cast<int>(x), kSize - 4);
  const double t = x - first, u = 1 - t;
  Values result = Values::Zero();
  result[first] = u * u * u / 6;
  result[first + 1] = (3 * t * t * t - 6 * t * t + 4) / 6;
  result[first + 2] = (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6;
  result[first + 3] = t * t * t / 6;
  return result;
}

Eigen::Matrix<double, Curve::kSize, Curve::kSize> Curve::roughness() {
  Eigen::Matrix<double, kSize - 2, kSize> D = Eigen::Matrix<double, kSize - 2, kSize>::Zero();
  for (int i = 0; i < kSize - 2; ++i) {
    D(i, i) = D(i, i + 2) = 1;
    D(i, i + 1) = -2;
  }
  return D.transpose() * D;
}

}  // namespace swarmcert::evidence
