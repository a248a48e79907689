#include "lipschitz/checker/integer_rows.h"

#include <algorithm>
#include <climits>

namespace swarmcert::check {
namespace {

static_assert(sizeof(long) * CHAR_BIT == 64, "entries and halves of sums are taken as 64-bit words");

__extension__ typedef __int128 Wide;  // NOLINT(modernize-use-using): __extension__ needs it

constexpr int kHalf = 64;

/// An exact sum of products of words. Up to kAtOnce products are summed in one wide integer; its halves are then added
/// to `low` and `high`.
struct WordSum {
  Wide low = 0, high = 0;

  void add_products(const long* a, const long* b, int count) {
    for (int begin = 0; begin < count; begin += IntegerRows::kAtOnce) {
      const int end = std::min(count, begin + IntegerRows::kAtOnce);
      Wide part = 0;
      for (int k = begin; k < end; ++k) part += static_cast<Wide>(a[k]) * b[k];
      low += static_cast<unsigned long>(part);
      high += part >> kHalf;
    }
  }

  /// Sets x to the sum, without an allocation if x has enough room.
  void get(mpz_class& x) const {
    const Wide upper = high + (low >> kHalf);
    x = static_cast<long>(upper >> kHalf);
    x <<= kHalf;
    x += static_cast<unsigned long>(upper);
    x <<= kHalf;
    x += static_cast<unsigned long>(low);
  }
};

constexpr mp_bitcnt_t kRoomForSum = 256;

/// Returns the number of words for an integer of this many bits.
std::size_t words_for(std::size_t bits) {
  return (bits + IntegerRows::kWordBits - 1) / IntegerRows::kWordBits;
}

std::size_t longest_entry(const std::vector<std::vector<mpz_class>>& rows) {
  std::size_t bits = 1;
  for (const std::vector<mpz_class>& row : rows)
    for (const mpz_class& entry : row) bits = std::max(bits, mpz_sizeinbase(entry.get_mpz_t(), 2));
  return bits;
}

}  // namespace

IntegerRows::IntegerRows(std::vector<std::vector<mpz_class>> rows) : rows_(std::move(rows)) {
  const std::size_t words = words_for(longest_entry(rows_));
  if (words > kMostWords) return;
  words_.resize(words);
  mpz_class rest, word;
  for (std::vector<mpz_class>& row : rows_) {
    for (auto& plane : words_) plane.emplace_back(row.size());
    for (std::size_t k = 0; k < row.size(); ++k) {
      rest = row[k];
      for (auto& plane : words_) {  // quotient and remainder have the sign of the entry
        mpz_tdiv_r_2exp(word.get_mpz_t(), rest.get_mpz_t(), kWordBits);
        mpz_tdiv_q_2exp(rest.get_mpz_t(), rest.get_mpz_t(), kWordBits);
        plane.back()[k] = word.get_si();
      }
    }
    row = {};
  }
  rows_ = {};
}

mpz_class IntegerRows::inner(int i, int from_i, const IntegerRows& other, int j, int from_j,
                             int count) const {
  const auto words = [&](std::size_t v, std::size_t w, mpz_class& x) {
    WordSum part;
    part.add_products(words_[v][i].data() + from_i, other.words_[w][j].data() + from_j, count);
    part.get(x);
  };
  mpz_class sum(0), scratch;
  if (!words_.empty() && !other.words_.empty()) {
    mpz_realloc2(sum.get_mpz_t(), kRoomForSum);
    words(0, 0, sum);
    for (std::size_t v = 0; v < words_.size(); ++v)
      for (std::size_t w = v == 0 ? 1 : 0; w < other.words_.size(); ++w) {
        words(v, w, scratch);
        scratch <<= (v + w) * kWordBits;
        sum += scratch;
      }
    return sum;
  }
  for (int k = 0; k < count; ++k) {
    scratch = entry(i, from_i + k) * other.entry(j, from_j + k);
    sum += scratch;
  }
  return sum;
}

mpz_class IntegerRows::entry(int i, int k) const {
  if (words_.empty()) return rows_[i][k];
  mpz_class result = 0;
  for (std::size_t w = words_.size(); w-- > 0;) result = (result << kWordBits) + words_[w][i][k];
  return result;
}

}  // namespace swarmcert::check
