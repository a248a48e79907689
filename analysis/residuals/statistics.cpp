#include "analysis/residuals/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "nn/base/pi.h"

namespace swarmcert::residuals {
namespace {

std::ptrdiff_t quantile_place(std::size_t size, double p) {
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(p * static_cast<double>(size)));
  return std::max<std::ptrdiff_t>(rank - 1, 0);
}

template <typename Number>
double quantile_of(std::vector<Number>& values, double p) {
  if (values.empty()) return 0;
  const auto at = values.begin() + quantile_place(values.size(), p);
  std::nth_element(values.begin(), at, values.end());
  return static_cast<double>(*at);
}

double share(double part, double whole) { return whole > 0 ? 1 - part / whole : 0; }

}  // namespace

double quantile(std::vector<double>& values, double p) { return quantile_of(values, p); }
double quantile(std::vector<float>& values, double p) { return quantile_of(values, p); }

ErrorStatistics statistics(const std::vector<Eigen::Vector3f>& r, const std::vector<Eigen::Vector3f>& r0) {
  ErrorStatistics result;
  result.samples = r.size();
  if (r.empty()) return result;
  const auto n = static_cast<double>(r.size());
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = sum, sum0 = sum, squares0 = sum;
  for (std::size_t i = 0; i < r.size(); ++i) {
    const Eigen::Vector3d a = r[i].cast<double>(), b = r0[i].cast<double>();
    sum += a;
    squares += a.cwiseAbs2();
    sum0 += b;
    squares0 += b.cwiseAbs2();
  }
  const Eigen::Vector3d mean = sum / n;
  const Eigen::Vector3d variance = squares / n - mean.cwiseAbs2();
  const Eigen::Vector3d variance0 = squares0 / n - (sum0 / n).cwiseAbs2();
  const Eigen::Vector3d rms = (squares / n).cwiseSqrt();
  result.rmse = {rms[0], rms[1], rms[2], std::sqrt(squares.sum() / n)};
  result.bias = {mean[0], mean[1], mean[2], mean.norm()};
  result.variance_explained = {share(variance[0], variance0[0]), share(variance[1], variance0[1]),
                               share(variance[2], variance0[2]), share(variance.sum(), variance0.sum())};
  std::vector<float> sizes(r.size());
  const auto fill = [&](double Axes::*axis, auto size_of) {
    std::transform(r.begin(), r.end(), sizes.begin(), size_of);
    result.p95.*axis = quantile(sizes, 0.95);
    // All larger values are after this position.
    const auto tail = sizes.begin() + quantile_place(sizes.size(), 0.95),
               at = sizes.begin() + quantile_place(sizes.size(), 0.999);
    std::nth_element(tail, at, sizes.end());
    result.p999.*axis = static_cast<double>(*at);
    result.max.*axis = static_cast<double>(*std::max_element(at, sizes.end()));
  };
  fill(&Axes::x, [](const Eigen::Vector3f& v) { return std::abs(v[0]); });
  fill(&Axes::y, [](const Eigen::Vector3f& v) { return std::abs(v[1]); });
  fill(&Axes::z, [](const Eigen::Vector3f& v) { return std::abs(v[2]); });
  fill(&Axes::total, [](const Eigen::Vector3f& v) { return v.norm(); });
  return result;
}

std::optional<std::array<Interval, 4>> bootstrap_rmse(const std::vector<BlockSum>& blocks,
                                                      std::uint64_t seed) {
  constexpr int kResamples = 200;
  constexpr std::size_t kFewest = 5;
  if (blocks.size() < kFewest) return std::nullopt;
  std::mt19937_64 generator(seed);
  std::array<std::vector<double>, 4> values;
  for (int i = 0; i < kResamples; ++i) {
    BlockSum sum;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      const BlockSum& block = blocks[generator() % blocks.size()];
      sum.squares += block.squares;
      sum.count += block.count;
    }
    for (int axis = 0; axis < 3; ++axis)
      values[static_cast<std::size_t>(axis)].push_back(std::sqrt(sum.squares[axis] / sum.count));
    values[3].push_back(std::sqrt(sum.squares.sum() / sum.count));
  }
  std::array<Interval, 4> intervals;
  for (std::size_t k = 0; k < 4; ++k) intervals[k] = {quantile(values[k], 0.05), quantile(values[k], 0.95)};
  return intervals;
}

void Spectrum::add(const std::vector<Eigen::Vector3d>& residual, double period_s,
                   const std::function<double(double)>& passes) {
  static const auto kTables = [] {
    constexpr double kTurn = 2 * kPi;
    std::array<std::array<double, kWindow>, 3> tables{};  // cosine, sine, Hann window
    for (std::size_t i = 0; i < kWindow; ++i) {
      const double angle = kTurn * static_cast<double>(i) / kWindow;
      tables[0][i] = std::cos(angle);
      tables[1][i] = std::sin(angle);
      tables[2][i] = 0.5 - 0.5 * std::cos(angle);
    }
    return tables;
  }();
  for (std::size_t start = 0; start + kWindow <= residual.size(); start += kWindow / 2) {
    Eigen::Matrix3Xd piece(3, kWindow);
    for (int i = 0; i < kWindow; ++i) piece.col(i) = residual[start + static_cast<std::size_t>(i)];
    for (int i = 0; i < kWindow; ++i) piece.col(i) *= kTables[2][static_cast<std::size_t>(i)];
    for (int k = 1; k < kWindow / 2; ++k) {
      Eigen::Vector3d real = Eigen::Vector3d::Zero(), imaginary = real;
      for (int i = 0; i < kWindow; ++i) {
        const auto phase = static_cast<std::size_t>((i * k) % kWindow);
        real += kTables[0][phase] * piece.col(i);
        imaginary += kTables[1][phase] * piece.col(i);
      }
      power_.col(k) += real.cwiseAbs2() + imaginary.cwiseAbs2();
      passed_[k] += passes ? passes(k / (period_s * kWindow)) : 1;
    }
    windows_ += 1;
    period_sum_s_ += period_s;
  }
}

void Spectrum::add(const Spectrum& other) {
  power_ += other.power_;
  passed_ += other.passed_;
  windows_ += other.windows_;
  period_sum_s_ += other.period_sum_s_;
}

/// Returns a row per axis with the columns: mean of the low band, median of the high band, unused.
Eigen::Matrix3d Spectrum::median_and_mean() const {
  Eigen::Matrix3d result = Eigen::Matrix3d::Constant(std::numeric_limits<double>::quiet_NaN());
  if (windows_ == 0) return result;
  const double step_hz = windows_ / (period_sum_s_ * kWindow);
  // Below 50 records per second, both bands shrink with the highest frequency of the log.
  constexpr double kHighest_hz = 25;
  const double share = std::min(step_hz * kWindow / 2 / kHighest_hz, 1.0);
  for (int axis = 0; axis < 3; ++axis) {
    double low = 0, count = 0;
    std::vector<double> high;
    for (int k = 1; k < kWindow / 2; ++k) {
      const double frequency_hz = k * step_hz;
      if (frequency_hz >= 0.3 && frequency_hz <= 4 * share) {
        low += power_(axis, k) / passed_[k];
        count += 1;
      }
      if (frequency_hz >= 12 * share && frequency_hz <= kHighest_hz * share)
        high.push_back(power_(axis, k) / passed_[k]);
    }
    if (count == 0 || high.empty()) continue;
    result(axis, 0) = low / count;
    result(axis, 1) = quantile(high, 0.5);
  }
  return result;
}

Eigen::Vector3d Spectrum::low_band_to_floor() const {
  const Eigen::Matrix3d bands = median_and_mean();
  return bands.col(0).cwiseQuotient(bands.col(1));
}

SpectralLine Spectrum::line() const {
  constexpr double kLowest_hz = 4, kLeastShare = 0.25, kClearly = 10;
  constexpr int kWidth = 5, kLast = kWindow / 2;
  SpectralLine line;
  if (windows_ == 0) return line;
  const double step_hz = windows_ / (period_sum_s_ * kWindow);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::RowVectorXd power = power_.row(axis);
    std::vector<double> all(power.data() + 1, power.data() + kLast);
    const double median = quantile(all, 0.5), total = power.tail(kLast - 1).sum();
    for (int k = 1; k + kWidth <= kLast; ++k) {
      const double sum = power.segment(k, kWidth).sum(), share = total > 0 ? sum / total : 0;
      if (k * step_hz < kLowest_hz || share < std::max(kLeastShare, line.share)) continue;
      if (sum < kClearly * kWidth * median) continue;
      const double middle =
          power.segment(k, kWidth).dot(Eigen::RowVectorXd::LinSpaced(kWidth, k, k + kWidth - 1)) / sum;
      line = {middle * step_hz, axis, share};
    }
  }
  return line;
}

Eigen::Vector3d Spectrum::noise_floor_N() const {
  constexpr double kHannPower = 0.375 * kWindow;  // sum of the squared window
  const double passed = windows_ > 0 ? passed_.tail(kWindow / 2 - 1).mean() / windows_ : 1;
  return (median_and_mean().col(1) * (passed / kHannPower)).cwiseSqrt();
}

}  // namespace swarmcert::residuals
