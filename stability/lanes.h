/// @file Eight floats that take one path through the flight code: the speed of simulated swarms.
///
/// A Lanes is a Scalar of the control laws (controller/scalar.h) that stands for the same variable of eight vehicles.
/// Each operation does in every lane what it does to a float alone, so the lanes hold the bits that fly. Only
/// comparisons that steer the code join the lanes: where they disagree, the result is worthless, and `split` says who
/// disagreed; the caller then computes those apart.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>
#define SWARMCERT_LANES_AVX2
#define SWARMCERT_FOR_LANES [[gnu::flatten, gnu::target("avx2")]]
#define SWARMCERT_LANE [[gnu::target("avx2")]]
#else
#define SWARMCERT_FOR_LANES [[gnu::flatten]]
#define SWARMCERT_LANE
#endif

namespace swarmcert::stability {

class Lanes {
 public:
  static constexpr int kCount = 8;
  static constexpr unsigned kAll = (1U << kCount) - 1;
  /// The lanes, as bits, in which the first comparison with different outcomes was true; 0 while there was none. Never
  /// reset here.
  static inline thread_local unsigned split = 0;

  SWARMCERT_LANE Lanes() : v_{} {}
  SWARMCERT_LANE explicit Lanes(float x) : v_(Vector{} + x) {}
  SWARMCERT_LANE explicit Lanes(double x) : Lanes(static_cast<float>(x)) {}
  SWARMCERT_LANE explicit Lanes(int x) : Lanes(static_cast<float>(x)) {}
  // Not trivial, so that every compiler passes it in memory: functions for processors with and without 256-bit
  // registers may call each other.
  SWARMCERT_LANE Lanes(const Lanes& other) : v_(other.v_) {}
  SWARMCERT_LANE Lanes& operator=(const Lanes& other) {
    v_ = other.v_;
    return *this;
  }

  SWARMCERT_LANE float operator[](int lane) const { return v_[lane]; }
  SWARMCERT_LANE void set(int lane, float x) { v_[lane] = x; }

  /// Which lanes a part of the vehicles takes, and what fills the others: copies of its first.
  struct Part {
    std::int32_t from[kCount] = {};
    std::int32_t taken[kCount] = {};  ///< -1 where it takes the lane, else 0

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

  SWARMCERT_LANE friend bool operator<(const Lanes& a, const Lanes& b) {
    return together(Choice{a.v_ < b.v_});
  }
  SWARMCERT_LANE friend bool operator>(const Lanes& a, const Lanes& b) {
    return together(Choice{a.v_ > b.v_});
  }
  SWARMCERT_LANE friend bool operator<=(const Lanes& a, const Lanes& b) {
    return together(Choice{a.v_ <= b.v_});
  }
  SWARMCERT_LANE friend bool operator>=(const Lanes& a, const Lanes& b) {
    return together(Choice{a.v_ >= b.v_});
  }
  SWARMCERT_LANE friend bool operator==(const Lanes& a, const Lanes& b) {
    return together(Choice{a.v_ == b.v_});
  }

  // As in controller/scalar.h and battery.h, lane by lane.
  SWARMCERT_LANE friend Lanes square_root(const Lanes& x) {
    const Vector held = x.v_ < Vector{} ? Vector{} : x.v_;
#if defined(SWARMCERT_LANES_AVX2)
    return Lanes(Raw{_mm256_sqrt_ps(held)});
#else
    Vector root;
    for (int i = 0; i < kCount; ++i) root[i] = std::sqrt(held[i]);
    return Lanes(Raw{root});
#endif
  }
  SWARMCERT_LANE friend Lanes absolute(const Lanes& x) { return Lanes(Raw{x.v_ < Vector{} ? -x.v_ : x.v_}); }
  SWARMCERT_LANE friend Lanes positive_part(const Lanes& x) {
    return Lanes(Raw{x.v_ < Vector{} ? Vector{} : x.v_});
  }
  SWARMCERT_LANE friend Lanes clamp(const Lanes& x, const Lanes& lower, const Lanes& upper) {
    const Raw from_below{x.v_ > upper.v_ ? upper.v_ : x.v_};
    return Lanes(Raw{x.v_ < lower.v_ ? lower.v_ : from_below.v});
  }
  SWARMCERT_LANE friend bool is_finite(const Lanes& x) {
    return together(Choice{x.v_ - x.v_ == Vector{}});  // infinite and NaN give NaN
  }
  /// PWM registers of eight vehicles.
  struct Registers {
    std::int32_t at[kCount] = {};
    std::uint16_t operator[](int lane) const { return static_cast<std::uint16_t>(at[lane]); }
  };
  SWARMCERT_LANE friend Registers pwm_register(const Lanes& p) {
    const Vector value = p.v_ * 65536.0F + 0.5F;
    const Vector most = Vector{} + 65535.0F;
    const Vector held = value > Vector{} ? (value >= most ? most : value) : Vector{};
    const Mask whole = __builtin_convertvector(held, Mask);
    Registers registers;
    std::memcpy(registers.at, &whole, sizeof whole);
    return registers;
  }

 private:
  // Code without 256-bit registers need not align its stack for them.
  using Vector = float __attribute__((vector_size(32), aligned(16)));
  using Mask = std::int32_t __attribute__((vector_size(32), aligned(16)));
  // Vectors as such are passed differently for different processors: inside a struct, by reference, they are not.
  struct Raw {
    Vector v;
  };
  struct Choice {
    Mask m;
  };

  SWARMCERT_LANE explicit Lanes(const Raw& raw) : v_(raw.v) {}

  SWARMCERT_LANE static bool together(const Choice& choice) {
#if defined(SWARMCERT_LANES_AVX2)
    const auto both =
        static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(reinterpret_cast<__m256i>(choice.m))));
#else
    unsigned both = 0;
    for (int i = 0; i < kCount; ++i) both |= choice.m[i] != 0 ? 1U << i : 0U;
#endif
    if (both == 0) return false;
    if (both != kAll && split == 0) split = both;
    return true;
  }

  Vector v_;
};

/// False where this processor cannot execute them.
inline bool lanes_are_fast() {
#if defined(SWARMCERT_LANES_AVX2)
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
#else
  return true;
#endif
}

}  // namespace swarmcert::stability
