#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>
#include <utility>

#include "lipschitz/branch/search.h"
#include "lipschitz/solver/dense_kernels.h"
#include "nn/base/parallel.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Relative margin of the claimed rho above the least one, for the round-off of the checker.
constexpr double kRhoMargin = 1e-8;
/// A part gets its own multipliers once the number of its undecided neurons is below this share of the number for which
/// the inherited ones were computed.
constexpr double kLazy = 0.9;
/// Or after this many successive halvings that decided no neuron. Far from the origin of a projective cover, neurons
/// that depend on s alone stay undecided, because no input reaches them; they do not affect the bound once their
/// multipliers are large.
constexpr int kInVain = 6;
/// Number of parts that take a step at the same time: the length of the queue over kPartsPerStep, at most kMostSteps.
/// Nearly all dominating parts are halved sooner or later, so taking several at once costs hardly any additional boxes
/// unless the queue is short. The number does not depend on the number of threads, hence neither does the result.
constexpr std::size_t kPartsPerStep = 8, kMostSteps = 16;
/// If a search ends with at most this many parts, at most kPolished dominating ones are solved again, with kFineSteps
/// steps and up to kMostPairs pairs.
constexpr std::size_t kFewParts = 64;
constexpr int kPolished = 8;
constexpr int kFineSteps = 20;
constexpr std::size_t kMostPairs = 40;
/// Number of points of the dominating part at which the slope is evaluated for the outlook.
constexpr int kSamples = 500;

}  // namespace

const char* name(BranchStop stop) {
  switch (stop) {
    case BranchStop::kCloseEnough:
      return "close enough";
    case BranchStop::kNodes:
      return "nodes used up";
    case BranchStop::kTimeLimit:
      return "time limit";
    case BranchStop::kCancelled:
      return "cancelled";
    case BranchStop::kNothingToHalve:
      return "nothing to halve";
    case BranchStop::kNothingRun:
      break;
  }
  return "nothing run";
}

bool BranchSearch::sharpen(Part& part) const {
  if (set_ != nullptr && part.undecided < kFormLazy * part.undecided_form) {
    const double before = part.rho;
    renew_form(part);
    if (part.rho < before) return true;
  }
  if (set_ != nullptr && part.form == nullptr) return false;
  if (part.undecided < kLazy * part.undecided_then) {
    solve(part);
    return true;
  }
  if (part.multipliers && part.in_vain >= kInVain) {
    part.in_vain = 0;
    solve(part, fine_descent(), static_cast<std::size_t>(std::max(options_.pairs, 0)));
    return true;
  }
  return false;
}

BranchSearch::Step BranchSearch::advanced(Part part) const {
  Step step;
  if (is_over()) return step;
  if (!sharpen(part)) {
    step.is_stuck = !(relative_width(part.reach->box(), static_cast<std::size_t>(part.split)) > kThin);
    if (!step.is_stuck) {
      const auto [lower, upper] = halves(part.reach->box(), part.split);
      step.halves = {this->part(lower, &part), this->part(upper, &part)};
    }
  }
  step.part = std::move(part);
  return step;
}

void BranchSearch::count(const Part& part) {
  ++result_.nodes;
  result_.undecided_per_box += (part.undecided - result_.undecided_per_box) / result_.nodes;
}

void BranchSearch::record(Part& part) {
  SearchNode& node = nodes_[static_cast<std::size_t>(part.index)];
  node.decided.insert(node.decided.end(), part.decided.begin(), part.decided.end());
  part.decided.clear();
  if (part.has_new_form) node.form = {part.form, &part.form->written};
  part.has_new_form = false;
}

void BranchSearch::commit(Step step, std::priority_queue<Part>& queue) {
  record(step.part);
  if (step.halves.empty()) {
    count(step.part);
    queue.push(std::move(step.part));
    return;
  }
  SearchNode& node = nodes_[static_cast<std::size_t>(step.part.index)];
  node.split = step.part.split;
  node.first_child = static_cast<int>(nodes_.size());
  for (Part& half : step.halves) {
    half.index = static_cast<int>(nodes_.size());
    nodes_.push_back({});
    count(half);
    look_at_centre(half.reach->box());
    record(half);
    queue.push(std::move(half));
  }
}

std::vector<BranchSearch::Part> BranchSearch::roots() {
  std::vector<Part> parts(boxes_.size());
  nodes_.resize(boxes_.size());
  files::parallel_for(static_cast<int>(boxes_.size()), options_.jobs, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    parts[k] = part(boxes_[k], nullptr);
    parts[k].index = i;
  });
  for (const Part& root : parts) {
    count(root);
    look_at_centre(root.reach->box());
  }
  files::parallel_for(static_cast<int>(boxes_.size()), options_.jobs, [&](int i) {
    Part& root = parts[static_cast<std::size_t>(i)];
    if (set_ == nullptr) {
      solve(root);
    } else {
      renew_form(root);
    }
  });
  for (Part& root : parts) record(root);
  return parts;
}

std::vector<BranchSearch::Part> BranchSearch::next_batch(std::priority_queue<Part>& queue) const {
  const std::size_t size = std::clamp<std::size_t>(queue.size() / kPartsPerStep, 1, kMostSteps);
  std::vector<Part> batch;
  while (!queue.empty() && batch.size() < size) {
    if (!batch.empty() && bound(queue.top()) <= enough()) break;
    batch.push_back(queue.top());
    queue.pop();
  }
  return batch;
}

double BranchSearch::enough() const {
  const double attained = std::max(options_.known, std::sqrt(chain_.unscaled_rho(steepest())));
  return attained * (1 + options_.tolerance);
}

double BranchSearch::share_of_time() const {
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
  return options_.seconds > 0 ? elapsed.count() / options_.seconds : 0;
}

BranchStop BranchSearch::why_stop(const std::priority_queue<Part>& queue) const {
  if (bound(queue.top()) <= enough()) return BranchStop::kCloseEnough;
  if (share_of_time() >= 1) return BranchStop::kTimeLimit;
  if (is_cancelled()) return BranchStop::kCancelled;
  return result_.nodes < options_.nodes ? BranchStop::kNothingRun : BranchStop::kNodes;
}

BranchResult BranchSearch::run() {
  constexpr int kNodesPerReport = 256;
  std::priority_queue<Part> queue;
  for (Part& root : roots()) queue.push(std::move(root));
  int reported = 0;
  while ((result_.stop = why_stop(queue)) == BranchStop::kNothingRun) {
    std::vector<Part> batch = next_batch(queue);
    std::vector<Step> steps(batch.size());
    files::parallel_for(static_cast<int>(batch.size()), options_.jobs, [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      steps[k] = advanced(batch[k]);
    });
    if (is_over()) {  // a round that is cut short counts for nothing, so that the result depends on `nodes` alone
      for (Part& part : batch) queue.push(std::move(part));
      continue;
    }
    const bool is_stuck = steps.front().is_stuck;
    std::size_t halvings = 0;
    for (Step& step : steps) {
      halvings += step.halves.empty() ? 0 : 1;
      commit(std::move(step), queue);
    }
    if (is_stuck) {
      result_.stop = BranchStop::kNothingToHalve;
      break;
    }
    course_.insert(course_.end(), halvings, bound(queue.top()));
    if (options_.progress && result_.nodes / kNodesPerReport > reported) {
      reported = result_.nodes / kNodesPerReport;
      const double share = std::max(share_of_time(), 1.0 * result_.nodes / options_.nodes);
      options_.progress(std::min(share, 1.0), bound(queue.top()));
    }
  }
  return finished(queue);
}

BranchResult BranchSearch::finished(std::priority_queue<Part>& queue) {
  polish(queue);
  const double rho = queue.top().rho * (1 + kRhoMargin);
  look_ahead(queue.top());
  for (; !queue.empty(); queue.pop()) {
    const std::shared_ptr<const Multipliers>& multipliers = queue.top().multipliers;
    if (multipliers)
      nodes_[static_cast<std::size_t>(queue.top().index)].proof = {multipliers, &multipliers->written};
  }
  result_.tree = in_preorder(nodes_, boxes_.size());
  result_.tree.rho = chain_.unscaled_rho(rho);
  for (const auto& [slope, centre] : steep_) result_.steep_centres.push_back(centre);
  return std::move(result_);
}

void BranchSearch::look_ahead(const Part& top) {
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

DescentOptions BranchSearch::fine_descent() {
  DescentOptions descent;
  descent.relative_gap = kFineGap;
  descent.steps = kFineSteps;
  return descent;
}

void BranchSearch::polish(std::priority_queue<Part>& queue) {
  if (queue.size() > kFewParts) return;
  for (int i = 0; i < kPolished; ++i) {
    Part top = queue.top();
    if (!top.multipliers) return;
    const double before = top.rho;
    queue.pop();
    solve(top, fine_descent(), kMostPairs);
    const bool is_better = top.rho < before;
    queue.push(std::move(top));
    if (!is_better) return;
  }
}

namespace {

/// Runs the search. If it ends with few parts, also solves the given boxes accurately without halving them, which may
/// prove a smaller bound than parts solved in a few steps, and returns the better result.
BranchResult search(const LocalChain& chain, const SetChain* set, const std::vector<Box>& boxes,
                    const BranchOptions& options) {
  keep_freed_memory();
  BranchResult found = BranchSearch(chain, set, boxes, options).run();
  BranchOptions uncut = options;
  uncut.nodes = static_cast<int>(boxes.size());
  if (found.nodes <= uncut.nodes || found.nodes > 2 * static_cast<int>(kFewParts)) return found;
  BranchResult whole = BranchSearch(chain, set, boxes, uncut).run();
  if (whole.tree.rho < found.tree.rho) found.tree = std::move(whole.tree);
  return found;
}

}  // namespace

BranchResult branch(const LocalChain& chain, const std::vector<Box>& boxes, const BranchOptions& options) {
  return search(chain, nullptr, boxes, options);
}

BranchResult branch(const SetChain& set, const std::vector<Box>& boxes, const BranchOptions& options) {
  return search(set.phi, &set, boxes, options);
}

}  // namespace swarmcert::lipschitz
