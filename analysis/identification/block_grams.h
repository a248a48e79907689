/// @file Condenses flights to Gram matrices, from which any set of effects is fitted and cross-validated quickly.
///
/// For each block of 2 s, X holds the columns of all candidates and thetas after the accelerometer's filter, and r is
/// the residual of the current model (three axes stacked, newton): G = X'X, b = X'r, y = r'r. A coefficient vector c
/// leaves the squared error y - 2 c'b + c'Gc.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "analysis/identification/candidates.h"
#include "analysis/identification/whitening.h"

namespace swarmcert::identification {

struct Passes;

struct Block {
  Eigen::VectorXd gram;  ///< packed upper triangle of G by columns
  Eigen::VectorXd b;
  double y = 0;
  int records = 0;
  int flight = 0;        ///< index into Inputs::found.flights
  bool follows = false;  ///< directly follows the previous block of the same vehicle
};

/// Support of a candidate with one theta: where the effect would act if it existed.
struct Support {
  std::size_t records = 0;
  std::size_t blocks = 0;  ///< with at least a twentieth of their records in the support
  int flights = 0;         ///< with such a block
};

struct Grams {
  std::vector<Candidate> candidates;
  std::vector<std::vector<int>> first_column;  ///< by candidate and theta
  std::vector<std::vector<Support>> support;   ///< likewise
  int columns = 0;
  std::vector<Block> blocks;

  /// Index of element (i, j) in Block::gram.
  static Eigen::Index packed(int i, int j) {
    return i <= j ? Eigen::Index(j) * (j + 1) / 2 + i : packed(j, i);
  }
};

/// Selects rows and columns `columns` of a packed Gram matrix, and elements `columns` of a vector.
Eigen::MatrixXd part_of_gram(const Eigen::VectorXd& packed, const std::vector<int>& columns);
Eigen::VectorXd part_of(const Eigen::VectorXd& all, const std::vector<int>& columns);

/// Returns the columns of `candidates` without any flight.
Grams columns_of(std::vector<Candidate> candidates);

/// Condenses the flights. The result does not depend on the number of threads.
Grams block_grams(const Passes& passes, std::vector<Candidate> candidates);

/// Like block_grams() for whitened columns and a whitened residual.
Grams whitened_grams(const Passes& passes, std::vector<Candidate> candidates, const Noise& noise);

}  // namespace swarmcert::identification
