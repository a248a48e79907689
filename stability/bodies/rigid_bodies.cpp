#include "stability/bodies/rigid_bodies.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>
#endif

#include <cmath>
#include <type_traits>

#include "stability/bodies/kernel_width.h"
#include "stability/model.h"

namespace swarmcert::stability {
namespace {

/// For integrators that normalise the quaternions themselves.
struct NoPull {};

#define SWARMCERT_KERNEL_FILE "stability/bodies/rigid_bodies_kernel.inc"
#include "stability/bodies/kernel_widths.inc"

struct Kernel {
  decltype(&narrow::derivatives) derivatives;
  decltype(&narrow::stages<true, true>) stages[2]
                                              [2];  ///< by whether rotors lag, and whether all vehicles move
  decltype(&narrow::drift) drift;
  decltype(&narrow::normalise) normalise;
};

/// Selects the widest kernel that this processor supports and `size` vehicles fill.
Kernel choose([[maybe_unused]] int size) {
#define SWARMCERT_KERNEL(width)                                     \
  {                                                                 \
    width::derivatives,                                             \
        {{width::stages<false, false>, width::stages<false, true>}, \
         {width::stages<true, false>, width::stages<true, true>}},  \
        width::drift, width::normalise                              \
  }
#if defined(SWARMCERT_WIDE_KERNELS)
  if (size > 4 && widest_kernels() == KernelWidth::kAvx512) return SWARMCERT_KERNEL(avx512);
  if (size > 2 && widest_kernels() >= KernelWidth::kAvx2) return SWARMCERT_KERNEL(avx2);
#endif
  return SWARMCERT_KERNEL(narrow);
#undef SWARMCERT_KERNEL
}

}  // namespace

struct RigidBodies::Choice {
  Kernel kernel;
};

RigidBodies::RigidBodies(int size)
    : size_(size),
      rows_(lines_for(static_cast<std::size_t>(size)) * kNumRows),
      choice_(std::make_unique<Choice>(Choice{choose(size)})) {}

RigidBodies::~RigidBodies() = default;

void RigidBodies::derivative(const double* state, double stabilise, double* derivative) const {
  choice_->kernel.derivatives(rows_.data(), state, size_, stabilise, derivative);
}

void RigidBodies::stage(int which, double step_s, double* start, double* state, double* sum) {
  choice_->kernel.stages[lags_][all_move_](which, 1, rows_.data(), size_, step_s, start, state, sum);
}

void RigidBodies::two_stages(int first, double step_s, double* start, double* state, double* sum) {
  choice_->kernel.stages[lags_][all_move_](first, 2, rows_.data(), size_, step_s, start, state, sum);
}

void RigidBodies::drift(double step_s, const double* start, const double* state, double* ahead) const {
  choice_->kernel.drift(rows_.data(), size_, step_s, start, state, ahead);
}

void RigidBodies::normalise(double* state) const { choice_->kernel.normalise(size_, state); }

}  // namespace swarmcert::stability
