#include "analysis/logs/motion_evidence.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

/// The formula of the file comment. Constant offsets are left out.
double agreement_bits(const Knots& knots, const std::vector<double>& a, const std::vector<double>& b,
                      double tolerance) {
  double n = 0, sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    if (!std::isfinite(a[i] + b[i])) continue;
    ++n;
    sa += a[i], sb += b[i], saa += a[i] * a[i], sbb += b[i] * b[i], sab += a[i] * b[i];
  }
  if (n < 8) return 0;
  const double va = std::max(0.0, saa / n - sa * sa / (n * n)),
               vb = std::max(0.0, sbb / n - sb * sb / (n * n));
  const double vab = sab / n - sa * sb / (n * n), noise = tolerance * tolerance;
  const double difference = std::max(0.0, va + vb - 2 * vab);
  const double bits = knots.independent(static_cast<std::size_t>(n)) / 2 *
                      std::log2((std::min(va, vb) + noise) / (difference + noise));
  return std::clamp(bits, -60.0, 1000.0);
}

}  // namespace

double derivative_bits(const Knots& knots, const Reading& position, const Reading& velocity) {
  constexpr double kTolerance_m_s = 0.1, kMostBits = 10;
  double bits = 0;
  for (std::size_t k = 0; k < 3; ++k)
    bits += std::min(kMostBits, agreement_bits(knots, position.slope[k], velocity.value[k], kTolerance_m_s));
  return bits;
}

ThreeSeries acceleration_of(const Knots& knots, const Reading& motion) {
  ThreeSeries acceleration;
  for (std::size_t k = 0; k < 3; ++k) {
    if (motion.carried.signal == kPosition && !motion.slope[k].empty())
      acceleration[k] = difference_of(knots, motion.slope[k]);
    else
      acceleration[k] = motion.slope[k];
  }
  return acceleration;
}

double thrust_axis_bits(const Knots& knots, const ThreeSeries& acceleration, const Reading& attitude) {
  constexpr double kTolerance_m_s2 = 0.4;
  double bits = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    if (acceleration[k].empty()) continue;
    std::vector<double> expected(knots.time_s.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double up = acceleration[2].empty() ? 0 : acceleration[2][i], tilt = attitude.rotation[8][i];
      expected[i] = tilt > 0.3 ? attitude.rotation[3 * k + 2][i] / tilt * (up + kGravity_m_s2) : std::nan("");
    }
    bits += agreement_bits(knots, acceleration[k], expected, kTolerance_m_s2);
  }
  return bits;
}

double specific_force_bits(const Knots& knots, const ThreeSeries& acceleration, const Reading* attitude,
                           const Reading& force) {
  constexpr double kTolerance_m_s2 = 0.4, kMean_m_s2 = 2, kWrongMean = 15;
  const bool is_body = force.carried.signal == kForceBody;
  double bits = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (acceleration[k].empty() || (is_body && attitude == nullptr && k < 2)) continue;
    std::vector<double> expected(knots.time_s.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      double along = force.value[k][i];
      if (is_body && attitude != nullptr) {
        along = 0;
        for (std::size_t j = 0; j < 3; ++j) along += attitude->rotation[3 * k + j][i] * force.value[j][i];
      }
      expected[i] = along - (k == 2 ? kGravity_m_s2 : 0);
    }
    bits += agreement_bits(knots, acceleration[k], expected, kTolerance_m_s2);
    if (std::abs(mean_of(expected) - mean_of(acceleration[k])) > kMean_m_s2) bits -= kWrongMean;
  }
  return bits;
}

double rate_bits(const Knots& knots, const Reading& attitude, const Reading& rates) {
  constexpr double kTolerance_rad_s = 0.1, kMostBits = 15;
  double bits = 0;
  for (std::size_t k = 0; k < 3; ++k)
    bits += std::min(kMostBits, agreement_bits(knots, attitude.value[k], rates.value[k], kTolerance_rad_s));
  return bits;
}

double tilt_rate_bits(const Knots& knots, const ThreeSeries& acceleration, const Reading& rates) {
  constexpr double kTolerance_rad_s = 0.2, kLeastBits = -3, kMostBits = 15;
  if (acceleration[0].empty() || acceleration[1].empty()) return 0;
  const std::size_t n = knots.time_s.size();
  // The tilt as a complex number, x + i y, turned by the yaw since the start.
  std::vector<double> forward(n), left(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double up = acceleration[2].empty() ? 0 : acceleration[2][i];
    forward[i] = acceleration[0][i] / std::max(up + kGravity_m_s2, 1.0);
    left[i] = acceleration[1][i] / std::max(up + kGravity_m_s2, 1.0);
  }
  forward = difference_of(knots, forward), left = difference_of(knots, left);
  std::vector<std::complex<double>> turned(n);
  std::complex<double> fit = 0;
  double yaw = 0, squares = 0, count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (std::isfinite(rates.value[2][i])) yaw += rates.value[2][i] * knots.step_s;
    turned[i] = std::polar(1.0, -yaw) * std::complex<double>(forward[i], left[i]);
    const std::complex<double> measured(rates.value[1][i], -rates.value[0][i]);
    const std::complex<double> product = measured * std::conj(turned[i]);
    if (std::isfinite(std::abs(product))) fit += product;
    // Knots follow each other within the memory of the motion: their differences are mostly noise.
    const double step = i == 0 ? kNaN : std::abs(turned[i] - turned[i - 1]);
    if (!std::isfinite(step)) continue;
    squares += step * step / 2;
    ++count;
  }
  const double tolerance = kTolerance_rad_s + (count > 0 ? std::sqrt(squares / count) : 0);
  std::vector<double> pitching(n), rolling(n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::complex<double> expected = turned[i] * std::polar(1.0, std::arg(fit));
    pitching[i] = expected.real(), rolling[i] = -expected.imag();
  }
  const auto bits = [&](const std::vector<double>& expected, std::size_t axis) {
    return std::clamp(agreement_bits(knots, expected, rates.value[axis], tolerance), kLeastBits, kMostBits);
  };
  return bits(pitching, 1) + bits(rolling, 0);
}

double following_bits(const Knots& knots, const Reading& a, const Reading& b) {
  constexpr double kTolerance = 0.1;  // m, m/s
  double bits = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    bits += agreement_bits(knots, a.value[k], b.value[k], kTolerance);
    if (a.value[k].empty() || b.value[k].empty()) continue;
    bits -= std::min(10.0, 2 * std::abs(mean_of(a.value[k]) - mean_of(b.value[k])));
  }
  return bits;
}

}  // namespace swarmcert::logs
