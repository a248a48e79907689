/// @file A primal-dual interior point method for matrix inequalities whose constraints have rank two.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "lipschitz/base/stop.h"

namespace swarmcert::lipschitz {

/// S(y) = C + y_0 A_0 + sum_{i >= 1} y_i A_i, symmetric, with A_0 = diag(I, 0) over the inputs and
/// A_i = -(a_i e_i' + e_i a_i'), where e_i selects variable inputs() + i - 1: the form of LipSDP-Neuron and of its
/// restriction to a box. Implementations may use the pattern of A.
class RankTwoInequality {
 public:
  virtual ~RankTwoInequality() = default;

  virtual Eigen::Index size() const = 0;    ///< rows of S
  virtual Eigen::Index inputs() const = 0;  ///< rows that A_0 touches, the first ones
  Eigen::Index neurons() const { return size() - inputs(); }

  /// First index of each block in which S is block tridiagonal, and its size at the end; two entries: S is dense.
  virtual std::vector<Eigen::Index> slack_blocks() const { return {0, size()}; }

  /// Sum_j y_j A_j.
  virtual Eigen::MatrixXd linear(const Eigen::VectorXd& y) const = 0;
  /// S(y).
  virtual Eigen::MatrixXd slack(const Eigen::VectorXd& y) const = 0;
  /// X A, where column i of A is a_i; X is [rows x size].
  virtual Eigen::MatrixXd times_a(const Eigen::MatrixXd& x) const = 0;
  /// A' X.
  virtual Eigen::MatrixXd a_transposed_times(const Eigen::MatrixXd& x) const = 0;
  /// X D for D with the pattern of S.
  virtual Eigen::MatrixXd times_patterned(const Eigen::MatrixXd& x, const Eigen::MatrixXd& d) const = 0;
};

struct InteriorPointOptions {
  double relative_gap = 2e-8;   ///< stop when y_0 is within this of the optimum, as far as mu tells,
  double infeasibility = 1e-7;  ///< and the dual constraints hold this well
  int max_iterations = 80;
  Stop stop;  ///< looked at several times per iteration
};

/// Why a search stopped. Every stop leaves usable points; only kGapReached says they are near the optimum.
enum class LipSdpStop { kNothingRun, kGapReached, kIterationLimit, kNumericalLimit, kCancelled, kTimeLimit };

/// "gap reached", ...
const char* name(LipSdpStop stop);
/// Whether the search would have gone on.
constexpr bool is_interrupted(LipSdpStop stop) {
  return stop == LipSdpStop::kCancelled || stop == LipSdpStop::kTimeLimit;
}

/// Why a search has to end now, if it has to.
std::optional<LipSdpStop> why_stopped(const Stop& stop);

struct InteriorPointResult {
  LipSdpStop stop = LipSdpStop::kNothingRun;
  int iterations = 0;
  std::vector<Eigen::VectorXd>
      points;  ///< strictly feasible in floating point, best last; the first is the start
  /// (y_0 - dual objective) / y_0 of the iterate from which each point was reached; infinity for the first
  std::vector<double> gaps;
  double best_dual = 0;  ///< below the optimum, up to floating point
};

/// Minimises y_0 subject to S(y) >= 0.
///
/// HKM direction with Mehrotra's predictor and corrector (Helmberg et al. 1996; Kojima et al. 1997; Monteiro 1997).
/// Each constraint matrix has rank two, so the Schur complement costs a few products of n x n matrices instead of
/// one per pair of constraints. S is recomputed from y in each iteration: every iterate is feasible.
/// @param start strictly feasible, S(start) > 0, and well inside, or progress is slow.
/// @returns floating point estimates without a guarantee: verify them.
InteriorPointResult minimise(const RankTwoInequality& inequality, const Eigen::VectorXd& start,
                             const InteriorPointOptions& options);

}  // namespace swarmcert::lipschitz
