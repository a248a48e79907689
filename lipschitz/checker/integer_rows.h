/// @file Exact inner products of rows of integers: what an exact check of a large network spends its time on.
#pragma once

#include <gmpxx.h>

#include <vector>

namespace swarmcert::check {

/// Rows of integers. Where every entry has at most kWordBits bits, inner products are summed in machine words, about ten
/// times faster than by GMP; nothing is rounded either way.
class IntegerRows {
 public:
  /// Bits of an entry, without its sign: kAtOnce products of two of them fit into 127 bits.
  static constexpr int kWordBits = 60;
  static constexpr int kAtOnce = 64;

  explicit IntegerRows(std::vector<std::vector<mpz_class>> rows);

  /// The sum over k < count of (row i)[from_i + k] (row j of `other`)[from_j + k].
  mpz_class inner(int i, int from_i, const IntegerRows& other, int j, int from_j, int count) const;

 private:
  std::vector<std::vector<mpz_class>> rows_;
  std::vector<std::vector<long>> words_;  ///< the same entries; empty where one does not fit
};

}  // namespace swarmcert::check
