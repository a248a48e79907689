/// @file The arithmetic that all flight code of this project uses, and a detector for compilers that change it.
///
/// Every product is rounded to the scalar's precision before it enters a sum. A fused multiply-add rounds once
/// instead of twice and gives other bits; contraction is on by default in GCC for targets that have the
/// instruction. `-ffp-contract=off` is an interface option of swarmcert::nn; `rounded()` holds the line where a
/// build system dropped that option, and `arithmetic_is_fused()` tells at run time whether both failed.
#pragma once

#if defined(__FAST_MATH__)
#error "swarmcert::nn analyses IEEE arithmetic: build without -ffast-math"
#endif
#if __FLT_EVAL_METHOD__ != 0 && __FLT_EVAL_METHOD__ != 16
#error "swarmcert::nn rounds every operation to its own type: on 32-bit x86 build with -msse2 -mfpmath=sse"
#endif

#include <cstdint>
#include <cstring>

namespace swarmcert::nn {

/// Returns `product`, and keeps the compiler from fusing it with a following addition.
///
/// The product passes through an empty assembler statement, which no optimiser looks into: clang-14 ignores its own
/// `#pragma clang fp contract(off)` under -ffp-contract=fast, and the vectoriser of GCC 12 drops GCC's own
/// __builtin_assoc_barrier, after which what it vectorised is fused. The builtin serves where there are no vectors.
template <typename Scalar>
[[gnu::always_inline]] inline Scalar rounded(Scalar product) {
#if defined(__SSE2__)
  asm("" : "+x"(product));
  return product;
#elif defined(__aarch64__)
  asm("" : "+w"(product));
  return product;
#elif defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 12
  return __builtin_assoc_barrier(product);
#else
  asm("" : "+m"(product));
  return product;
#endif
}

/// True if this translation unit's `a * b + c` is rounded once (fused) instead of twice.
///
/// With a = b = 1 + 2^-23 and c = -(1 + 2^-22), the rounded product cancels c exactly; a fused one leaves 2^-46.
inline bool arithmetic_is_fused() {
  volatile float a = 1.00000012f;
  volatile float c = -1.00000024f;
  const float x = a;
  const float y = a;
  const float z = c;
  return rounded(x * y) + z != 0.0f;
}

namespace detail {

template <typename Scalar>
struct Bits;
template <>
struct Bits<float> {
  using Type = std::uint32_t;
  static constexpr Type kExponent = 0x7f800000u;
};
template <>
struct Bits<double> {
  using Type = std::uint64_t;
  static constexpr Type kExponent = 0x7ff0000000000000u;
};

}  // namespace detail

/// The bit pattern of `x`.
template <typename Scalar>
inline typename detail::Bits<Scalar>::Type bits(Scalar x) {
  typename detail::Bits<Scalar>::Type pattern;
  std::memcpy(&pattern, &x, sizeof pattern);
  return pattern;
}

/// True unless `x` is infinite or not a number. By bits, because a compiler told that there are no NaNs
/// (-ffinite-math-only) folds the library's test to true.
template <typename Scalar>
inline bool is_finite(Scalar x) {
  return (bits(x) & detail::Bits<Scalar>::kExponent) != detail::Bits<Scalar>::kExponent;
}

}  // namespace swarmcert::nn
