/// @file Exact inner products of rows of integers: what an exact check of a large network spends its time on. Not for
/// users.
#pragma once

#include <gmpxx.h>

#include <vector>

namespace swarmcert::check {

/// Rows of integers, each cut into words of kWordBits bits with its sign, as many as the longest entry needs. Inner
/// products are summed in machine words, ten to fifty times faster than by GMP; beyond kMostWords words GMP takes over.
/// Nothing is rounded either way.
class IntegerRows {
 public:
  /// Bits of a word, without its sign: kAtOnce products of two of them fit into 127 bits.
  static constexpr int kWordBits = 60;
  static constexpr int kAtOnce = 64;
  static constexpr int kMostWords = 4;

  explicit IntegerRows(std::vector<std::vector<mpz_class>> rows);

  /// The sum over k < count of (row i)[from_i + k] (row j of `other`)[from_j + k].
  mpz_class inner(int i, int from_i, const IntegerRows& other, int j, int from_j, int count) const;

 private:
  mpz_class entry(int i, int k) const;

  std::vector<std::vector<mpz_class>> rows_;  ///< empty where the words hold the entries
  /// words_[w][i][k]: an entry is the sum over w of its words times 2^(w kWordBits); empty where that are too many
  std::vector<std::vector<std::vector<long>>> words_;
};

}  // namespace swarmcert::check
