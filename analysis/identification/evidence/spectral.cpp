#include "analysis/identification/evidence/spectral.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <unsupported/Eigen/FFT>
#include <utility>

namespace swarmcert::evidence {
namespace {

constexpr double kLeast_s = 1, kSlow_hz = 0.3, kMost_hz = 25, kPerOctave = 4;
constexpr double kRamp_s = 1;
constexpr int kSlowBands = 4;

/// Returns the largest number up to n without a prime factor above 5.
int smooth_length(int n) {
  for (;; --n) {
    int rest = n;
    for (const int prime : {2, 3, 5}) {
      while (rest % prime == 0) rest /= prime;
    }
    if (rest == 1) return n;
  }
}

int band_at(double frequency_hz) {
  if (frequency_hz < kSlow_hz) return static_cast<int>(kSlowBands * frequency_hz / kSlow_hz);
  return kSlowBands + static_cast<int>(kPerOctave * std::log2(frequency_hz / kSlow_hz));
}

double median_step_s(const std::vector<double>& times_s, int first, int count) {
  std::vector<double> steps;
  for (int i = first + 1; i < first + count; ++i)
    steps.push_back(times_s[static_cast<std::size_t>(i)] - times_s[static_cast<std::size_t>(i - 1)]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Steps that differ by less than a tenth are one sampling.
int sampling_of(double step_s) { return static_cast<int>(std::lround(10 * std::log(step_s))); }

}  // namespace

std::vector<Stretch> stretches(const std::vector<double>& times_s, const std::vector<char>& is_used,
                               const std::vector<char>& starts) {
  std::vector<Stretch> result;
  const int n = static_cast<int>(times_s.size());
  for (int first = 0, end = 0; first < n; first = end) {
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    end = first + 1;
    if (is_used[at(first)] == 0) continue;
    while (end < n && is_used[at(end)] != 0 && starts[at(end)] == 0) ++end;
    if (end - first < 8 || times_s[at(end - 1)] - times_s[at(first)] < kLeast_s) continue;
    const int count = smooth_length(end - first);
    result.push_back({first, count, median_step_s(times_s, first, count)});
  }
  return result;
}

Spectral::Spectral(std::vector<Stretch> stretches) : stretches_(std::move(stretches)) {
  struct Cell {
    double step_s = 0, sum_hz = 0;
    int count = 0;
  };
  std::map<std::pair<int, int>, Cell> cells;  // by sampling and band
  std::vector<std::vector<std::pair<int, int>>> key_of(stretches_.size());
  const auto visit = [&](const auto& use) {
    for (std::size_t s = 0; s < stretches_.size(); ++s) {
      const Stretch& stretch = stretches_[s];
      for (int k = 0; 2 * k <= stretch.count; ++k) {
        const double frequency_hz = k / (stretch.count * stretch.step_s);
        if (frequency_hz > kMost_hz) break;
        const bool is_real = k == 0 || 2 * k == stretch.count;
        use(s, std::make_pair(sampling_of(stretch.step_s), band_at(frequency_hz)), frequency_hz, is_real);
      }
    }
  };
  visit([&](std::size_t s, const std::pair<int, int>& key, double frequency_hz, bool is_real) {
    Cell& cell = cells[key];
    cell.step_s = stretches_[s].step_s;
    cell.count += is_real ? 1 : 2;
    cell.sum_hz += (is_real ? 1 : 2) * frequency_hz;
  });
  std::map<std::pair<int, int>, int> next;
  std::map<int, int> source_of;
  for (const auto& [key, cell] : cells) {
    const int source = source_of.emplace(key.first, static_cast<int>(source_of.size())).first->second;
    bands_.push_back({source, cell.step_s, cell.sum_hz / cell.count, rows_, cell.count});
    next[key] = rows_;
    rows_ += cell.count;
  }
  row_of_.resize(stretches_.size());
  visit([&](std::size_t s, const std::pair<int, int>& key, double, bool is_real) {
    int& row = next[key];
    row_of_[s].emplace_back(row, is_real ? -1 : row + 1);
    row += is_real ? 1 : 2;
  });
}

void Spectral::transform(std::size_t stretch, const float* series, float* to) const {
  static thread_local Eigen::FFT<float> fft;  // keeps its factors from one series to the next
  fft.SetFlag(Eigen::FFT<float>::HalfSpectrum);
  const int count = stretches_[stretch].count;
  std::vector<float> values(series, series + count);
  const int ramp = std::min(static_cast<int>(kRamp_s / stretches_[stretch].step_s), count / 4);
  for (int i = 0; i < ramp; ++i) {
    const auto share = static_cast<float>(0.5 - 0.5 * std::cos(M_PI * (i + 0.5) / ramp));
    values[static_cast<std::size_t>(i)] *= share;
    values[static_cast<std::size_t>(count - 1 - i)] *= share;
  }
  std::vector<std::complex<float>> spectrum;
  fft.fwd(spectrum, values);
  const std::vector<std::pair<int, int>>& rows = row_of_[stretch];
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto [real, imaginary] = rows[k];
    const float scale = std::sqrt((imaginary < 0 ? 1.0F : 2.0F) / static_cast<float>(count));
    to[real] = scale * spectrum[k].real();
    if (imaginary >= 0) to[imaginary] = scale * spectrum[k].imag();
  }
}

}  // namespace swarmcert::evidence
