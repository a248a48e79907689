/// @file Width of the vector registers that the SIMD kernels use.
#pragma once

namespace swarmcert::stability {

enum class KernelWidth { kNarrow, kAvx2, kAvx512 };

/// The widest that this processor has, avx2 with fused operations; narrower where the environment variable
/// SWARMCERT_KERNELS says `narrow` or `avx2`, to see what other processors compute.
/// @throws files::InputError if the variable says anything else but `avx512`.
KernelWidth widest_kernels();

}  // namespace swarmcert::stability
