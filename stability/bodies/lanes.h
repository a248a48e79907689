/// @file Eight floats in one SIMD value, with which the flight code runs for eight vehicles at once.
///
/// Lanes is a Scalar type for the control laws (controller/scalar.h) that holds the same variable of eight vehicles.
/// Each operation does in every lane exactly what it does to a single float, so every lane has the bits that the flight
/// code computes. Only comparisons that decide a branch couple the lanes: if the lanes disagree, the result is invalid
/// and `split` holds the lanes that took one side; the caller then computes the two sides separately.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#include "stability/bodies/kernel_width.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>
#define SWARMCERT_LANES_AVX2
#define SWARMCERT_FOR_LANES [[gnu::flatten, gnu::target("avx2")]]
#define SWARMCERT_LANE [[gnu::target("avx2")]]
#else
#define SWARMCERT_FOR_LANES [[gnu::flatten]]
#define SWARMCERT_LANE
#endif

namespace swarmcert::controller {
template <typename Scalar>
struct ThrustMap;
}

namespace swarmcert::stability {

class Lanes {
  // Aligned to 16 bytes, so that code without 256-bit registers need not align its stack to 32.
  using Vector = float __attribute__((vector_size(32), aligned(16)));
  using Mask = std::int32_t __attribute__((vector_size(32), aligned(16)));

 public:
  static constexpr int kCount = 8;
  static constexpr unsigned kAll = (1U << kCount) - 1;
  /// Bit mask of the lanes in which the first comparison with differing outcomes was true; 0 if there was none yet.
  /// Never reset here. (Its type occurs nowhere in the flight code, so the compiler knows that comparisons modify no
  /// flight variable.)
  static inline thread_local std::uint64_t split = 0;

  /// The outcome of a comparison in each lane. Converting it to bool decides the branch for all lanes. && and ||
  /// combine conditions without short-circuiting; comparisons have no side effects, so the outcome is the same.
  struct Choice {
    Mask m;

    SWARMCERT_LANE explicit Choice(const Mask& mask) : m(mask) {}
    SWARMCERT_LANE Choice(const Choice& other) : m(other.m) {}  // not trivial, as in Lanes
    SWARMCERT_LANE Choice& operator=(const Choice& other) {
      m = other.m;
      return *this;
    }
    /// Returns the bit mask of the lanes in which the condition is true.
    SWARMCERT_LANE unsigned lanes() const {
#if defined(SWARMCERT_LANES_AVX2)
      return static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(reinterpret_cast<__m256i>(m))));
#else
      unsigned result = 0;
      for (int i = 0; i < kCount; ++i) result |= m[i] != 0 ? 1U << i : 0U;
      return result;
#endif
    }
    SWARMCERT_LANE operator bool() const {  // NOLINT: flight code writes `if (a < b)`
      const unsigned both = lanes();
      if (both == 0) return false;
      if (both != kAll && split == 0) split = both;
      return true;
    }
    SWARMCERT_LANE friend Choice operator&&(const Choice& a, const Choice& b) { return Choice(a.m & b.m); }
    SWARMCERT_LANE friend Choice operator||(const Choice& a, const Choice& b) { return Choice(a.m | b.m); }
    SWARMCERT_LANE friend Choice operator!(const Choice& a) { return Choice(~a.m); }
  };

  Lanes() = default;
  SWARMCERT_LANE explicit Lanes(float x) : v_{x, x, x, x, x, x, x, x} {}
  SWARMCERT_LANE explicit Lanes(double x) : Lanes(static_cast<float>(x)) {}
  SWARMCERT_LANE explicit Lanes(int x) : Lanes(static_cast<float>(x)) {}
  // Not trivial, so that every compiler passes Lanes in memory: functions compiled with and without 256-bit registers
  // may then call each other.
  SWARMCERT_LANE Lanes(const Lanes& other) : v_(other.v_) {}
  SWARMCERT_LANE Lanes& operator=(const Lanes& other) {
    v_ = other.v_;
    return *this;
  }

  SWARMCERT_LANE float operator[](int lane) const { return v_[lane]; }
  SWARMCERT_LANE void set(int lane, float x) { v_[lane] = x; }

  /// Selects a subset of the lanes; the other lanes are filled with copies of its first.
  struct Part {
    std::int32_t from[kCount] = {};
    std::int32_t taken[kCount] = {};  ///< -1 for lanes of the subset, else 0

    explicit Part(unsigned lanes) {
      int first = 0;
      while (first < kCount - 1 && (lanes >> first & 1) == 0) ++first;
      for (int lane = 0; lane < kCount; ++lane) {
        const bool takes = (lanes >> lane & 1) != 0;
        from[lane] = takes ? lane : first;
        taken[lane] = takes ? -1 : 0;
      }
    }
  };
  SWARMCERT_LANE Lanes filled(const Part& part) const {
#if defined(SWARMCERT_LANES_AVX2)
    Mask from;
    std::memcpy(&from, part.from, sizeof from);
    return Lanes(Raw{__builtin_shuffle(v_, from)});
#else
    Lanes result;
    for (int lane = 0; lane < kCount; ++lane) result.v_[lane] = v_[part.from[lane]];
    return result;
#endif
  }
  SWARMCERT_LANE void take(const Lanes& other, const Part& part) {
    Mask taken;
    std::memcpy(&taken, part.taken, sizeof taken);
    v_ = taken != 0 ? other.v_ : v_;
  }

  SWARMCERT_LANE friend Lanes operator+(const Lanes& a, const Lanes& b) { return Lanes(Raw{a.v_ + b.v_}); }
  SWARMCERT_LANE friend Lanes operator-(const Lanes& a, const Lanes& b) { return Lanes(Raw{a.v_ - b.v_}); }
  SWARMCERT_LANE friend Lanes operator-(const Lanes& a) { return Lanes(Raw{-a.v_}); }
  SWARMCERT_LANE friend Lanes operator/(const Lanes& a, const Lanes& b) { return Lanes(Raw{a.v_ / b.v_}); }
  SWARMCERT_LANE friend Lanes product(const Lanes& a, const Lanes& b) { return Lanes(Raw{a.v_ * b.v_}); }

  SWARMCERT_LANE friend Choice operator<(const Lanes& a, const Lanes& b) { return Choice(a.v_ < b.v_); }
  SWARMCERT_LANE friend Choice operator>(const Lanes& a, const Lanes& b) { return Choice(a.v_ > b.v_); }
  SWARMCERT_LANE friend Choice operator<=(const Lanes& a, const Lanes& b) { return Choice(a.v_ <= b.v_); }
  SWARMCERT_LANE friend Choice operator>=(const Lanes& a, const Lanes& b) { return Choice(a.v_ >= b.v_); }
  SWARMCERT_LANE friend Choice operator==(const Lanes& a, const Lanes& b) { return Choice(a.v_ == b.v_); }

  // The functions of controller/scalar.h and battery.h, lane by lane.
  SWARMCERT_LANE friend Lanes square_root(const Lanes& x) {
#if defined(SWARMCERT_LANES_AVX2)
    return Lanes(Raw{_mm256_sqrt_ps(_mm256_max_ps(Vector{}, x.v_))});
#else
    const Vector held = x.v_ < Vector{} ? Vector{} : x.v_;
    Vector root;
    for (int i = 0; i < kCount; ++i) root[i] = std::sqrt(held[i]);
    return Lanes(Raw{root});
#endif
  }
  // The larger of the two operands; the second if they are equal or one is NaN, as the AVX instruction does.
  SWARMCERT_LANE friend Lanes absolute(const Lanes& x) {
#if defined(SWARMCERT_LANES_AVX2)
    return Lanes(Raw{_mm256_max_ps(-x.v_, x.v_)});
#else
    return Lanes(Raw{x.v_ < Vector{} ? -x.v_ : x.v_});
#endif
  }
  SWARMCERT_LANE friend Lanes positive_part(const Lanes& x) {
#if defined(SWARMCERT_LANES_AVX2)
    return Lanes(Raw{_mm256_max_ps(Vector{}, x.v_)});
#else
    return Lanes(Raw{x.v_ < Vector{} ? Vector{} : x.v_});
#endif
  }
  SWARMCERT_LANE friend Lanes clamp(const Lanes& x, const Lanes& lower, const Lanes& upper) {
    const Raw from_below{x.v_ > upper.v_ ? upper.v_ : x.v_};
    return Lanes(Raw{x.v_ < lower.v_ ? lower.v_ : from_below.v});
  }
  SWARMCERT_LANE friend Choice is_finite(const Lanes& x) {
    return Choice(x.v_ - x.v_ == Vector{});  // infinity and NaN give NaN
  }
  // The flight code's PWM is not used in lanes, and computing it could split them; logs compute it from the forces
  // (ControllerBank::report()).
  struct Nothing {};
  SWARMCERT_LANE friend Nothing pwm_register(const Lanes&) { return {}; }
  SWARMCERT_LANE friend Lanes pwm_of_force(const controller::ThrustMap<Lanes>&, const Lanes&, const Lanes&) {
    return Lanes(0);
  }

 private:
  // The calling convention of a bare vector depends on the target processor; that of a struct passed by reference does
  // not.
  struct Raw {
    Vector v;
  };
  SWARMCERT_LANE explicit Lanes(const Raw& raw) : v_(raw.v) {}

  friend class DoubleLanes;

  Vector v_;
};

/// The same variable of eight vehicles in double precision: measurements are computed in double and then rounded.
class DoubleLanes {
  using Half = double __attribute__((vector_size(32), aligned(16)));

 public:
  SWARMCERT_LANE DoubleLanes() : low_{}, high_{} {}
  SWARMCERT_LANE explicit DoubleLanes(int x) : low_(Half{} + x), high_(Half{} + x) {}
  SWARMCERT_LANE explicit DoubleLanes(const double* at) {
#if defined(SWARMCERT_LANES_AVX2)
    low_ = _mm256_loadu_pd(at);  // a bytewise copy would become two dependent moves
    high_ = _mm256_loadu_pd(at + 4);
#else
    std::memcpy(&low_, at, sizeof low_);
    std::memcpy(&high_, at + 4, sizeof high_);
#endif
  }
  SWARMCERT_LANE DoubleLanes(const DoubleLanes& other) : low_(other.low_), high_(other.high_) {}
  SWARMCERT_LANE DoubleLanes& operator=(const DoubleLanes& other) {
    low_ = other.low_;
    high_ = other.high_;
    return *this;
  }

  SWARMCERT_LANE friend DoubleLanes operator+(const DoubleLanes& a, const DoubleLanes& b) {
    return DoubleLanes(a.low_ + b.low_, a.high_ + b.high_);
  }
  SWARMCERT_LANE friend DoubleLanes operator-(const DoubleLanes& a, const DoubleLanes& b) {
    return DoubleLanes(a.low_ - b.low_, a.high_ - b.high_);
  }
  SWARMCERT_LANE friend DoubleLanes operator*(const DoubleLanes& a, const DoubleLanes& b) {
    return DoubleLanes(a.low_ * b.low_, a.high_ * b.high_);
  }
  SWARMCERT_LANE friend DoubleLanes operator/(const DoubleLanes& a, const DoubleLanes& b) {
    return DoubleLanes(a.low_ / b.low_, a.high_ / b.high_);
  }

  SWARMCERT_LANE Lanes rounded() const {
    Lanes result;
#if defined(SWARMCERT_LANES_AVX2)
    const __m256 low = _mm256_castps128_ps256(_mm256_cvtpd_ps(low_));
    result.v_ = _mm256_insertf128_ps(low, _mm256_cvtpd_ps(high_), 1);
#else
    for (int i = 0; i < 4; ++i) {
      result.v_[i] = static_cast<float>(low_[i]);
      result.v_[4 + i] = static_cast<float>(high_[i]);
    }
#endif
    return result;
  }

  /// Widens float lanes to double, which is exact.
  SWARMCERT_LANE static void widen(const Lanes& x, double* to) {
#if defined(SWARMCERT_LANES_AVX2)
    _mm256_storeu_pd(to, _mm256_cvtps_pd(_mm256_castps256_ps128(x.v_)));
    _mm256_storeu_pd(to + 4, _mm256_cvtps_pd(_mm256_extractf128_ps(x.v_, 1)));
#else
    for (int i = 0; i < Lanes::kCount; ++i) to[i] = static_cast<double>(x.v_[i]);
#endif
  }

 private:
  SWARMCERT_LANE DoubleLanes(const Half& low, const Half& high) : low_(low), high_(high) {}

  Half low_, high_;
};

/// Returns false if this processor cannot execute the lane instructions.
inline bool lanes_are_fast() {
#if defined(SWARMCERT_LANES_AVX2)
  return widest_kernels() >= KernelWidth::kAvx2;
#else
  return true;
#endif
}

}  // namespace swarmcert::stability
