/// @file The loops in which a check of a proof by parts spends its time: sums in double, in no order that is promised,
/// so that error bounds must hold for all; no fused products. Not for users.
#pragma once

#include <cstddef>
#include <vector>

/// A function with doubles four at a time where the processor can, chosen when the program starts; the numbers are the
/// same.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__)
#define SWARMCERT_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define SWARMCERT_WIDE
#endif

namespace swarmcert::check {

/// Rows of a matrix, row-major, `stride` numbers from one to the next.
struct Rows {
  const double* data;
  int stride;
  const double* at(int i) const { return data + static_cast<std::ptrdiff_t>(i) * stride; }
};

/// out_rj += sum of a_ri b_ij over the i in `inner`, for r < rows and j < columns.
/// @param out rows with as many numbers from one to the next as `out_stride` says.
void add_product(double* out, int out_stride, int rows, int columns, Rows a, Rows b,
                 const std::vector<int>& inner);

/// Sum c b, sum |c b| and sum |c| w.
struct FormSums {
  double constant, absolute, weighted;
};
FormSums form_sums(const double* c, const double* b, const double* w, int size);

/// Sum c+ offset and sum c+ error over the positive c. Replaces each c by c above where it is positive, else by c
/// below.
struct RelaxedSums {
  double offsets, errors;
};
RelaxedSums relax(double* c, int size, const double* above, const double* below, const double* offset,
                  const double* error);

}  // namespace swarmcert::check
