#include "lipschitz/branch/sum_range.h"

#include <memory>
#include <queue>

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Relative margin by which the claimed range is wider than the computed one, for the round-off of the checker.
constexpr double kRangeMargin = 1e-9;

struct RangePart {
  double width = 0;
  std::size_t index = 0;  ///< index in the tree
  int split = 0;
  std::shared_ptr<const Reach> reach;
  bool operator<(const RangePart& other) const { return width < other.width; }
};

struct RangeNode {
  int split = -1;
  std::size_t first_child = 0;
};

RangePart range_part(const ReachNetwork& network, const Box& box, const Reach* around, std::size_t index) {
  RangePart part;
  std::vector<Eigen::MatrixXd> slopes;
  part.reach = std::make_shared<const Reach>(network, box, around, &slopes);
  part.index = index;
  part.width = (part.reach->output().upper - part.reach->output().lower).sum();
  VectorXd gain = slopes.back().colwise().sum().transpose();
  for (Index k = 0; k < gain.size(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    gain(k) *= box.upper[i] - box.lower[i];
  }
  Index best = 0;
  gain.maxCoeff(&best);
  part.split = static_cast<int>(best);
  return part;
}

void write_range_tree(const std::vector<RangeNode>& nodes, std::size_t at, std::string& text) {
  if (!text.empty()) text += ' ';
  const RangeNode& node = nodes[at];
  if (node.split < 0) {
    text += "t0";
    return;
  }
  text += "s" + std::to_string(node.split);
  write_range_tree(nodes, node.first_child, text);
  write_range_tree(nodes, node.first_child + 1, text);
}

}  // namespace

ReachNetwork reach_layers(const std::vector<check::HiddenLayer>& layers) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  ReachNetwork network;
  for (const check::HiddenLayer& layer : layers) {
    network.push_back({Eigen::Map<const RowMajor>(layer.weights.data(), layer.outputs, layer.inputs),
                       Eigen::Map<const VectorXd>(layer.biases.data(), layer.outputs),
                       VectorXd::Zero(layer.outputs), layer.without_relu != layer.outputs});
    if (layer.least.empty()) continue;
    const Eigen::Map<const VectorXd> least(layer.least.data(), layer.outputs);
    const Eigen::Map<const VectorXd> most(layer.most.data(), layer.outputs);
    const VectorXd size = network.back().bias.cwiseAbs() + least.cwiseAbs() + most.cwiseAbs();
    network.back().bias += (least + most) / 2;
    network.back().bias_radius = (most - least) / 2 + kRangeMargin * size;
  }
  return network;
}

RangeProof sum_range(const std::vector<check::HiddenLayer>& layers, const Box& box, int nodes) {
  const ReachNetwork network = reach_layers(layers);
  std::vector<RangeNode> tree(1);
  std::priority_queue<RangePart> queue;
  queue.push(range_part(network, box, nullptr, 0));
  for (int done = 1; done + 2 <= nodes; done += 2) {
    const RangePart top = queue.top();
    const Box& whole = top.reach->box();
    const auto k = static_cast<std::size_t>(top.split);
    if (!(whole.upper[k] > whole.lower[k])) break;
    queue.pop();
    tree[top.index] = {top.split, tree.size()};
    const auto [first, second] = halves(whole, top.split);
    for (const Box& half : {first, second}) {
      queue.push(range_part(network, half, top.reach.get(), tree.size()));
      tree.push_back({});
    }
  }
  Bounds hull = queue.top().reach->output();
  for (; !queue.empty(); queue.pop()) {
    const Bounds& bounds = queue.top().reach->output();
    hull.lower = hull.lower.cwiseMin(bounds.lower);
    hull.upper = hull.upper.cwiseMax(bounds.upper);
  }
  RangeProof proof;
  write_range_tree(tree, 0, proof.tree);
  for (Index i = 0; i < hull.lower.size(); ++i) {
    const double margin = kRangeMargin * std::max(std::abs(hull.lower(i)), std::abs(hull.upper(i))) + 1e-300;
    proof.least.push_back(hull.lower(i) - margin);
    proof.most.push_back(hull.upper(i) + margin);
  }
  return proof;
}

}  // namespace swarmcert::lipschitz
