/// @file The arithmetic used by all flight code of this project, and a detector for compilers that change it.
///
/// Every product is rounded to the scalar's precision before it is added to a sum. A fused multiply-add rounds once
/// instead of twice and gives different bits; GCC contracts by default for targets that have the instruction.
/// `-ffp-contract=off` is an interface option of swarmcert::nn. `rounded()` prevents contraction even if a build system
/// drops that option, and `arithmetic_is_fused()` detects at run time that both safeguards failed.
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

/// Returns `product` and prevents the compiler from fusing it with a following addition.
///
/// The product passes through an empty assembler statement, which is opaque to the optimiser. Compiler features alone
/// do not suffice: clang-14 ignores its own `#pragma clang fp contract(off)` under -ffp-contract=fast, and the
/// vectoriser of GCC 12 drops __builtin_assoc_barrier and then fuses the vectorised code. The builtin is used on
/// targets without vector registers.
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

/// Returns true if `a * b + c` is rounded once (fused) instead of twice in this translation unit.
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

/// Returns the bit pattern of `x`.
template <typename Scalar>
inline typename detail::Bits<Scalar>::Type bits(Scalar x) {
  typename detail::Bits<Scalar>::Type pattern;
  std::memcpy(&pattern, &x, sizeof pattern);
  return pattern;
}

/// Returns true unless `x` is infinite or NaN. Tests the bits because under -ffinite-math-only compilers fold the
/// library's test to true.
template <typename Scalar>
inline bool is_finite(Scalar x) {
  return (bits(x) & detail::Bits<Scalar>::kExponent) != detail::Bits<Scalar>::kExponent;
}

}  // namespace swarmcert::nn
