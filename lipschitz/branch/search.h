/// @file State and steps of the search of branch.h; the steps are implemented in several files.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <queue>

#include "lipschitz/branch/branch.h"
#include "lipschitz/branch/descend.h"
#include "lipschitz/branch/search_tree.h"
#include "lipschitz/solver/node_inequality.h"

namespace swarmcert::lipschitz {

class BranchSearch {
 public:
  BranchSearch(const LocalChain& chain, const SetChain* set, const std::vector<Box>& boxes,
               const BranchOptions& options)
      : chain_(chain), set_(set), boxes_(boxes), options_(options) {}
  BranchResult run();

 private:
  /// Relative accuracy to which a part's program is solved, starting from the multipliers of an ancestor: at most kGap;
  /// near the end kShareOfDistance times the remaining distance.
  static constexpr double kGap = 0.03, kShareOfDistance = 0.1;
  /// Newton steps per program. A search is faster if programs are solved more often and less accurately.
  static constexpr int kSteps = 2;
  static constexpr double kFineGap = 1e-4;
  /// A program that reduced rho below this share of its previous value may have stopped early and is solved again.
  static constexpr double kFar = 0.9;
  /// A part of a set function gets its own form of rho once the number of its undecided neurons is below this share of
  /// the number for which the inherited form was computed.
  static constexpr double kFormLazy = 0.85;

  /// A form that bounds rho, in the units of the chain.
  struct OfRho {
    Eigen::MatrixXd gram;  ///< G of phi
    Eigen::VectorXd t;     ///< multipliers of all neurons of rho
    std::shared_ptr<const Reach> reach;
    int undecided = 0;    ///< number of undecided neurons of rho
    check::Form written;  ///< in the units of the network
  };
  /// Multipliers in the units of the chain.
  struct Multipliers {
    Eigen::VectorXd t;
    std::vector<NeuronPair> pairs;
    std::vector<double> of_pairs;
    LeafProof written;
  };
  /// A box of the search.
  struct Part {
    double rho = std::numeric_limits<double>::infinity();
    int index = 0;  ///< index in nodes_
    std::shared_ptr<const Reach> reach;
    std::shared_ptr<const Reach> around;  ///< bounds over the parent box, on which `reach` depends
    std::vector<NeuronState> states;
    int undecided = 0;                               ///< number of undecided neurons
    int split = 0;                                   ///< the coordinate to halve
    int in_vain = 0;                                 ///< number of successive halvings that decided no neuron
    std::shared_ptr<const Multipliers> multipliers;  ///< inherited or own; null if none were found
    int undecided_then = 0;             ///< number of undecided neurons when these multipliers were computed
    std::shared_ptr<const OfRho> form;  ///< inherited or own; null if the function is not a set function
    int undecided_form = 0;             ///< number of undecided neurons when that form was computed
    // Moved to the node by record().
    std::vector<check::Decision> decided;
    bool has_new_form = false;
    bool operator<(const Part& other) const { return rho < other.rho; }
  };
  /// A part after one step of the search: sharpened, or replaced by its halves.
  struct Step {
    Part part;
    std::vector<Part> halves;
    bool is_stuck = false;  ///< no side can be halved
  };

  const Eigen::MatrixXd& gram_of(const Part& part) const {
    return set_ == nullptr ? chain_.gram : part.form->gram;
  }

  double squared_slope(const Eigen::VectorXd& x) const {
    return set_ == nullptr ? chain_.squared_slope(x) : set_->whole.squared_slope(x);
  }
  // branch.cpp. Functions that are const run on several threads at once.
  /// Returns the parts of the given boxes, with multipliers.
  std::vector<Part> roots();
  /// Removes the dominating parts from the queue for the next steps. Their number depends only on the queue.
  std::vector<Part> next_batch(std::priority_queue<Part>& queue) const;
  /// Performs one step on a part; nothing if the search is over.
  Step advanced(Part part) const;
  /// Improves the part's form or multipliers if due. Returns whether it did; the part is then queued by its new rho.
  bool sharpen(Part& part) const;
  /// Records a step in the tree and queues the parts that it leaves.
  void commit(Step step, std::priority_queue<Part>& queue);
  /// Moves the new decisions and the new form of a part to its node.
  void record(Part& part);
  /// Counts a part that is examined, for the first time or again.
  void count(const Part& part);
  /// Returns why the search stops now; kNothingRun if it continues.
  BranchStop why_stop(const std::priority_queue<Part>& queue) const;
  /// Returns the share of the time limit that has been used; 0 without a limit.
  double share_of_time() const;
  bool is_cancelled() const { return options_.cancelled != nullptr && *options_.cancelled; }
  bool is_over() const { return is_cancelled() || share_of_time() >= 1; }
  /// Returns the bound below which the search need not continue: the attained slope plus the tolerance.
  double enough() const;
  /// Returns the result of a search that stopped; empties the queue.
  BranchResult finished(std::priority_queue<Part>& queue);
  /// Computes the outlook.
  void look_ahead(const Part& top);
  /// Improves the multipliers of the parts that dominate at the end, if there are few.
  void polish(std::priority_queue<Part>& queue);
  double bound(const Part& part) const { return std::sqrt(chain_.unscaled_rho(part.rho)); }

  // search_part.cpp
  /// Returns the largest squared slope at a box centre so far, in the units of the chain.
  double steepest() const { return steep_.empty() ? 0 : steep_.begin()->first; }
  void look_at_centre(const Box& box);
  /// Creates the part for a box, which inherits multipliers and form from its parent. @param parent null for a root.
  Part part(const Box& box, const Part* parent) const;
  /// Returns the states of the neurons of `chain`, whose layers start at layer `first` of `reach`.
  static std::vector<NeuronState> states_of(const Reach& reach, const LocalChain& chain, std::size_t first);
  static int undecided_in(const std::vector<NeuronState>& states) {
    return static_cast<int>(std::count(states.begin(), states.end(), NeuronState::kUndecided));
  }
  /// Returns the coordinate that contributes most to the ranges of the undecided neurons, among those that can be
  /// halved; otherwise the widest coordinate.
  int best_split(const Reach& reach, const std::vector<Eigen::MatrixXd>& slopes,
                 const std::vector<NeuronState>& states) const;

  /// Returns the width of a box along a coordinate, relative to the widest box given to the search.
  double relative_width(const Box& box, std::size_t k) const;
  /// Boxes of smaller relative width along a coordinate are not halved along it.
  static constexpr double kThin = 0x1p-40;

  // search_multipliers.cpp
  /// Returns the indices of the inherited pairs that still hold in the part, between undecided neurons.
  std::vector<std::size_t> still_shown(const Part& part, const NeuronForms& forms) const;
  /// Returns the inherited multipliers and adds the pairs with these indices to `inequality`.
  Eigen::VectorXd inherited(const Part& part, const std::vector<std::size_t>& pairs,
                            NodeInequality& inequality) const;
  /// Returns the pairs that get a multiplier: the inherited ones and the best ones of the box, at most `most` in total.
  /// Sets `t` to the initial multipliers.
  std::vector<NeuronPair> chosen_pairs(const Part& part, std::size_t most, Eigen::VectorXd& t) const;
  /// Computes multipliers for this part.
  void solve(Part& part) const;
  void solve(Part& part, const DescentOptions& descent, std::size_t most_pairs) const;
  /// Returns options for Newton steps that come close to the optimum.
  static DescentOptions fine_descent();
  /// Stores multipliers of the undecided neurons and of the pairs as those of the part.
  void keep(Part& part, const Eigen::VectorXd& t, std::vector<NeuronPair> pairs,
            const Eigen::VectorXd& of_pairs) const;

  // search_forms.cpp
  /// Computes multipliers of this part for phi and rho together, and from those of rho the form that replaces rho.
  void renew_form(Part& part) const;

  const LocalChain& chain_;
  const SetChain* const set_;  ///< null if the function is not a set function
  const std::vector<Box>& boxes_;
  const BranchOptions& options_;
  std::vector<SearchNode> nodes_;
  std::multimap<double, Eigen::VectorXd, std::greater<>> steep_;  ///< box centres by squared slope
  std::vector<double> course_;                                    ///< the bound after each split
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  BranchResult result_;
};

}  // namespace swarmcert::lipschitz
