/// @file The search of branch.h: its state and its steps, which fill several files.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <queue>

#include "lipschitz/branch/branch.h"
#include "lipschitz/branch/descend.h"
#include "lipschitz/branch/node_inequality.h"
#include "lipschitz/branch/search_tree.h"

namespace swarmcert::lipschitz {

class BranchSearch {
 public:
  BranchSearch(const LocalChain& chain, const SetChain* set, const std::vector<Box>& boxes,
               const BranchOptions& options)
      : chain_(chain), set_(set), boxes_(boxes), options_(options) {}
  BranchResult run();

 private:
  /// How well a part's program is solved, relatively, at most; it starts where an ancestor's stopped. Near the end this
  /// share of the distance that is left.
  static constexpr double kGap = 0.03, kShareOfDistance = 0.1;
  /// Newton steps per program: solved more often and less far, a search is faster.
  static constexpr int kSteps = 2;
  static constexpr double kFineGap = 1e-4;
  /// A program that took rho below this share of what it was may have stopped early: it gets another turn.
  static constexpr double kFar = 0.9;
  /// A part of a set function gets a form of rho of its own once its undecided neurons are fewer than this share of
  /// those with which the inherited one was computed.
  static constexpr double kFormLazy = 0.85;

  /// A box of the search.
  struct Part {
    double rho = std::numeric_limits<double>::infinity();
    int index = 0;  ///< in nodes_
    std::shared_ptr<const Reach> reach;
    std::shared_ptr<const Reach> around;  ///< of the box that was halved, which `reach` rests on
    std::vector<NeuronState> states;
    int undecided = 0;
    int split = 0;           ///< the coordinate to halve
    int in_vain = 0;         ///< halvings in a row that decided no neuron
    int multipliers = -1;    ///< inherited or own
    int undecided_then = 0;  ///< where these multipliers were computed
    int form = -1;           ///< index in forms_
    int undecided_form = 0;  ///< where that form was computed
    bool operator<(const Part& other) const { return rho < other.rho; }
  };
  /// In the chain's units.
  struct OfRho {
    Eigen::MatrixXd gram;  ///< of phi
    Eigen::VectorXd t;     ///< of all of rho's neurons
    std::shared_ptr<const Reach> reach;
    int undecided;  ///< neurons of rho
  };
  /// In the chain's units.
  struct Multipliers {
    Eigen::VectorXd t;
    std::vector<NeuronPair> pairs;
    std::vector<double> of_pairs;
  };
  const Multipliers& multipliers_of(const Part& part) const {
    return scaled_[static_cast<std::size_t>(part.multipliers)];
  }

  const Eigen::MatrixXd& gram_of(const Part& part) const {
    return set_ == nullptr ? chain_.gram : forms_[static_cast<std::size_t>(part.form)].gram;
  }

  double squared_slope(const Eigen::VectorXd& x) const {
    return set_ == nullptr ? chain_.squared_slope(x) : set_->whole.squared_slope(x);
  }
  // branch.cpp
  /// Improves the part's form or multipliers where due. @return whether it did: then its turn comes by its new rho.
  bool sharpen(Part& part);
  /// Puts the halves of `top` into the queue and into the tree.
  void halve(const Part& top, std::priority_queue<Part>& queue);
  /// The result of a search that stopped; empties the queue.
  BranchResult finished(std::priority_queue<Part>& queue);
  /// What is known of the way that is left.
  void look_ahead(const Part& top);
  /// The parts that dominate in the end get better multipliers, where there are few.
  void polish(std::priority_queue<Part>& queue);
  double bound(const Part& part) const { return std::sqrt(chain_.unscaled_rho(part.rho)); }

  // search_part.cpp
  /// The largest squared slope at a centre so far, in the chain's units.
  double steepest() const { return steep_.empty() ? 0 : steep_.begin()->first; }
  void look_at_centre(const Box& box);
  /// The part for a box, with what it inherits from the one that was halved. @param parent null for a root.
  Part part(const Box& box, const Part* parent, int index);
  /// Where decisions of the node go; null: none wanted.
  std::vector<check::Decision>* decided_in(int index) {
    return options_.better_slopes ? &nodes_[static_cast<std::size_t>(index)].decided : nullptr;
  }
  /// Of the neurons of `chain`, whose layers are those of `reach` from `first` on.
  static std::vector<NeuronState> states_of(const Reach& reach, const LocalChain& chain, std::size_t first);
  static int undecided_in(const std::vector<NeuronState>& states) {
    return static_cast<int>(std::count(states.begin(), states.end(), NeuronState::kUndecided));
  }
  /// The coordinate that makes up most of the undecided neurons' ranges, of those that can be halved; else the widest
  /// one.
  int best_split(const Reach& reach, const std::vector<Eigen::MatrixXd>& slopes,
                 const std::vector<NeuronState>& states) const;

  /// A box's width along a coordinate, as a share of the widest box that the search was given.
  double relative_width(const Box& box, std::size_t k) const;
  /// Boxes narrower than this share are not halved further along that side.
  static constexpr double kThin = 0x1p-40;

  // search_multipliers.cpp
  /// Of the pairs that come with the part's multipliers, those that hold in it between undecided neurons.
  std::vector<std::size_t> still_shown(const Part& part, const NeuronForms& forms) const;
  /// The inherited multipliers; adds the pairs, given by their indices, to `inequality`.
  Eigen::VectorXd inherited(const Part& part, const std::vector<std::size_t>& pairs,
                            NodeInequality& inequality) const;
  /// The pairs worth a multiplier: those that come with the part's multipliers, and the best of the box's, up to `most`
  /// in all. `t` becomes the multipliers to start from.
  std::vector<NeuronPair> chosen_pairs(const Part& part, std::size_t most, Eigen::VectorXd& t) const;
  /// Multipliers of the part's own.
  void solve(Part& part);
  void solve(Part& part, const DescentOptions& descent, std::size_t most_pairs);
  /// Steps that take multipliers close to the best ones.
  static DescentOptions fine_descent();
  /// Makes these the part's multipliers: of the undecided neurons, and of pairs.
  void keep(Part& part, const Eigen::VectorXd& t, std::vector<NeuronPair> pairs,
            const Eigen::VectorXd& of_pairs);

  // search_forms.cpp
  /// Multipliers of the part's own for phi and rho together, and from rho's the form that takes its place.
  void renew_form(Part& part);

  const LocalChain& chain_;
  const SetChain* const set_;  ///< null: no set function
  std::vector<OfRho> forms_;
  const std::vector<Box>& boxes_;
  const BranchOptions& options_;
  std::vector<SearchNode> nodes_;
  std::vector<Multipliers> scaled_;
  std::multimap<double, Eigen::VectorXd, std::greater<>> steep_;  ///< centres by their squared slope
  std::vector<double> course_;                                    ///< the bound after each split
  BranchResult result_;
};

}  // namespace swarmcert::lipschitz
