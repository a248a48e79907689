#include "lipschitz/branch/slope_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>

#include "lipschitz/base/rounding.h"
#include "lipschitz/branch/search_tree.h"
#include "lipschitz/checker/centred_form.h"
#include "lipschitz/checker/slope_tree.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/upper/bent_bound.h"
#include "lipschitz/values/reach.h"
#include "nn/base/parallel.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Relative accuracy to which the program of a part is solved.
constexpr double kPartGap = 1e-4;
/// Number of parts halved at the same time: the length of the queue over kPartsPerRound, at most kMostPerRound. It does
/// not depend on the number of threads, hence neither does the result.
constexpr std::size_t kPartsPerRound = 4, kMostPerRound = 8;

check::Intervals intervals(const Box& box) {
  return {{box.lower.begin(), box.lower.end()}, {box.upper.begin(), box.upper.end()}};
}

class SlopeSearch {
 public:
  SlopeSearch(const files::Network& network, const Claim& claim, const Box& box, const BranchOptions& options)
      : network_(network), claim_(claim), box_(box), options_(options) {}

  LocalBound run() {
    Part root;
    root.box = box_;
    solve(root);
    nodes_.push_back({});
    LocalBound result;
    result.nodes = 1;
    const int most = options_.nodes > 0 ? options_.nodes : usual_nodes(root);
    std::priority_queue<Part> queue;
    queue.push(std::move(root));
    while ((result.stop = why_stop(queue.top(), result.nodes, most)) == BranchStop::kNothingRun) {
      std::vector<Part> batch = next_batch(queue);
      std::vector<std::array<Part, 2>> halves(batch.size());
      files::parallel_for(static_cast<int>(batch.size()), options_.jobs, [&](int i) {
        const auto k = static_cast<std::size_t>(i);
        if (!stop_.now()) halves[k] = halved(batch[k]);
      });
      if (stop_.now()) {  // a round that is cut short counts for nothing
        for (Part& part : batch) queue.push(std::move(part));
        continue;
      }
      for (std::size_t k = 0; k < batch.size(); ++k) commit(batch[k], halves[k], queue);
      result.nodes += 2 * static_cast<int>(batch.size());
      if (options_.progress)
        options_.progress(std::min(1.0, 1.0 * result.nodes / most), std::sqrt(queue.top().rho));
    }
    prove(queue, result);
    return result;
  }

 private:
  struct Part {
    double rho = std::numeric_limits<double>::infinity();
    int index = 0;  ///< index in nodes_
    Box box;
    std::vector<double> t;
    std::size_t split = 0;  ///< the coordinate to halve
    bool operator<(const Part& other) const { return rho < other.rho; }
  };

  /// Solves the program of the part and chooses the coordinate to halve.
  void solve(Part& part) const {
    const check::Intervals box = intervals(part.box);
    SdpOptions sdp;
    sdp.stop = Stop(options_.cancelled);
    sdp.relative_gap = kPartGap;
    BentPoints found =
        bent_points(check::chain_on_box(network_, claim_.function, claim_.block, claim_.scale, box), sdp);
    if (!found.points.empty()) {
      part.rho = found.points.back().rho;
      part.t = std::move(found.points.back().t);
    }
    part.split = best_split(part.box, box);
  }

  /// Returns the coordinate whose width, times the derivatives of the neurons by it at their middle slopes, times the
  /// widths of their slope ranges, is largest.
  std::size_t best_split(const Box& box, const check::Intervals& intervals) const {
    const files::Weights& weights = *files::parts(network_).at(claim_.function.input_part());
    const auto slopes = check::slopes_on_box(weights, intervals);
    VectorXd width(weights.inputs()), score = VectorXd::Zero(weights.inputs());
    for (Index k = 0; k < width.size(); ++k) {
      const auto at = static_cast<std::size_t>(k);
      width(k) = box.upper[at] - box.lower[at];
    }
    MatrixXd slope = width.asDiagonal();
    for (std::size_t k = 0; k < slopes.size(); ++k) {
      const files::Layer& layer = weights.layers[k];
      slope = (Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
                   layer.weights.data(), layer.outputs, layer.inputs) *
               slope)
                  .eval();
      for (Index i = 0; i < slope.rows(); ++i) {
        const check::Interval& range = slopes[k][static_cast<std::size_t>(i)];
        const double low = to_double(range.lower), high = to_double(range.upper);
        score += (high - low) * slope.row(i).cwiseAbs().transpose();
        slope.row(i) *= (low + high) / 2;
      }
    }
    Index best = 0;
    score.maxCoeff(&best);
    return static_cast<std::size_t>(best);
  }

  std::array<Part, 2> halved(const Part& part) const {
    const auto [lower, upper] = halves(part.box, static_cast<Index>(part.split));
    std::array<Part, 2> result;
    result[0].box = lower;
    result[1].box = upper;
    for (Part& half : result) solve(half);
    return result;
  }

  void commit(const Part& part, std::array<Part, 2>& halves, std::priority_queue<Part>& queue) {
    nodes_[static_cast<std::size_t>(part.index)].split = static_cast<int>(part.split);
    nodes_[static_cast<std::size_t>(part.index)].first_child = static_cast<int>(nodes_.size());
    for (Part& half : halves) {
      half.index = static_cast<int>(nodes_.size());
      nodes_.push_back({});
      queue.push(std::move(half));
    }
  }

  static std::vector<Part> next_batch(std::priority_queue<Part>& queue) {
    const std::size_t size = std::clamp<std::size_t>(queue.size() / kPartsPerRound, 1, kMostPerRound);
    std::vector<Part> batch;
    for (; batch.size() < size; queue.pop()) batch.push_back(queue.top());
    return batch;
  }

  /// Returns how many boxes take about ten seconds; one if the program of the whole box was not solved.
  int usual_nodes(const Part& root) const {
    constexpr double kWork = 4e8, kFewest = 20, kMost = 200;
    if (root.t.empty()) return 1;
    const double size = static_cast<double>(root.t.size() + root.box.lower.size());
    return static_cast<int>(std::clamp(kWork / std::pow(size, 3), kFewest, kMost));
  }

  BranchStop why_stop(const Part& top, int nodes, int most) const {
    if (std::sqrt(top.rho) <= options_.known * (1 + options_.tolerance)) return BranchStop::kCloseEnough;
    if (stop_.is_cancelled()) return BranchStop::kCancelled;
    if (stop_.is_out_of_time()) return BranchStop::kTimeLimit;
    if (!(top.box.lower[top.split] < top.box.upper[top.split])) return BranchStop::kNothingToHalve;
    return nodes < most ? BranchStop::kNothingRun : BranchStop::kNodes;
  }

  /// Proves all parts for the largest rho among them, or a slightly larger one.
  void prove(std::priority_queue<Part>& queue, LocalBound& result) {
    const double rho = std::max(queue.top().rho, std::numeric_limits<double>::min());
    if (!std::isfinite(rho)) return;
    for (; !queue.empty(); queue.pop()) {
      const Part& part = queue.top();
      if (result.steep_centres.size() < kSteepCentres) {
        const auto n = static_cast<Index>(part.box.lower.size());
        result.steep_centres.push_back((Eigen::Map<const VectorXd>(part.box.lower.data(), n) +
                                        Eigen::Map<const VectorXd>(part.box.upper.data(), n)) /
                                       2);
      }
      nodes_[static_cast<std::size_t>(part.index)].proof =
          std::make_shared<const LeafProof>(LeafProof{part.t, {}});
    }
    LocalProof proof;
    BranchTree tree = in_preorder(nodes_, 1);
    proof.tree.tree = words_of(tree);
    proof.tree.multipliers = std::move(tree.multipliers);
    for (const double slack : {1e-8, 1e-6, 1e-5, 1e-4, 1e-3}) {
      proof.rho = rho * (1 + slack);
      const check::TreeVerdict verdict =
          check::check_slope_tree(network_, claim_.function, claim_.block, claim_.scale,
                                  {box_.lower, box_.upper}, proof.rho, proof.tree);
      result.leaves = verdict.leaves;
      if (!verdict.holds) continue;
      result.upper = UpperBound(sqrt_up(proof.rho));
      result.proof = std::move(proof);
      return;
    }
  }

  const files::Network& network_;
  const Claim& claim_;
  const Box& box_;
  const BranchOptions& options_;
  const Stop stop_{options_.cancelled, options_.seconds};
  std::vector<SearchNode> nodes_;
};

}  // namespace

LocalBound slope_parts(const files::Network& network, const Claim& claim, const Box& box,
                       const BranchOptions& options) {
  const files::Parts parts = files::parts(network);
  for (const files::FunctionId& name : claim.function.parts())
    for (const files::Activation activation : parts.at(name)->activations())
      if (files::function_of(activation).sorts()) return {};
  if (claim.function.is_rho() || parts.at(claim.function.input_part())->layers.size() < 2) return {};
  return SlopeSearch(network, claim, box, options).run();
}

}  // namespace swarmcert::lipschitz
