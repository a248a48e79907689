/// @file Pseudo-random numbers with the same bits on every platform.
#pragma once

#include <cmath>
#include <cstdint>

namespace swarmcert::files {

/// splitmix64 (Steele, Lea, Flood 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  /// Uniform in [-1, 1).
  double symmetric() { return static_cast<double>(bits() >> 11) * 0x1p-52 - 1; }

  /// Returns one of 0 .. n - 1 for n > 0; the modulo bias is below n / 2^64.
  std::uint64_t below(std::uint64_t n) { return bits() % n; }

  /// Returns the sum of twelve uniform numbers minus 6: close to a standard normal distribution, without libm.
  double bell() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }

  /// Returns low * (high / low)^u for a uniform u, 0 < low <= high. The power is computed from the binary digits of u
  /// by square roots.
  double log_uniform(double low, double high) {
    double value = low;
    double ratio = high / low;
    const std::uint64_t digits = bits();
    for (int i = 0; i < 24; ++i) {
      ratio = std::sqrt(ratio);
      if ((digits >> i & 1) != 0) value *= ratio;
    }
    return value;
  }

 private:
  std::uint64_t state_;
};

}  // namespace swarmcert::files
