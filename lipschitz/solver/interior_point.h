/// @file A primal-dual interior-point method for matrix inequalities whose constraint matrices have rank two.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lipschitz/base/stop.h"

namespace swarmcert::lipschitz {

/// S(y) = C + y_0 A_0 + sum_{i >= 1} y_i A_i, symmetric, with A_0 = diag(I, 0) over the inputs and
/// A_i = -(a_i e_i' + e_i a_i'), where e_i selects variable inputs() + i - 1: the form of LipSDP-Neuron and of its
/// restriction to a box. Implementations may exploit the sparsity pattern of A.
class RankTwoInequality {
 public:
  virtual ~RankTwoInequality() = default;

  virtual Eigen::Index size() const = 0;    ///< rows of S
  virtual Eigen::Index inputs() const = 0;  ///< rows that A_0 touches, the first ones
  Eigen::Index neurons() const { return size() - inputs(); }

  /// Returns the first index of each block of the block tridiagonal S, followed by the size of S; two entries mean that
  /// S is dense.
  virtual std::vector<Eigen::Index> slack_blocks() const { return {0, size()}; }

  /// Returns sum_j y_j A_j.
  virtual Eigen::MatrixXd linear(const Eigen::VectorXd& y) const = 0;
  /// Returns S(y).
  virtual Eigen::MatrixXd slack(const Eigen::VectorXd& y) const = 0;
  /// Returns X A, where column i of A is a_i; X is [rows x size].
  virtual Eigen::MatrixXd times_a(const Eigen::MatrixXd& x) const = 0;
  /// Returns A' X.
  virtual Eigen::MatrixXd a_transposed_times(const Eigen::MatrixXd& x) const = 0;
  /// Returns X D for D with the sparsity pattern of S.
  virtual Eigen::MatrixXd times_patterned(const Eigen::MatrixXd& x, const Eigen::MatrixXd& d) const = 0;
  /// Returns for each neuron, ascending from 0, the multiplier that it shares with others; empty: each has its own.
  virtual std::vector<Eigen::Index> ties() const { return {}; }
};

struct InteriorPointOptions {
  double relative_gap = 2e-8;   ///< stop when y_0 is within this of the optimum, judged by mu,
  double infeasibility = 1e-7;  ///< and the dual constraints are satisfied to this accuracy
  int max_iterations = 80;
  Stop stop;  ///< checked several times per iteration
};

/// Why a search stopped. The points are usable in every case; only kGapReached means that they are near the optimum.
enum class LipSdpStop { kNothingRun, kGapReached, kIterationLimit, kNumericalLimit, kCancelled, kTimeLimit };

/// "gap reached", ...
const char* name(LipSdpStop stop);
/// Returns whether the search was stopped from outside and would have continued.
constexpr bool is_interrupted(LipSdpStop stop) {
  return stop == LipSdpStop::kCancelled || stop == LipSdpStop::kTimeLimit;
}

/// Returns why a search must end now, or nothing if it may continue.
std::optional<LipSdpStop> why_stopped(const Stop& stop);

struct InteriorPointResult {
  LipSdpStop stop = LipSdpStop::kNothingRun;
  int iterations = 0;
  std::vector<Eigen::VectorXd>
      points;  ///< strictly feasible in floating point, best last; the first is the start
  /// (y_0 - dual objective) / y_0 of the iterate from which each point was reached; infinity for the first.
  std::vector<double> gaps;
  double best_dual = 0;  ///< best dual objective: a lower bound on the optimum, up to round-off
};

/// Minimises y_0 subject to S(y) >= 0.
///
/// Uses the HKM direction with Mehrotra's predictor-corrector (Helmberg et al. 1996; Kojima et al. 1997; Monteiro
/// 1997). Each constraint matrix has rank two, so the Schur complement costs a few products of n x n matrices instead
/// of one per pair of constraints. S is recomputed from y in each iteration, so every iterate is feasible.
/// Ties are equations between the y_i: the system of each step is summed over them.
/// @param start strictly feasible, S(start) > 0, and equal where tied; progress is slow if it is close to the boundary.
/// @returns floating-point estimates without a guarantee: verify them.
InteriorPointResult minimise(const RankTwoInequality& inequality, const Eigen::VectorXd& start,
                             const InteriorPointOptions& options);

}  // namespace swarmcert::lipschitz
