#include "lipschitz/branch/branch.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <queue>
#include <random>

#include "lipschitz/branch/descend.h"
#include "lipschitz/branch/node_inequality.h"
#include "lipschitz/dense_kernels.h"

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
constexpr double kLazy = 0.9;
/// How well a part's program is solved, relatively, at most; it starts where an ancestor's stopped. Near the end this
/// share of the distance that is left.
constexpr double kGap = 0.03, kShareOfDistance = 0.1;
/// Newton steps per program: solved more often and less far, a search is faster.
constexpr int kSteps = 2;
/// A search that ends with so few parts solves those that dominate, at most kPolished, this well and with kMostPairs.
constexpr std::size_t kFewParts = 64;
constexpr int kPolished = 8;
constexpr double kFineGap = 1e-4;
constexpr int kFineSteps = 20;
constexpr std::size_t kMostPairs = 40;
/// What a pair has to take off the barrier to be used.
constexpr double kLeastGain = 1e-2;
/// Points of the part that dominates where its slope is looked at.
constexpr int kSamples = 500;
/// A program that took rho below this share of what it was may have stopped early: it gets another turn.
constexpr double kFar = 0.9;
/// A part of a set function gets a form of rho of its own once its undecided neurons are fewer than this share of those
/// with which the inherited one was computed.
constexpr double kFormLazy = 0.85;
/// Only if of rho's, too, fewer are undecided than this share of those then: for phi alone a program without rho is
/// cheaper. Otherwise it looks again as if this share of its own had been undecided.
constexpr double kLazyRho = 0.985, kFormAgain = 0.95;
/// What a form is above the least one, relatively to its largest entry: more than rounding it to single precision takes.
constexpr double kFormMargin = 4e-6;
/// How well the program of the whole box is solved.
constexpr double kRootGap = 0.02;
constexpr int kRootSteps = 12;

struct Part {
  double rho = std::numeric_limits<double>::infinity();
  int index = 0;  ///< in Search::nodes_
  std::shared_ptr<const Reach> reach;
  std::shared_ptr<const Reach> around;  ///< of the box that was halved, which `reach` rests on
  std::vector<NeuronState> states;
  int undecided = 0;
  int split = 0;           ///< the coordinate to halve
  int multipliers = -1;    ///< inherited or own
  int undecided_then = 0;  ///< where these multipliers were computed
  int form = -1;           ///< index in Search::forms_
  int undecided_form = 0;  ///< where that form was computed
  bool operator<(const Part& other) const { return rho < other.rho; }
};

class Search {
 public:
  Search(const LocalChain& chain, const SetChain* set, const std::vector<Box>& boxes,
         const BranchOptions& options)
      : chain_(chain), set_(set), boxes_(boxes), options_(options) {}

  BranchResult run() {
    const auto start = std::chrono::steady_clock::now();
    std::priority_queue<Part> queue;
    for (const Box& box : boxes_) {
      nodes_.push_back({});
      Part root = part(box, nullptr, static_cast<int>(nodes_.size()) - 1);
      if (set_ == nullptr) {
        solve(root);
      } else {
        renew_form(root);
      }
      queue.push(std::move(root));
    }
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
      if (set_ != nullptr && top.undecided < kFormLazy * top.undecided_form) {
        const double before = top.rho;
        renew_form(top);
        if (top.rho < before) {
          queue.push(std::move(top));
          continue;
        }
      }
      if (top.undecided < kLazy * top.undecided_then) {
        solve(top);
        queue.push(std::move(top));
        continue;
      }
      const Box& whole = top.reach->box();
      const auto k = static_cast<std::size_t>(top.split);
      if (top.multipliers < 0 || !(whole.upper[k] > whole.lower[k])) {
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
      course_.push_back(bound(queue.top()));
      if (options_.progress && result_.nodes % 256 < 2) {
        const double share = std::max(share_of_time(), 1.0 * result_.nodes / options_.nodes);
        options_.progress(std::min(share, 1.0), bound(queue.top()));
      }
    }
    polish(queue);
    const double rho = queue.top().rho * (1 + kRhoMargin);
    result_.tree.rho = chain_.unscaled_rho(rho);
    look_ahead(queue.top());
    for (; !queue.empty(); queue.pop())
      nodes_[static_cast<std::size_t>(queue.top().index)].multipliers = queue.top().multipliers;
    for (std::size_t root = 0; root < boxes_.size(); ++root) write_preorder(static_cast<int>(root));
    for (const auto& [slope, centre] : steep_) result_.steep_centres.push_back(centre);
    return std::move(result_);
  }

 private:
  struct TreeNode {
    int split = BranchTree::kLeaf, first_child = 0, multipliers = -1, form = -1;
  };
  /// In the chain's units.
  struct OfRho {
    MatrixXd gram;  ///< of phi
    VectorXd t;     ///< of all of rho's neurons
    std::shared_ptr<const Reach> reach;
    int undecided;  ///< neurons of rho
  };
  /// In the chain's units.
  struct Multipliers {
    VectorXd t;
    std::vector<NeuronPair> pairs;
    std::vector<double> of_pairs;
  };

  const Multipliers& multipliers_of(const Part& part) const {
    return scaled_[static_cast<std::size_t>(part.multipliers)];
  }

  const MatrixXd& gram_of(const Part& part) const {
    return set_ == nullptr ? chain_.gram : forms_[static_cast<std::size_t>(part.form)].gram;
  }

  double squared_slope(const VectorXd& x) const {
    return set_ == nullptr ? chain_.squared_slope(x) : set_->whole.squared_slope(x);
  }

  /// What is known of the way that is left.
  void look_ahead(const Part& top) {
    Outlook& outlook = result_.outlook;
    outlook.undecided = top.undecided;
    for (std::size_t k = 0; k < chain_.hidden.size(); ++k)
      outlook.neurons += static_cast<int>(chain_.hidden[k].weights.rows() - chain_.without_relu[k]);
    if (!course_.empty()) {
      outlook.bound_halfway = course_[course_.size() / 2];
      outlook.bound = course_.back();
    }
    std::mt19937 generator(1);
    std::uniform_real_distribution<double> unit(0, 1);
    const Box& box = top.reach->box();
    for (int i = 0; i < kSamples; ++i) {
      VectorXd x(chain_.inputs());
      for (std::size_t k = 0; k < box.lower.size(); ++k)
        x(static_cast<Index>(k)) = box.lower[k] + (box.upper[k] - box.lower[k]) * unit(generator);
      const double slope = std::sqrt(chain_.unscaled_rho(squared_slope(x)));
      outlook.slope_in_part = std::max(outlook.slope_in_part, slope);
    }
  }

  /// The parts that dominate in the end get better multipliers, where there are few.
  void polish(std::priority_queue<Part>& queue) {
    if (queue.size() > kFewParts) return;
    DescentOptions descent;
    descent.relative_gap = kFineGap;
    descent.steps = kFineSteps;
    for (int i = 0; i < kPolished; ++i) {
      Part top = queue.top();
      if (top.multipliers < 0) return;
      const double before = top.rho;
      queue.pop();
      solve(top, descent, kMostPairs);
      const bool is_better = top.rho < before;
      queue.push(std::move(top));
      if (!is_better) return;
    }
  }

  double bound(const Part& part) const { return std::sqrt(chain_.unscaled_rho(part.rho)); }

  /// The largest squared slope at a centre so far, in the chain's units.
  double steepest() const { return steep_.empty() ? 0 : steep_.begin()->first; }

  void look_at_centre(const Box& box) {
    VectorXd centre(chain_.inputs());
    for (Index j = 0; j < centre.size(); ++j) {
      const auto k = static_cast<std::size_t>(j);
      centre(j) = box.lower[k] + (box.upper[k] - box.lower[k]) / 2;
    }
    steep_.emplace(squared_slope(centre), centre);
    if (steep_.size() > kSteepCentres) steep_.erase(std::prev(steep_.end()));
  }

  Part part(const Box& box, const Part* parent, int index) {
    ++result_.nodes;
    look_at_centre(box);
    Part part;
    part.index = index;
    std::vector<MatrixXd> slopes;
    std::vector<LinearForms> forms;
    if (parent != nullptr) part.around = parent->reach;
    const bool has_pairs = parent != nullptr && !multipliers_of(*parent).pairs.empty();
    part.reach = std::make_shared<const Reach>(chain_.hidden, box, part.around.get(), &slopes,
                                               has_pairs ? &forms : nullptr);
    part.states = states_of(*part.reach, chain_, 0);
    part.undecided = undecided_in(part.states);
    if (parent != nullptr) {
      part.rho = parent->rho;
      part.multipliers = parent->multipliers;
      part.undecided_then = parent->undecided_then;
      part.form = parent->form;
      part.undecided_form = parent->undecided_form;
      std::vector<std::size_t> pairs;
      if (has_pairs) pairs = still_shown(part, NeuronForms(forms, box));
      const bool all_pairs = pairs.size() == multipliers_of(part).pairs.size();
      if (part.states != parent->states || !all_pairs) {
        NodeInequality inequality(chain_, part.states, gram_of(part));
        const double rho = inequality.least_rho(inherited(part, pairs, inequality));
        const bool is_worse = !all_pairs && !(rho <= part.rho);  // for want of a pair
        part.rho = is_worse ? rho : std::min(part.rho, rho);
        if (is_worse) solve(part);
      }
    }
    part.split = best_split(*part.reach, slopes, part.states);
    return part;
  }

  /// Of the neurons of `chain`, whose layers are those of `reach` from `first` on.
  static std::vector<NeuronState> states_of(const Reach& reach, const LocalChain& chain, std::size_t first) {
    std::vector<NeuronState> states;
    for (std::size_t k = 0; k < chain.hidden.size(); ++k) {
      const Bounds& bounds = reach.before_relu(first + k);
      for (Index i = 0; i < bounds.lower.size(); ++i) {
        const double margin = kStateMargin * std::max(std::abs(bounds.lower(i)), std::abs(bounds.upper(i)));
        const bool has_relu = i < bounds.lower.size() - chain.without_relu[k];
        states.push_back(!has_relu || bounds.lower(i) > margin ? NeuronState::kOn
                         : bounds.upper(i) < -margin           ? NeuronState::kOff
                                                               : NeuronState::kUndecided);
      }
    }
    return states;
  }

  static int undecided_in(const std::vector<NeuronState>& states) {
    return static_cast<int>(std::count(states.begin(), states.end(), NeuronState::kUndecided));
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

  /// Of the pairs that come with the part's multipliers, those that hold in it between undecided neurons.
  std::vector<std::size_t> still_shown(const Part& part, const NeuronForms& forms) const {
    std::vector<std::size_t> result;
    const std::vector<NeuronPair>& pairs = multipliers_of(part).pairs;
    const auto is_undecided = [&](Index neuron) {
      return part.states[static_cast<std::size_t>(neuron)] == NeuronState::kUndecided;
    };
    for (std::size_t c = 0; c < pairs.size(); ++c)
      if (is_undecided(pairs[c].first) && is_undecided(pairs[c].second) && forms.excludes(pairs[c]))
        result.push_back(c);
    return result;
  }

  /// The inherited multipliers; adds the pairs, given by their indices, to `inequality`.
  VectorXd inherited(const Part& part, const std::vector<std::size_t>& pairs,
                     NodeInequality& inequality) const {
    const Multipliers& own = multipliers_of(part);
    VectorXd t(inequality.neurons() + static_cast<Index>(pairs.size()));
    t.head(inequality.neurons()) = own.t(inequality.undecided());
    for (std::size_t c = 0; c < pairs.size(); ++c) {
      inequality.add(own.pairs[pairs[c]]);
      t(inequality.neurons() + static_cast<Index>(c)) = own.of_pairs[pairs[c]];
    }
    return t;
  }

  /// The pairs worth a multiplier: those that come with the part's multipliers, and the best of the box's, up to `most`
  /// in all. `t` becomes the multipliers to start from.
  std::vector<NeuronPair> chosen_pairs(const Part& part, std::size_t most, VectorXd& t) const {
    if (most == 0 && multipliers_of(part).pairs.empty()) {
      NodeInequality inequality(chain_, part.states, gram_of(part));
      t = inherited(part, {}, inequality);
      return {};
    }
    std::vector<LinearForms> found;
    const Reach again(chain_.hidden, part.reach->box(), part.around.get(), nullptr, &found);
    const NeuronForms forms(found, part.reach->box());
    NodeInequality inequality(chain_, part.states, gram_of(part));
    const std::vector<std::size_t> old = still_shown(part, forms);
    t = inherited(part, old, inequality);
    std::vector<NeuronPair> result;
    for (const std::size_t c : old) result.push_back(multipliers_of(part).pairs[c]);
    const auto same = [](const NeuronPair& a, const NeuronPair& b) {
      return a.first == b.first && a.second == b.second && a.first_on == b.first_on &&
             a.second_on == b.second_on;
    };
    std::vector<NeuronPair> all;
    if (result.size() >= most) return result;
    for (const NeuronPair& pair : forms.pairs(inequality.undecided())) {
      if (std::any_of(result.begin(), result.end(),
                      [&](const NeuronPair& other) { return same(pair, other); }))
        continue;
      all.push_back(pair);
      inequality.add(pair);
    }
    if (all.empty()) return result;
    const Index before = t.size();
    t.conservativeResize(before + static_cast<Index>(all.size()));
    t.tail(static_cast<Index>(all.size())).setZero();
    const std::vector<double> gain = gains(inequality, t, kGap);
    std::vector<std::size_t> order(all.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto of = [&](std::size_t c) { return gain[old.size() + c]; };
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return of(a) > of(b) || (of(a) == of(b) && a < b); });
    order.resize(std::min(order.size(), most - old.size()));
    for (const std::size_t c : order)
      if (of(c) > kLeastGain) result.push_back(all[c]);
    t.conservativeResize(inequality.neurons() + static_cast<Index>(result.size()));
    return result;
  }

  /// Multipliers of the part's own.
  void solve(Part& part) {
    const double attained = std::max(steepest(), options_.known * options_.known / chain_.unscaled_rho(1));
    const double wanted = attained > 0 ? kShareOfDistance * (part.rho / attained - 1) : kGap;
    DescentOptions descent;
    descent.relative_gap = std::clamp(wanted, kFineGap, kGap);
    descent.steps = kSteps;
    solve(part, descent, static_cast<std::size_t>(std::max(options_.pairs, 0)));
  }

  void solve(Part& part, const DescentOptions& descent, std::size_t most_pairs) {
    NodeInequality inequality(chain_, part.states, gram_of(part));
    const Index m = inequality.neurons();
    std::vector<NeuronPair> pairs;
    VectorXd t;
    if (part.multipliers < 0) {
      t = root_multipliers(chain_, inequality);
    } else {
      pairs = chosen_pairs(part, most_pairs, t);
      for (const NeuronPair& pair : pairs) inequality.add(pair);
      t = descend(inequality, t, descent);
      if (!std::isfinite(inequality.least_rho(t)) && !pairs.empty()) {
        pairs.clear();
        inequality = NodeInequality(chain_, part.states, gram_of(part));
        t = root_multipliers(chain_, inequality);
      }
    }
    part.undecided_then = part.undecided;
    // In single precision: the certificate is half as long, and any multipliers will do that prove the part.
    t = t.cast<float>().cast<double>();
    const double rho = inequality.least_rho(t);
    if (!(rho < part.rho)) return;
    if (rho < kFar * part.rho) part.undecided_then = std::numeric_limits<int>::max();
    part.rho = rho;
    keep(part, t.head(m), std::move(pairs), t.tail(t.size() - m));
  }

  /// Makes these the part's multipliers: of the undecided neurons, and of pairs.
  void keep(Part& part, const VectorXd& t, std::vector<NeuronPair> pairs, const VectorXd& of_pairs) {
    Multipliers own;
    own.t = VectorXd::Zero(chain_.neurons());
    Index next = 0;
    for (std::size_t i = 0; i < part.states.size(); ++i)
      if (part.states[i] == NeuronState::kUndecided) own.t(static_cast<Index>(i)) = t(next++);
    std::vector<double> unscaled;
    for (Index i = 0; i < own.t.size(); ++i)
      unscaled.push_back(chain_.unscaled_multiplier(own.t(i), chain_.layer_of(i)));
    std::vector<check::Conflict> conflicts;
    for (std::size_t c = 0; c < pairs.size(); ++c) {
      own.of_pairs.push_back(of_pairs(static_cast<Index>(c)));
      conflicts.push_back(chain_.unscaled(pairs[c], own.of_pairs.back()));
    }
    own.pairs = std::move(pairs);
    part.multipliers = static_cast<int>(scaled_.size());
    scaled_.push_back(std::move(own));
    result_.tree.multipliers.push_back(std::move(unscaled));
    result_.tree.conflicts.push_back(std::move(conflicts));
  }

  /// Multipliers of the part's own for phi and rho together, and from rho's the form that takes its place.
  void renew_form(Part& part) {
    part.undecided_form = part.undecided;
    const OfRho* const old = part.form >= 0 ? &forms_[static_cast<std::size_t>(part.form)] : nullptr;
    OfRho own;
    const std::size_t first = chain_.hidden.size() + 1;  // layer of rho
    own.reach = std::make_shared<const Reach>(set_->whole.hidden, *part.reach,
                                              old != nullptr ? old->reach.get() : nullptr);
    const std::vector<NeuronState> behind = states_of(*own.reach, set_->rho, first);
    own.undecided = undecided_in(behind);
    if (old != nullptr && own.undecided > kLazyRho * old->undecided) {
      part.undecided_form = static_cast<int>(kFormAgain * part.undecided);
      return;
    }
    std::vector<NeuronState> states = part.states;
    states.insert(states.end(), static_cast<std::size_t>(set_->last.rows()), NeuronState::kOn);
    states.insert(states.end(), behind.begin(), behind.end());
    const NodeInequality joint(set_->whole, states);
    const Index m = undecided_in(part.states);
    VectorXd t;
    if (old == nullptr) {
      t = root_multipliers(set_->whole, joint);
    } else {
      VectorXd all(set_->whole.neurons());
      all << multipliers_of(part).t, VectorXd::Zero(set_->last.rows()), old->t;
      DescentOptions descent;
      descent.relative_gap = kGap;
      descent.steps = kSteps;
      t = descend(joint, all(joint.undecided()), descent);
    }
    t = t.cast<float>().cast<double>();
    const NodeInequality rho(set_->rho, behind);
    MatrixXd q = rho.least_form(t.tail(t.size() - m));
    if (q.size() == 0) return;
    q.diagonal().array() += kFormMargin * q.diagonal().maxCoeff();
    q = MatrixXd(q.cast<float>().cast<double>().selfadjointView<Eigen::Lower>());
    own.gram = set_->gram(q);
    const double least = NodeInequality(chain_, part.states, own.gram).least_rho(t.head(m));
    if (!(least < part.rho)) return;
    part.undecided_then = least < kFar * part.rho ? std::numeric_limits<int>::max() : part.undecided;
    part.rho = least;
    own.t = VectorXd::Zero(set_->rho.neurons());
    for (Index i = 0; i < t.size() - m; ++i) own.t(rho.undecided()[static_cast<std::size_t>(i)]) = t(m + i);
    check::Form form;
    for (Index i = 0; i < q.rows(); ++i)
      for (Index j = 0; j <= i; ++j) form.q.push_back(std::ldexp(q(i, j), set_->form_exponent()));
    for (Index i = 0; i < own.t.size(); ++i)
      form.t.push_back(set_->whole.unscaled_multiplier(own.t(i), first + set_->rho.layer_of(i)));
    result_.tree.forms.push_back(std::move(form));
    part.form = static_cast<int>(forms_.size());
    nodes_[static_cast<std::size_t>(part.index)].form = static_cast<int>(result_.tree.forms.size()) - 1;
    forms_.push_back(std::move(own));
    keep(part, t.head(m), {}, {});
  }

  /// Those that the options start from, one per output of a hidden layer of `chain`.
  VectorXd given_multipliers(const LocalChain& chain) const {
    VectorXd all(chain.neurons());
    Index neuron = 0, given = 0;
    for (std::size_t k = 0; k < chain.hidden.size(); ++k) {
      const Index rows = chain.hidden[k].weights.rows();
      for (Index i = 0; i < rows; ++i, ++neuron)
        all(neuron) = i < rows - chain.without_relu[k]
                          ? chain.scaled_multiplier(options_.start.at(static_cast<std::size_t>(given++)), k)
                          : 0;
    }
    return all;
  }

  /// Those that the options start from, improved, or where they prove nothing, those of the whole program.
  VectorXd root_multipliers(const LocalChain& chain, const NodeInequality& inequality) const {
    if (!options_.start.empty()) {
      const VectorXd t = given_multipliers(chain)(inequality.undecided());
      DescentOptions descent;
      descent.steps = kRootSteps;
      if (std::isfinite(inequality.least_rho(t))) return descend(inequality, t, descent);
    }
    InteriorPointOptions options;
    options.relative_gap = kRootGap;
    options.infeasibility = std::numeric_limits<double>::infinity();  // every iterate is a bound
    const InteriorPointResult found = minimise(inequality, interior(chain, inequality), options);
    return found.points.back().tail(inequality.neurons());
  }

  /// A point well inside: in a balanced chain all-ones is nearly feasible, and earlier layers want more.
  static VectorXd interior(const LocalChain& chain, const NodeInequality& inequality) {
    for (double shrink = 0.5;; shrink *= 0.5) {
      VectorXd layers(chain.neurons());
      double level = 4;
      Index end = layers.size();
      for (std::size_t k = chain.hidden.size(); k-- > 0; level /= shrink) {
        const Index rows = chain.hidden[k].weights.rows();
        layers.segment(end - rows, rows).setConstant(level);
        end -= rows;
        if (!chain.hidden[k].has_relu) level *= shrink;
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
    result_.tree.nodes.push_back({node.split, std::max(node.multipliers, 0), node.form});
    if (node.split == BranchTree::kLeaf) return;
    write_preorder(node.first_child);
    write_preorder(node.first_child + 1);
  }

  const LocalChain& chain_;
  const SetChain* const set_;  ///< null: no set function
  std::vector<OfRho> forms_;
  const std::vector<Box>& boxes_;
  const BranchOptions& options_;
  std::vector<TreeNode> nodes_;
  std::vector<Multipliers> scaled_;
  std::multimap<double, VectorXd, std::greater<>> steep_;  ///< centres by their squared slope
  std::vector<double> course_;                             ///< the bound after each split
  BranchResult result_;
};

}  // namespace

BranchResult branch(const LocalChain& chain, const std::vector<Box>& boxes, const BranchOptions& options) {
  keep_freed_memory();
  return Search(chain, nullptr, boxes, options).run();
}

BranchResult branch(const SetChain& set, const std::vector<Box>& boxes, const BranchOptions& options) {
  keep_freed_memory();
  return Search(set.phi, &set, boxes, options).run();
}

}  // namespace swarmcert::lipschitz
