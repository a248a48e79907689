#include "lipschitz/checker/products.h"

#include <cmath>
#include <cstddef>

namespace swarmcert::check {
namespace {

constexpr std::size_t kAtOnce = 4;

/// Computes two rows of the product at once, so that each row of b is read only once for both.
SWARMCERT_WIDE void add_to_two(double* __restrict first, double* __restrict second, int columns,
                               const double* a, const double* a_second, Rows b, const int* inner,
                               std::size_t count) {
  std::size_t n = 0;
  for (; n + kAtOnce <= count; n += kAtOnce) {
    const int i = inner[n], k = inner[n + 1], l = inner[n + 2], m = inner[n + 3];
    const double *const p = b.at(i), *const q = b.at(k), *const r = b.at(l), *const s = b.at(m);
    const double c = a[i], d = a[k], e = a[l], f = a[m];
    const double g = a_second[i], h = a_second[k], t = a_second[l], u = a_second[m];
    for (int j = 0; j < columns; ++j) {
      first[j] += (c * p[j] + d * q[j]) + (e * r[j] + f * s[j]);
      second[j] += (g * p[j] + h * q[j]) + (t * r[j] + u * s[j]);
    }
  }
  for (; n < count; ++n) {
    const double* const p = b.at(inner[n]);
    const double c = a[inner[n]], d = a_second[inner[n]];
    for (int j = 0; j < columns; ++j) {
      first[j] += c * p[j];
      second[j] += d * p[j];
    }
  }
}

SWARMCERT_WIDE void add_to_one(double* __restrict out, int columns, const double* a, Rows b, const int* inner,
                               std::size_t count) {
  std::size_t n = 0;
  for (; n + kAtOnce <= count; n += kAtOnce) {
    const int i = inner[n], k = inner[n + 1], l = inner[n + 2], m = inner[n + 3];
    const double *const p = b.at(i), *const q = b.at(k), *const r = b.at(l), *const s = b.at(m);
    const double c = a[i], d = a[k], e = a[l], f = a[m];
    for (int j = 0; j < columns; ++j) out[j] += (c * p[j] + d * q[j]) + (e * r[j] + f * s[j]);
  }
  for (; n < count; ++n) {
    const double* const p = b.at(inner[n]);
    const double c = a[inner[n]];
    for (int j = 0; j < columns; ++j) out[j] += c * p[j];
  }
}

/// Sums are split into this many partial sums, which vectorise.
constexpr int kLanes = 4;

double total(const double* lanes) { return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]); }

}  // namespace

SWARMCERT_WIDE FormSums form_sums(const double* __restrict c, const double* __restrict b,
                                  const double* __restrict w, int size) {
  double value[kLanes] = {}, sizes[kLanes] = {}, weighted[kLanes] = {};
  int i = 0;
  for (; i + kLanes <= size; i += kLanes)
    for (int lane = 0; lane < kLanes; ++lane) {
      const double term = c[i + lane] * b[i + lane];
      value[lane] += term;
      sizes[lane] += std::abs(term);
      weighted[lane] += std::abs(c[i + lane]) * w[i + lane];
    }
  for (; i < size; ++i) {
    value[0] += c[i] * b[i];
    sizes[0] += std::abs(c[i] * b[i]);
    weighted[0] += std::abs(c[i]) * w[i];
  }
  return {total(value), total(sizes), total(weighted)};
}

SWARMCERT_WIDE RelaxedSums relax(double* __restrict c, int size, const double* __restrict above,
                                 const double* __restrict below, const double* __restrict offset,
                                 const double* __restrict error) {
  double offsets[kLanes] = {}, errors[kLanes] = {};
  int i = 0;
  for (; i + kLanes <= size; i += kLanes)
    for (int lane = 0; lane < kLanes; ++lane) {
      const double value = c[i + lane];
      const double positive = 0.5 * (value + std::abs(value)),
                   rest = value - positive;  // value or 0, exactly
      offsets[lane] += positive * offset[i + lane];
      errors[lane] += positive * error[i + lane];
      c[i + lane] = positive * above[i + lane] + rest * below[i + lane];
    }
  for (; i < size; ++i) {
    const double positive = 0.5 * (c[i] + std::abs(c[i])), rest = c[i] - positive;
    offsets[0] += positive * offset[i];
    errors[0] += positive * error[i];
    c[i] = positive * above[i] + rest * below[i];
  }
  return {total(offsets), total(errors)};
}

void add_product(double* out, int out_stride, int rows, int columns, Rows a, Rows b,
                 const std::vector<int>& inner) {
  int r = 0;
  for (; r + 2 <= rows; r += 2, out += 2 * static_cast<std::ptrdiff_t>(out_stride))
    add_to_two(out, out + out_stride, columns, a.at(r), a.at(r + 1), b, inner.data(), inner.size());
  if (r < rows) add_to_one(out, columns, a.at(r), b, inner.data(), inner.size());
}

}  // namespace swarmcert::check
