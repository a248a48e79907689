/// @file Branch and bound for the Lipschitz constant on a box: halves boxes to decide the states of neurons.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <functional>
#include <vector>

#include "lipschitz/branch/local_chain.h"
#include "lipschitz/checker/tree_proof.h"

namespace swarmcert::lipschitz {

/// A bisection of the boxes with one proof per part. The trees of the boxes follow each other in preorder: a split is
/// followed by its lower half, then by its upper half.
struct BranchTree {
  static constexpr int kLeaf = -1;
  struct Node {
    int split = kLeaf;    ///< coordinate that is halved, or kLeaf
    int multipliers = 0;  ///< for a leaf: index into `multipliers`
    int form = kNone;  ///< for set functions: index into `forms` of the form valid in this subtree, or kNone
    bool bounds_rho = false;  ///< rho's neurons are bounded at this node; always true if there is a form
    std::vector<check::Decision>
        decided;  ///< neurons decided here by better lower slopes, in the order of TreeProof
  };
  static constexpr int kNone = -1;
  std::vector<Node> nodes;
  std::vector<std::vector<double>> multipliers;  ///< each: one per hidden neuron, in the network's units
  std::vector<std::vector<check::Conflict>> conflicts;  ///< one list per entry of `multipliers`; or empty
  std::vector<check::Form> forms;                       ///< quadratic forms that bound rho
  double rho = 0;                                       ///< claimed bound on the squared Lipschitz constant
};

struct BranchOptions {
  /// The search ends after the first round in which it has examined this many boxes, so that the number that a search
  /// with a time limit reached gives the same result again.
  int nodes = 0;
  double seconds = 0;       ///< wall-clock limit: the search ends with the last round within it; 0: no limit
  double known = 0;         ///< a lower bound on the Lipschitz constant: no need to go below
  double tolerance = 1e-3;  ///< stop when the relative distance of the bound to `known` is at most this
  /// Largest number of conflict cuts per box. A conflict cut is a pair of neurons that cannot be in given states at
  /// once anywhere in the box. Cuts give fewer boxes and a shorter proof for the same bound, but take more time.
  int pairs = 0;
  /// Uses better lower slopes for neurons that are nearly decided (Reach). This gives fewer boxes and shorter proofs
  /// that are checked faster, in about the same search time; for a stated number of neighbours in less time.
  bool better_slopes = true;
  /// Initial multipliers, one per hidden neuron of the network, in its own units, taken from a global bound. Empty:
  /// none.
  std::vector<double> start;
  int jobs = 1;  ///< number of threads; does not affect the result
  const std::atomic<bool>* cancelled = nullptr;
  /// Called periodically with the used share of the nodes or of the time, and the bound so far.
  std::function<void(double share, double bound)> progress;
};

/// Why a search of boxes stopped.
enum class BranchStop {
  kNothingRun,
  kCloseEnough,  ///< the bound is within the tolerance of the known lower bound
  kNodes,        ///< the limit on the number of boxes was reached
  kTimeLimit,
  kCancelled,
  /// The dominating box has no side left to halve. On a projective cover this
  /// happens at points at infinity where parallel kinks meet, such as those behind one neuron of the first layer: no
  /// box around such a point, however small, decides the neurons of these kinks.
  kNothingToHalve,
};
/// "close enough", "nodes used up", ...
const char* name(BranchStop stop);
/// Returns whether the search was stopped from outside and would have continued.
constexpr bool is_interrupted(BranchStop stop) {
  return stop == BranchStop::kCancelled || stop == BranchStop::kTimeLimit;
}

/// Estimates of how much further a stopped search could have come. No bounds.
struct Outlook {
  double bound_halfway = 0, bound = 0;  ///< Lipschitz bounds proved after half and all of the boxes
  int undecided = 0, neurons = 0;       ///< in the dominating part: number of undecided and of all neurons
  double slope_in_part = 0;             ///< the largest slope at points of the dominating part
};

struct BranchResult {
  BranchTree tree;
  BranchStop stop = BranchStop::kNothingRun;
  int nodes = 0;                 ///< boxes examined; a box examined again counts again
  double undecided_per_box = 0;  ///< average number of undecided neurons per box
  Outlook outlook;
  /// The box centres with the largest slopes, steepest first, at most kSteepCentres: starting points for a lower-bound
  /// search.
  std::vector<Eigen::VectorXd> steep_centres;
};

inline constexpr std::size_t kSteepCentres = 8;

/// Best-first search over the union of the boxes. For each box, the neurons are bounded by linear relaxation (Reach),
/// decided neurons are eliminated, and the multipliers of an ancestor are inherited. The dominating box gets its own
/// multipliers once enough of its neurons are decided; otherwise it is halved. The slope at the centre of each box
/// limits how far the bound can fall. If `seconds` is not set, the result depends on the options only, not on the load
/// of the machine. The result is usable whenever the search stops.
BranchResult branch(const LocalChain& chain, const std::vector<Box>& boxes, const BranchOptions& options);

/// The same for a set function whose sum is bounded. Boxes are bounded using phi alone, in front of a quadratic form
/// that bounds rho. A box that decides more neurons of phi and rho gets its own form, which its subtree inherits.
BranchResult branch(const SetChain& set, const std::vector<Box>& boxes, const BranchOptions& options);

}  // namespace swarmcert::lipschitz
