/// @file The inner loops that dominate the time of checking a proof by parts. Sums in double without a guaranteed order
/// of summation, so error bounds must hold for every order; no fused multiply-adds. Not for users.
#pragma once

#include <cstddef>
#include <vector>

/// Compiles a function also for AVX2, four doubles at a time; the version is chosen when the program starts. The
/// results are the same.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__)
#define SWARMCERT_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define SWARMCERT_WIDE
#endif

namespace swarmcert::check {

/// Rows of a row-major matrix; `stride` is the distance between rows in doubles.
struct Rows {
  const double* data;
  int stride;
  const double* at(int i) const { return data + static_cast<std::ptrdiff_t>(i) * stride; }
};

/// out_rj += sum of a_ri b_ij over the i in `inner`, for r < rows and j < columns.
/// @param out row-major with row stride `out_stride`.
void add_product(double* out, int out_stride, int rows, int columns, Rows a, Rows b,
                 const std::vector<int>& inner);

/// The sums of c b, |c b| and |c| w.
struct FormSums {
  double constant, absolute, weighted;
};
FormSums form_sums(const double* c, const double* b, const double* w, int size);

/// The sums of c offset and c error over the positive c. relax() also replaces each c by `c above` if it is positive
/// and by `c below` otherwise.
struct RelaxedSums {
  double offsets, errors;
};
RelaxedSums relax(double* c, int size, const double* above, const double* below, const double* offset,
                  const double* error);

}  // namespace swarmcert::check
