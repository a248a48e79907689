/// @file Exact inner products of rows of integers, which dominate the time of an exact check of a large network. Not
/// for users.
#pragma once

#include <gmpxx.h>

#include <vector>

namespace swarmcert::check {

/// Rows of integers. Each entry is split into signed words of kWordBits bits, as many as the longest entry needs. Inner
/// products are computed in machine words, ten to fifty times faster than with GMP; GMP is used for more than
/// kMostWords words. Both are exact.
class IntegerRows {
 public:
  /// Bits per word, without the sign: the sum of kAtOnce products of two words fits into 127 bits.
  static constexpr int kWordBits = 60;
  static constexpr int kAtOnce = 64;
  static constexpr int kMostWords = 4;

  explicit IntegerRows(std::vector<std::vector<mpz_class>> rows);

  /// Returns the sum over k < count of (row i)[from_i + k] (row j of `other`)[from_j + k].
  mpz_class inner(int i, int from_i, const IntegerRows& other, int j, int from_j, int count) const;

 private:
  mpz_class entry(int i, int k) const;

  std::vector<std::vector<mpz_class>> rows_;  ///< empty if the entries are stored as words
  /// words_[w][i][k]: an entry is the sum over w of its words times 2^(w kWordBits). Empty if that would be too many
  /// words.
  std::vector<std::vector<std::vector<long>>> words_;
};

}  // namespace swarmcert::check
