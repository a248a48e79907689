// Powers x^-1.7 = e^(-1.7 ln x) by stability/effects/vector_functions.inc, compared with those functions of SLEEF that
// give the same bits for every SIMD width (cinz, without fused multiply-adds).
//   cmake --build --preset release --target benchmark_vector_functions &&
//   build/release/tests/benchmarks/benchmark_vector_functions
#include <fmt/core.h>
#include <immintrin.h>
#include <sleef.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <type_traits>
#include <utility>

#include "stability/bodies/kernel_width.h"
#include "stability/bodies/rigid_bodies.h"
#include "stability/effects/function_tables.h"

namespace swarmcert::stability {
namespace {

#define SWARMCERT_KERNEL_FILE "benchmarks/vector_powers_kernel.inc"
#include "stability/bodies/kernel_widths.inc"

constexpr int kCount = 1 << 12;
constexpr double kExponent = -1.7;

void sleef_by_two(const double* x, int count, double exponent, double* result) {
  for (int at = 0; at < count; at += 2) {
    const __m128d log = Sleef_cinz_logd2_u10sse2(_mm_load_pd(x + at));
    _mm_store_pd(result + at, Sleef_cinz_expd2_u10sse2(_mm_mul_pd(log, _mm_set1_pd(exponent))));
  }
}

void sleef_by_four(const double* x, int count, double exponent, double* result) {
  for (int at = 0; at < count; at += 4) {
    const __m256d log = Sleef_cinz_logd4_u10avx(_mm256_load_pd(x + at));
    _mm256_store_pd(result + at, Sleef_cinz_expd4_u10avx(_mm256_mul_pd(log, _mm256_set1_pd(exponent))));
  }
}

void sleef_by_eight(const double* x, int count, double exponent, double* result) {
  for (int at = 0; at < count; at += 8) {
    const __m512d log = Sleef_cinz_logd8_u10avx512fnofma(_mm512_load_pd(x + at));
    _mm512_store_pd(result + at,
                    Sleef_cinz_expd8_u10avx512fnofma(_mm512_mul_pd(log, _mm512_set1_pd(exponent))));
  }
}

using Powers = decltype(&sleef_by_two);

/// Returns the processor time per number in ns, the best of many rounds.
double time_ns(Powers powers, const Rows& x, Rows& result) {
  double best = 1e300;
  for (int round = 0; round < 100; ++round) {
    constexpr int kRepeats = 50;
    const std::clock_t start = std::clock();
    for (int i = 0; i < kRepeats; ++i) powers(x.data(), kCount, kExponent, result.data());
    best = std::min(best, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / kRepeats);
  }
  return best / kCount * 1e9;
}

void compare(const char* width, Powers ours, Powers theirs) {
  Rows x(lines_for(kCount)), result(lines_for(kCount));
  for (int i = 0; i < kCount; ++i) x.data()[i] = 0.2 + 3.0 * i / kCount;
  const double own_ns = time_ns(ours, x, result), sleef_ns = time_ns(theirs, x, result);
  fmt::print("{:<8} {:6.2f} ns, SLEEF {:6.2f} ns: {:.2f} times as long\n", width, own_ns, sleef_ns,
             sleef_ns / own_ns);
}

}  // namespace

void run() {
  compare("narrow", narrow::powers, sleef_by_two);
  if (widest_kernels() >= KernelWidth::kAvx2) compare("avx2", avx2::powers, sleef_by_four);
  if (widest_kernels() >= KernelWidth::kAvx512) compare("avx512", avx512::powers, sleef_by_eight);
}

}  // namespace swarmcert::stability

int main() { swarmcert::stability::run(); }
