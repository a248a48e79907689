#include "lipschitz/branch/local_bound.h"

#include <algorithm>

#include "lipschitz/lmi_proof.h"
#include "lipschitz/stages.h"
#include "nn/files/functions.h"

namespace swarmcert::lipschitz {
namespace {

/// A constant function has no slope, a proof needs rho > 0.
constexpr double kLeastRho = 1e-100;

check::Matrix exact(const Eigen::MatrixXd& q) {
  check::Matrix result(static_cast<int>(q.rows()), static_cast<int>(q.cols()));
  for (int i = 0; i < result.rows; ++i)
    for (int j = 0; j < result.cols; ++j) result(i, j) = check::Dyadic(q(i, j));
  return result;
}

std::string preorder(const BranchTree& tree) {
  std::string text;
  for (const BranchTree::Node& node : tree.nodes) {
    if (!text.empty()) text += ' ';
    text += node.split == BranchTree::kLeaf ? "t" + std::to_string(node.multipliers)
                                            : "s" + std::to_string(node.split);
  }
  return text;
}

}  // namespace

LocalBound local_bound(const files::Network& network, const Claim& claim, const Box& box,
                       const std::vector<double>& joint_t, const BranchOptions& options) {
  LocalBound result;
  const std::vector<std::string> names = files::networks_of(claim.function);
  const std::vector<files::Layer>& layers = files::parts(network).at(names.front())->layers;
  if (layers.size() < 2 || names.front().rfind("rho:", 0) == 0) return result;
  LocalProof proof;
  if (names.size() == 2) {
    const std::vector<check::Matrix> rho = check::stages(network, names.back());
    const std::size_t hidden = check::hidden_neurons(rho);
    if (rho.size() < 2 || joint_t.size() < hidden) return result;
    proof.form = rho_form(rho, {joint_t.end() - static_cast<std::ptrdiff_t>(hidden), joint_t.end()});
    if (!proof.form) return result;
  }
  const Eigen::MatrixXd q = proof.form ? proof.form->q : Eigen::MatrixXd();
  const check::LocalFunction f =
      check::local_function(network, names.front(), claim.block, claim.scale, exact(q));

  const LocalChain chain =
      local_chain(reach_network(*files::parts(network).at(names.front())), q, f.coordinates, f.weight);
  BranchResult found = branch(chain, box, options);
  result.nodes = found.nodes;
  result.steep_centres = std::move(found.steep_centres);
  proof.tree.tree = preorder(found.tree);
  proof.tree.multipliers = std::move(found.tree.multipliers);
  // The search rounds, the checker rounds otherwise: where a part is lost to that, a little more is claimed.
  for (const double slack : {0.0, 1e-7, 1e-6, 1e-5, 1e-4}) {
    proof.rho = std::max(found.tree.rho * (1 + slack), kLeastRho);
    const check::TreeVerdict verdict = check::check_tree(f, box.lower, box.upper, proof.rho, proof.tree);
    result.leaves = verdict.leaves;
    if (!verdict.holds) continue;
    result.upper = UpperBound(sqrt_up(proof.rho));
    result.proof = std::move(proof);
    break;
  }
  return result;
}

}  // namespace swarmcert::lipschitz
