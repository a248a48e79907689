#include "stability/rigid_bodies.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>
#endif

#include <cmath>

#include "stability/model.h"

namespace swarmcert::stability {
namespace {

#define SWARMCERT_KERNEL_FILE "stability/rigid_bodies_kernel.inc"
#include "stability/kernel_widths.inc"

struct Kernel {
  decltype(&narrow::derivatives) derivatives;
  decltype(&narrow::stage<true>) stage[2];  ///< by whether rotors lag
  decltype(&narrow::drift) drift;
  decltype(&narrow::normalise) normalise;
};

/// The widest that this processor has and `size` vehicles fill.
Kernel choose([[maybe_unused]] int size) {
#if defined(SWARMCERT_WIDE_KERNELS)
  if (size > 4 && __builtin_cpu_supports("avx512f") != 0)
    return {
        avx512::derivatives, {avx512::stage<false>, avx512::stage<true>}, avx512::drift, avx512::normalise};
  if (size > 2 && __builtin_cpu_supports("avx2") != 0)
    return {avx2::derivatives, {avx2::stage<false>, avx2::stage<true>}, avx2::drift, avx2::normalise};
#endif
  return {narrow::derivatives, {narrow::stage<false>, narrow::stage<true>}, narrow::drift, narrow::normalise};
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

void RigidBodies::stage(int which, double step_s, double* start, double* state, double* sum,
                        int force_z) const {
  choice_->kernel.stage[lags_ ? 1 : 0](which, rows_.data(), size_, step_s, start, state, sum, force_z);
}

void RigidBodies::drift(double step_s, const double* start, const double* state, double* ahead) const {
  choice_->kernel.drift(rows_.data(), size_, step_s, start, state, ahead);
}

void RigidBodies::normalise(double* state) const { choice_->kernel.normalise(size_, state); }

}  // namespace swarmcert::stability
