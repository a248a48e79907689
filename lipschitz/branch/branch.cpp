#include "lipschitz/branch/branch.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <queue>

#include "lipschitz/branch/node_inequality.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A neuron counts as decided only with this relative margin, so that the checker's rounding cannot see it otherwise.
constexpr double kStateMargin = 1e-9;
/// What the claimed rho is above the least one, relatively, so that the checker's rounding does not matter.
constexpr double kRhoMargin = 1e-8;
/// A part gets multipliers of its own once its undecided neurons are fewer than this share of those for which the
/// inherited ones were computed.
constexpr double kLazy = 0.97;
/// Programs are solved this well: the next one starts where this one stopped.
constexpr double kGap = 0.1;
/// A program starts at the inherited multipliers, drawn this far towards a point well inside.
constexpr double kInwards = 0.01;

struct Part {
  double rho = std::numeric_limits<double>::infinity();
  int index = 0;  ///< in Search::nodes_
  std::shared_ptr<const Reach> reach;
  std::vector<NeuronState> states;
  int undecided = 0;
  int split = 0;           ///< the coordinate to halve
  int multipliers = -1;    ///< inherited or own
  int undecided_then = 0;  ///< where these multipliers were computed
  bool operator<(const Part& other) const { return rho < other.rho; }
};

class Search {
 public:
  Search(const LocalChain& chain, const Box& box, const BranchOptions& options)
      : chain_(chain), box_(box), options_(options) {}

  BranchResult run() {
    const auto start = std::chrono::steady_clock::now();
    nodes_.push_back({});
    std::priority_queue<Part> queue;
    Part root = part(box_, nullptr, 0);
    solve(root);
    queue.push(std::move(root));
    const auto enough = [&] {
      const double attained = std::max(options_.known, std::sqrt(chain_.unscaled_rho(steepest())));
      return attained * (1 + options_.tolerance);
    };
    const auto share_of_time = [&] {
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
      return options_.seconds > 0 ? elapsed.count() / options_.seconds : 0;
    };
    while (result_.nodes + 2 <= options_.nodes && share_of_time() < 1 &&
           !(options_.cancelled != nullptr && *options_.cancelled)) {
      if (bound(queue.top()) <= enough()) break;
      Part top = queue.top();
      queue.pop();
      if (top.undecided < kLazy * top.undecided_then) {
        solve(top);
        queue.push(std::move(top));
        continue;
      }
      const Box& whole = top.reach->box();
      const auto k = static_cast<std::size_t>(top.split);
      if (!(whole.upper[k] > whole.lower[k])) {
        queue.push(std::move(top));
        break;
      }
      const auto [first, second] = halves(whole, top.split);
      nodes_[static_cast<std::size_t>(top.index)].split = top.split;
      for (const Box& half : {first, second}) {
        const auto index = static_cast<int>(nodes_.size());
        nodes_.push_back({});
        queue.push(part(half, &top, index));
      }
      nodes_[static_cast<std::size_t>(top.index)].first_child = static_cast<int>(nodes_.size()) - 2;
      if (options_.progress && result_.nodes % 256 < 2) {
        const double share = std::max(share_of_time(), 1.0 * result_.nodes / options_.nodes);
        options_.progress(std::min(share, 1.0), bound(queue.top()));
      }
    }
    const double rho = queue.top().rho * (1 + kRhoMargin);
    result_.tree.rho = chain_.unscaled_rho(rho);
    for (; !queue.empty(); queue.pop())
      nodes_[static_cast<std::size_t>(queue.top().index)].multipliers = queue.top().multipliers;
    write_preorder(0);
    for (const auto& [slope, centre] : steep_) result_.steep_centres.push_back(centre);
    return std::move(result_);
  }

 private:
  struct TreeNode {
    int split = BranchTree::kLeaf, first_child = 0, multipliers = -1;
  };

  double bound(const Part& part) const { return std::sqrt(chain_.unscaled_rho(part.rho)); }

  /// The largest squared slope at a centre so far, in the chain's units.
  double steepest() const { return steep_.empty() ? 0 : steep_.begin()->first; }

  void look_at_centre(const Box& box) {
    VectorXd centre(chain_.inputs());
    for (Index j = 0; j < centre.size(); ++j) {
      const auto k = static_cast<std::size_t>(j);
      centre(j) = box.lower[k] + (box.upper[k] - box.lower[k]) / 2;
    }
    steep_.emplace(chain_.squared_slope(centre), centre);
    if (steep_.size() > kSteepCentres) steep_.erase(std::prev(steep_.end()));
  }

  Part part(const Box& box, const Part* parent, int index) {
    ++result_.nodes;
    look_at_centre(box);
    Part part;
    part.index = index;
    std::vector<MatrixXd> slopes;
    part.reach =
        std::make_shared<const Reach>(chain_.hidden, box, parent ? parent->reach.get() : nullptr, &slopes);
    for (std::size_t k = 0; k < chain_.hidden.size(); ++k) {
      const Bounds& bounds = part.reach->before_relu(k);
      for (Index i = 0; i < bounds.lower.size(); ++i) {
        const double margin = kStateMargin * std::max(std::abs(bounds.lower(i)), std::abs(bounds.upper(i)));
        part.states.push_back(bounds.lower(i) > margin    ? NeuronState::kOn
                              : bounds.upper(i) < -margin ? NeuronState::kOff
                                                          : NeuronState::kUndecided);
        if (part.states.back() == NeuronState::kUndecided) ++part.undecided;
      }
    }
    if (parent != nullptr) {
      part.rho = parent->rho;
      part.multipliers = parent->multipliers;
      part.undecided_then = parent->undecided_then;
      if (part.states != parent->states) {
        const NodeInequality inequality(chain_, part.states);
        part.rho = std::min(part.rho, inequality.least_rho(at_undecided(inequality, part.multipliers)));
      }
    }
    part.split = best_split(*part.reach, slopes, part.states);
    return part;
  }

  /// The coordinate that makes up most of the undecided neurons' ranges.
  int best_split(const Reach& reach, const std::vector<MatrixXd>& slopes,
                 const std::vector<NeuronState>& states) const {
    const Box& box = reach.box();
    VectorXd width(chain_.inputs());
    for (Index j = 0; j < width.size(); ++j) {
      const auto k = static_cast<std::size_t>(j);
      width(j) = box.upper[k] - box.lower[k];
    }
    VectorXd score = VectorXd::Zero(chain_.inputs());
    std::size_t neuron = 0;
    for (std::size_t k = 0; k < slopes.size(); ++k) {
      const VectorXd range = reach.before_relu(k).upper - reach.before_relu(k).lower;
      for (Index i = 0; i < range.size(); ++i, ++neuron) {
        if (states[neuron] != NeuronState::kUndecided) continue;
        score += (slopes[k].row(i).transpose().cwiseProduct(width) / range(i)).cwiseAbs2();
      }
    }
    Index best = 0;
    score.maxCoeff(&best);
    return static_cast<int>(best);
  }

  VectorXd at_undecided(const NodeInequality& inequality, int multipliers) const {
    return scaled_[static_cast<std::size_t>(multipliers)](inequality.undecided());
  }

  /// Multipliers of the part's own.
  void solve(Part& part) {
    const NodeInequality inequality(chain_, part.states);
    const Index m = inequality.neurons();
    VectorXd start(1 + m);
    if (part.multipliers < 0) {
      start = interior(inequality);
      interior_ = VectorXd::Zero(1 + chain_.neurons());
      interior_(0) = start(0);
      for (Index i = 0; i < m; ++i)
        interior_(1 + inequality.undecided()[static_cast<std::size_t>(i)]) = start(1 + i);
    } else {
      start(0) = kInwards * interior_(0) + (1 - kInwards) * 1.02 * part.rho;
      start.tail(m) = kInwards * VectorXd(interior_.tail(chain_.neurons()))(inequality.undecided()) +
                      (1 - kInwards) * at_undecided(inequality, part.multipliers);
    }
    InteriorPointOptions options;
    options.relative_gap = kGap;
    options.infeasibility = std::numeric_limits<double>::infinity();  // every iterate is a bound
    const InteriorPointResult found = minimise(inequality, start, options);
    part.undecided_then = part.undecided;

    if (found.points.empty()) return;
    // In single precision: the certificate is half as long, and any multipliers will do that prove the part.
    const VectorXd t = found.points.back().tail(m).cast<float>().cast<double>();
    const double rho = inequality.least_rho(t);
    if (!(rho < part.rho)) return;
    part.rho = rho;
    VectorXd all = VectorXd::Zero(chain_.neurons());
    for (Index i = 0; i < m; ++i) all(inequality.undecided()[static_cast<std::size_t>(i)]) = t(i);
    part.multipliers = static_cast<int>(scaled_.size());
    scaled_.push_back(all);
    std::vector<double> unscaled;
    Index neuron = 0;
    for (std::size_t k = 0; k < chain_.hidden.size(); ++k)
      for (Index i = 0; i < chain_.hidden[k].weights.rows(); ++i, ++neuron)
        unscaled.push_back(chain_.unscaled_multiplier(all(neuron), k));
    result_.tree.multipliers.push_back(std::move(unscaled));
  }

  /// A point well inside: in a balanced chain all-ones is nearly feasible, and earlier layers want more.
  VectorXd interior(const NodeInequality& inequality) const {
    for (double shrink = 0.5;; shrink *= 0.5) {
      VectorXd layers(chain_.neurons());
      double level = 4;
      Index end = layers.size();
      for (std::size_t k = chain_.hidden.size(); k-- > 0; level /= shrink) {
        const Index rows = chain_.hidden[k].weights.rows();
        layers.segment(end - rows, rows).setConstant(level);
        end -= rows;
      }
      VectorXd y(1 + inequality.neurons());
      y(0) = level;
      for (Index i = 0; i < inequality.neurons(); ++i)
        y(1 + i) = layers(inequality.undecided()[static_cast<std::size_t>(i)]);
      if (inequality.least_rho(y.tail(inequality.neurons())) < 0.9 * y(0)) return y;
    }
  }

  void write_preorder(int index) {
    const TreeNode& node = nodes_[static_cast<std::size_t>(index)];
    result_.tree.nodes.push_back({node.split, std::max(node.multipliers, 0)});
    if (node.split == BranchTree::kLeaf) return;
    write_preorder(node.first_child);
    write_preorder(node.first_child + 1);
  }

  const LocalChain& chain_;
  const Box& box_;
  const BranchOptions& options_;
  std::vector<TreeNode> nodes_;
  std::vector<VectorXd> scaled_;  ///< multipliers in the chain's units
  VectorXd interior_;
  std::multimap<double, VectorXd, std::greater<>> steep_;  ///< centres by their squared slope
  BranchResult result_;
};

}  // namespace

BranchResult branch(const LocalChain& chain, const Box& box, const BranchOptions& options) {
  return Search(chain, box, options).run();
}

}  // namespace swarmcert::lipschitz
