/// @file Branch and bound for the Lipschitz constant on a box: halve the box where that decides neurons.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <functional>
#include <vector>

#include "lipschitz/branch/local_chain.h"
#include "lipschitz/checker/tree_proof.h"

namespace swarmcert::lipschitz {

/// A bisection of the boxes with a proof per part, in preorder, box after box: a split is followed by its lower, then
/// its upper half.
struct BranchTree {
  static constexpr int kLeaf = -1;
  struct Node {
    int split = kLeaf;    ///< coordinate that is halved, or kLeaf
    int multipliers = 0;  ///< of a leaf: index into `multipliers`
    int form = kNone;  ///< of set functions: index into `forms`, the form that holds from here down; or kNone
    bool bounds_rho = false;  ///< rho's neurons are bounded here; always where there is a form
    std::vector<check::Decision>
        decided;  ///< neurons that better lower slopes decide here, in the order of TreeProof
  };
  static constexpr int kNone = -1;
  std::vector<Node> nodes;
  std::vector<std::vector<double>> multipliers;  ///< one per hidden neuron of the network, in its own units
  std::vector<std::vector<check::Conflict>> conflicts;  ///< that go with each of them; or none at all
  std::vector<check::Form> forms;                       ///< of rho
  double rho = 0;                                       ///< claimed bound on the squared Lipschitz constant
};

struct BranchOptions {
  int nodes = 20000;        ///< boxes to look at
  double seconds = 0;       ///< wall clock; the search stops at the next node; 0: no limit
  double known = 0;         ///< a Lipschitz constant that is attained: no need to go below
  double tolerance = 1e-3;  ///< stop when the bound is within this of `known`, relatively
  /// Conflict cuts: pairs of neurons that a box keeps from being in some states at once, at most so many per box. Fewer
  /// boxes and a shorter proof for the same bound, but more time.
  int pairs = 0;
  /// Better lower slopes for neurons that are nearly decided (Reach): fewer boxes, shorter proofs that are checked
  /// sooner, in about the time that a search takes without; for a stated number of neighbours in less.
  bool better_slopes = true;
  /// Multipliers to start from, one per hidden neuron of the network, in its own units: those of a bound that holds
  /// everywhere. Empty: none.
  std::vector<double> start;
  /// For one of many searches: it spends its time on boxes alone. The parts that dominate in the end are not solved
  /// better, and there is no outlook.
  bool boxes_only = false;
  const std::atomic<bool>* cancelled = nullptr;
  /// After every so many nodes: share of the nodes or of the time that is used up, bound so far.
  std::function<void(double share, double bound)> progress;
};

/// Why a search of boxes stopped.
enum class BranchStop {
  kNothingRun,
  kCloseEnough,  ///< the bound is within the tolerance of a slope that is attained
  kNodes,        ///< all boxes that it was given
  kTimeLimit,
  kCancelled,
  /// The box that dominates has no side left to halve, or no multipliers were found for it. On a projective cover that
  /// is where kinks which run side by side to infinity, as those behind one neuron of the first layer do, meet in one
  /// point: boxes around it decide nothing between them, however small.
  kNothingToHalve,
};
/// "close enough", "nodes used up", ...
const char* name(BranchStop stop);
/// Whether the search would have gone on.
constexpr bool is_interrupted(BranchStop stop) {
  return stop == BranchStop::kCancelled || stop == BranchStop::kTimeLimit;
}

/// What a search that has stopped knows of the way that is left: estimates, no bounds.
struct Outlook {
  double bound_halfway = 0, bound = 0;  ///< Lipschitz constants proved after half of the boxes, and after all
  int undecided = 0,
      neurons = 0;  ///< in the part that dominates, whose neurons could still do as they like; of all
  double slope_in_part = 0;  ///< the steepest slope at points of that part
};

struct BranchResult {
  BranchTree tree;
  BranchStop stop = BranchStop::kNothingRun;
  int nodes = 0;                 ///< boxes looked at
  double undecided_per_box = 0;  ///< neurons that a box leaves undecided, on average
  Outlook outlook;
  /// Centres of boxes, by falling slope at the centre, at most kSteepCentres: where a search for lower bounds may
  /// start.
  std::vector<Eigen::VectorXd> steep_centres;
};

inline constexpr std::size_t kSteepCentres = 8;

/// Best-first search over the union of the boxes. Each box bounds its neurons by linear relaxation (Reach), takes out
/// those that it decides, and inherits the multipliers of an ancestor; the box that dominates gets multipliers of its
/// own once enough of its neurons are decided, and is halved otherwise. The slope at each box's centre says how far the
/// bound can fall at most. The result depends on the options only, not on the machine's load (seconds unset). It can be
/// used whenever the search stops.
BranchResult branch(const LocalChain& chain, const std::vector<Box>& boxes, const BranchOptions& options);

/// The same for a set function whose sum is bounded. Its boxes are bounded with phi alone, in front of a form of rho; a
/// box that decides more of phi's and of rho's neurons gets a form of its own, and hands it down.
BranchResult branch(const SetChain& set, const std::vector<Box>& boxes, const BranchOptions& options);

}  // namespace swarmcert::lipschitz
