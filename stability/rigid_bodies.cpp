#include "stability/rigid_bodies.h"

#include "stability/model.h"

namespace swarmcert::stability {
namespace {

#define SWARMCERT_KERNEL_FILE "stability/rigid_bodies_kernel.inc"
#include "stability/kernel_widths.inc"

struct Kernel {
  decltype(&narrow::derivatives) derivatives;
  decltype(&narrow::stage) stage;
};

/// The widest that this processor has and `size` vehicles fill.
Kernel choose([[maybe_unused]] int size) {
#if defined(SWARMCERT_WIDE_KERNELS)
  if (size > 4 && __builtin_cpu_supports("avx512f") != 0) return {avx512::derivatives, avx512::stage};
  if (size > 2 && __builtin_cpu_supports("avx2") != 0) return {avx2::derivatives, avx2::stage};
#endif
  return {narrow::derivatives, narrow::stage};
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

void RigidBodies::stage(int which, double step_s, double* start, double* state, double* sum) const {
  choice_->kernel.stage(which, rows_.data(), size_, step_s, start, state, sum);
}

}  // namespace swarmcert::stability
