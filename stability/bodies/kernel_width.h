/// @file Width of the vector registers that the SIMD kernels use.
#pragma once

namespace swarmcert::stability {

enum class KernelWidth { kNarrow, kAvx2, kAvx512 };

/// Returns the widest SIMD width that this processor supports (avx2 requires fused multiply-add). The environment
/// variable SWARMCERT_KERNELS may select a narrower one, `narrow` or `avx2`, to reproduce the results of other
/// processors.
/// @throws files::InputError if the variable is set to anything other than `narrow`, `avx2` or `avx512`.
KernelWidth widest_kernels();

}  // namespace swarmcert::stability
