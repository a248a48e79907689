#include "lipschitz/checker/integer_rows.h"

#include <algorithm>
#include <climits>

namespace swarmcert::check {
namespace {

static_assert(sizeof(long) * CHAR_BIT == 64, "entries and halves of sums are taken as 64-bit words");

__extension__ typedef __int128 Wide;  // NOLINT(modernize-use-using): __extension__ needs it

/// 2^64 high + low for the two's complement halves of a wide integer.
mpz_class to_mpz(Wide x) {
  mpz_class result = static_cast<long>(x >> 64);
  result <<= 64;
  return result + static_cast<unsigned long>(x);
}

bool fits(const mpz_class& x) {
  return mpz_sizeinbase(x.get_mpz_t(), 2) <= static_cast<std::size_t>(IntegerRows::kWordBits);
}

}  // namespace

IntegerRows::IntegerRows(std::vector<std::vector<mpz_class>> rows) : rows_(std::move(rows)) {
  for (const std::vector<mpz_class>& row : rows_) {
    if (!std::all_of(row.begin(), row.end(), fits)) {
      words_.clear();
      return;
    }
    words_.emplace_back();
    for (const mpz_class& entry : row) words_.back().push_back(entry.get_si());
  }
}

mpz_class IntegerRows::inner(int i, int from_i, const IntegerRows& other, int j, int from_j,
                             int count) const {
  mpz_class sum = 0;
  if (words_.empty() || other.words_.empty()) {
    const mpz_class *const a = rows_[i].data() + from_i, *const b = other.rows_[j].data() + from_j;
    for (int k = 0; k < count; ++k) sum += a[k] * b[k];
    return sum;
  }
  const long *const a = words_[i].data() + from_i, *const b = other.words_[j].data() + from_j;
  for (int begin = 0; begin < count; begin += kAtOnce) {
    const int end = std::min(count, begin + kAtOnce);
    Wide part = 0;
    for (int k = begin; k < end; ++k) part += static_cast<Wide>(a[k]) * b[k];
    sum += to_mpz(part);
  }
  return sum;
}

}  // namespace swarmcert::check
