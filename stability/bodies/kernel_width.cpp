#include "stability/bodies/kernel_width.h"

#include <algorithm>
#include <cstdlib>
#include <string>

#include "nn/base/input_error.h"

namespace swarmcert::stability {
namespace {

KernelWidth of_processor() {
#if defined(__x86_64__) && defined(__GNUC__)
  if (__builtin_cpu_supports("avx2") == 0 || __builtin_cpu_supports("fma") == 0) return KernelWidth::kNarrow;
  return __builtin_cpu_supports("avx512f") != 0 ? KernelWidth::kAvx512 : KernelWidth::kAvx2;
#else
  return KernelWidth::kNarrow;
#endif
}

KernelWidth asked_for() {
  const char* const value = std::getenv("SWARMCERT_KERNELS");
  const std::string text = value == nullptr ? "avx512" : value;
  if (text == "narrow") return KernelWidth::kNarrow;
  if (text == "avx2") return KernelWidth::kAvx2;
  if (text == "avx512") return KernelWidth::kAvx512;
  throw files::InputError(
      {"environment", "", "SWARMCERT_KERNELS", text, "unknown SIMD width", "say narrow, avx2 or avx512"});
}

}  // namespace

KernelWidth widest_kernels() {
  static const KernelWidth width = std::min(of_processor(), asked_for());
  return width;
}

}  // namespace swarmcert::stability
