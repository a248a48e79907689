#include "lipschitz/branch/slope_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>

#include "lipschitz/base/rounding.h"
#include "lipschitz/branch/descend.h"
#include "lipschitz/branch/search_tree.h"
#include "lipschitz/checker/proposed_factor.h"
#include "lipschitz/checker/slope_tree.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/upper/bent_bound.h"
#include "lipschitz/upper/live_chain.h"
#include "nn/base/parallel.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Relative accuracy to which the program of the whole box is solved; parts start from the multipliers of their parent.
constexpr double kWholeGap = 1e-3;
/// Neurons whose slopes differ by at most this over a part are eliminated in the search.
constexpr double kDecided = 0x1p-20;
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
    solve(root, nullptr);
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
    VectorXd weighted;      ///< multipliers times the widths of the slope ranges
    std::vector<double> t;  ///< multipliers
    std::size_t split = 0;  ///< the coordinate to halve
    bool operator<(const Part& other) const { return rho < other.rho; }
  };

  /// Finds multipliers of the part, from those of its parent if it has one, and chooses the coordinate to halve.
  void solve(Part& part, const Part* parent) const {
    const check::BentChain chain =
        check::chain_on_box(network_, claim_.function, claim_.block, claim_.scale, intervals(part.box));
    const std::vector<SlopeLayer> layers = slope_layers(chain);
    if (parent != nullptr) {
      const MatrixXd last = rounded({chain.stages.back()}).front();
      part.weighted = parent->weighted;
      improve(layers, last.transpose() * last, part);
    }
    if (parent == nullptr || !(part.rho < parent->rho)) solve_anew(chain, part);
    if (part.weighted.size() > 0) part.split = best_split(part, layers);
  }

  /// Solves the program of the part without a start; keeps its multipliers if they are the better ones.
  void solve_anew(const check::BentChain& chain, Part& part) const {
    SdpOptions sdp;
    sdp.stop = Stop(options_.cancelled);
    sdp.relative_gap = kWholeGap;
    BentPoints found = bent_points(chain, sdp);
    if (found.points.empty() || !(found.points.back().rho < part.rho)) return;
    part.rho = found.points.back().rho;
    part.t = std::move(found.points.back().t);
    const VectorXd width = widths(chain);
    part.weighted = width.cwiseProduct(Eigen::Map<const VectorXd>(part.t.data(), width.size()));
  }

  /// Makes Newton steps from the multipliers of the parent.
  static void improve(std::vector<SlopeLayer> layers, const MatrixXd& gram, Part& part) {
    VectorXd width(part.weighted.size());
    Index next = 0;
    for (SlopeLayer& layer : layers) {
      width.segment(next, layer.width.size()) = layer.width;
      next += layer.width.size();
      for (Index i = 0; i < layer.width.size(); ++i) {
        if (layer.width(i) > kDecided) continue;
        layer.low(i) += layer.width(i) / 2;
        layer.width(i) = 0;
      }
    }
    const NodeInequality inequality(layers, gram);
    VectorXd t = descend(inequality, part.weighted(inequality.undecided()), {});
    part.weighted(inequality.undecided()) = t;
    part.t.clear();
    for (Index i = 0; i < width.size(); ++i) {  // single precision halves the length of the certificate
      part.t.push_back(static_cast<float>(part.weighted(i) / width(i)));
      part.weighted(i) = part.t.back() * width(i);
    }
    part.rho = inequality.least_rho(part.weighted(inequality.undecided()));
  }

  static VectorXd widths(const check::BentChain& chain) {
    VectorXd result(static_cast<Index>(chain.slopes.size()));
    for (Index i = 0; i < result.size(); ++i) {
      const check::SlopeRange& range = chain.slopes[static_cast<std::size_t>(i)];
      result(i) = check::to_double(range.high - range.low);
    }
    return result;
  }

  static std::vector<SlopeLayer> slope_layers(const check::BentChain& chain) {
    const ReluChain stages = rounded(chain.stages);
    const VectorXd width = widths(chain);
    std::vector<SlopeLayer> result;
    Index next = 0;
    for (std::size_t k = 0; k + 1 < stages.size(); ++k) {
      const Index rows = stages[k].rows();
      VectorXd low(rows);
      for (Index i = 0; i < rows; ++i)
        low(i) = check::to_double(chain.slopes[static_cast<std::size_t>(next + i)].low);
      result.push_back({stages[k], low, width.segment(next, rows)});
      next += rows;
    }
    return result;
  }

  /// Returns the coordinate whose halving is expected to lower the bound the most. The constraint of a neuron is slack
  /// by up to its multiplier times the width of its slope range times |dy|^2 / 4, and the width goes back to the
  /// coordinates in the shares in which they move the neuron; derivatives are taken at the middle slopes.
  std::size_t best_split(const Part& part, const std::vector<SlopeLayer>& slopes) const {
    const files::Weights& weights = *files::parts(network_).at(claim_.function.input_part());
    VectorXd side(weights.inputs()), score = VectorXd::Zero(weights.inputs());
    for (Index k = 0; k < side.size(); ++k) {
      const auto at = static_cast<std::size_t>(k);
      side(k) = part.box.upper[at] - part.box.lower[at];
    }
    MatrixXd slope = MatrixXd::Identity(side.size(), side.size());
    Index neuron = 0;
    for (std::size_t k = 0; k + 1 < weights.layers.size(); ++k) {
      const files::Layer& layer = weights.layers[k];
      slope = (Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
                   layer.weights.data(), layer.outputs, layer.inputs) *
               slope)
                  .eval();
      for (Index i = 0; i < slope.rows(); ++i, ++neuron) {
        const VectorXd moved = slope.row(i).transpose().cwiseAbs().cwiseProduct(side);
        const double by = moved.sum(), slack = part.weighted(neuron) * slopes[k].width(i);
        if (by > 0) score += slack * slope.row(i).squaredNorm() / by * moved;
      }
      slope = ((slopes[k].low + slopes[k].width / 2).asDiagonal() * slope).eval();
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
    for (Part& half : result) solve(half, &part);
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
    constexpr double kWork = 4e9, kFewest = 20, kMost = 2000;
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
    for (const double slack : {1e-6, 1e-5, 1e-4, 1e-3, 1e-2}) {
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
