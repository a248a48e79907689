/// @file Flights condensed to small matrices, so that any set of effects can be fitted and cross-validated in no time.
///
/// Over each block of 2 s, with columns X of all candidates and thetas behind the accelerometer's filter, and the
/// residual r of the model at hand (three axes stacked, newton): G = X'X, b = X'r, y = r'r. A coefficient vector c
/// leaves y - 2 c'b + c'Gc.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "analysis/residuals/comparison.h"
#include "analysis/residuals/inputs.h"
#include "stability/effects/effect.h"

namespace swarmcert::identification {

/// An effect that may be missing, with the thetas to try.
struct Candidate {
  std::string name;
  stability::EffectSpec spec;  ///< as the model file would name it, without values
  stability::EffectInfo info;
  std::vector<std::vector<double>> thetas;
};

/// What the flights of one kind of vehicle cover.
struct Coverage {
  stability::FlightRange range;
  bool has_neighbours = false;
  double speed_rms_m_s = 0;
  std::size_t records = 0;
};

struct Block {
  Eigen::VectorXd gram;  ///< packed upper triangle of G, column by column
  Eigen::VectorXd b;
  double y = 0;
  int records = 0;
  int flight = 0;  ///< index into Inputs::found.flights
};

/// Support of one candidate with one theta: where the effect, if it exists, acts.
struct Support {
  std::size_t records = 0;
  std::size_t blocks = 0;  ///< with at least a twentieth of their records in support
};

struct Grams {
  std::vector<Candidate> candidates;
  std::vector<std::vector<int>> first_column;  ///< by candidate and theta
  std::vector<std::vector<Support>> support;   ///< likewise
  int columns = 0;
  std::vector<Block> blocks;

  /// Place of element (i, j) in Block::gram.
  static Eigen::Index packed(int i, int j) {
    return i <= j ? Eigen::Index(j) * (j + 1) / 2 + i : packed(j, i);
  }
};

/// Coverage of the flights `which` (indices into inputs.found.flights) by vehicles of `kind`.
Coverage coverage(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                  int jobs);

/// Every effect of the registry that a force can reveal, with its grid fitted to the coverage. Effects of neighbours
/// are left out where nobody has one, lags and delays where `model` has them; deep sets always, because a network
/// must be named.
std::vector<Candidate> all_candidates(const stability::Model& model, const Coverage& coverage);

/// One candidate by name. Of an effect that `model` has already, the candidate is a change of its coefficients.
/// @throws std::invalid_argument if there is none.
Candidate candidate(const std::string& name, const stability::Model& model, const Coverage& coverage);

/// True for lags and delays that `model` has: a second one cannot be written as a change of the first.
bool is_taken(const std::string& name, const stability::Model& model);

/// Condenses flights. The result does not depend on `jobs`.
Grams block_grams(const residuals::Inputs& inputs, const std::string& kind, std::vector<Candidate> candidates,
                  const std::vector<int>& which, int jobs, const residuals::Progress& progress);

}  // namespace swarmcert::identification
