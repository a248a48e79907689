#include "lipschitz/branch/local_bound.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lipschitz/base/rounding.h"
#include "lipschitz/branch/search_tree.h"
#include "lipschitz/checker/projective_cover.h"
#include "lipschitz/checker/stages.h"
#include "lipschitz/upper/lmi_proof.h"
#include "nn/base/median.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;

/// Smallest rho: a proof needs rho > 0 even for a constant function.
constexpr double kLeastRho = 1e-100;

check::Matrix exact(const Eigen::MatrixXd& q) {
  check::Matrix result(static_cast<int>(q.rows()), static_cast<int>(q.cols()));
  for (int i = 0; i < result.rows; ++i)
    for (int j = 0; j < result.cols; ++j) result(i, j) = check::Dyadic(q(i, j));
  return result;
}

/// Number of boxes per kind to enclose the term of a neighbour.
constexpr int kRangeNodes = 400;

/// Returns the median distance of the first layer's kinks from the origin: the radius of the cover's inner box.
double cover_radius(const files::Layer& layer) {
  std::vector<double> distances;
  for (int i = 0; i < layer.outputs; ++i) {
    double square = 0;
    for (int j = 0; j < layer.inputs; ++j)
      square += std::pow(layer.weights[static_cast<std::size_t>(i) * layer.inputs + j], 2);
    const double distance = std::abs(layer.biases[static_cast<std::size_t>(i)]) / std::sqrt(square);
    if (distance > 1e-20 && distance < 1e20) distances.push_back(distance);
  }
  if (distances.empty()) return 1;
  return std::exp2(std::ceil(std::log2(upper_median(std::move(distances)))));
}

/// The ranges of the other terms, and the range of their sum before the first ReLU of rho.
struct Others {
  std::map<files::FunctionId, RangeProof> ranges;
  std::vector<double> least, most;
};

Others others_of(const files::Network& network, const Claim& claim, const Domain& domain, int nodes) {
  const std::vector<files::FunctionId> names = claim.function.parts();
  const files::FunctionId ground = files::FunctionId::ground_phi();
  std::map<files::FunctionId, int> counts;
  for (const auto& [kind, count] : claim.neighbours) counts[files::FunctionId::phi(kind)] = count;
  if (names[0] == ground) {
    counts.erase(ground);
  } else {
    if (--counts.at(names[0]) == 0) counts.erase(names[0]);
    if (network.phi.count(files::kGroundKind) == 1) counts[ground] = 1;
  }
  Others others;
  const auto rows = static_cast<std::size_t>(files::parts(network).at(names[1])->layers.front().outputs);
  others.least.assign(rows, 0.0);
  others.most.assign(rows, 0.0);
  for (const auto& [part, count] : counts) {
    RangeProof range =
        sum_range(check::term_layers(network, part, names[1]), domain.at(part), std::min(nodes, kRangeNodes));
    for (std::size_t i = 0; i < rows; ++i) {  // the ground once, others up to `count` times
      others.least[i] += part == ground ? range.least[i] : count * std::min(range.least[i], 0.0);
      others.most[i] += part == ground ? range.most[i] : count * std::max(range.most[i], 0.0);
    }
    others.ranges.emplace(part, std::move(range));
  }
  return others;
}

/// Returns the number of hidden neurons with a ReLU.
std::size_t multipliers_of(const LocalChain& chain) {
  Index count = chain.neurons();
  for (const Index without : chain.without_relu) count -= without;
  return static_cast<std::size_t>(count);
}

/// Runs branch and bound on `f` and verifies the result with the checker.
/// @param search runs the search over the boxes with the options.
template <class Search>
void prove(const check::LocalFunction& f, const std::vector<check::Sides>& boxes, const Search& search,
           LocalProof proof, LocalBound& result) {
  std::vector<Box> roots;
  for (const check::Sides& box : boxes) roots.push_back({box.lower, box.upper});
  BranchResult found = search(roots);
  result.stop = found.stop;
  result.nodes = found.nodes;
  result.undecided_per_box = found.undecided_per_box;
  result.outlook = found.outlook;
  result.steep_centres = std::move(found.steep_centres);
  proof.tree.tree = words_of(found.tree);
  proof.tree.multipliers = std::move(found.tree.multipliers);
  proof.tree.conflicts = std::move(found.tree.conflicts);
  proof.tree.forms = std::move(found.tree.forms);
  // The checker has other round-off errors than the search. If it refuses a part, a slightly larger rho is claimed.
  for (const double slack : {0.0, 1e-7, 1e-6, 1e-5, 1e-4}) {
    proof.rho = std::max(found.tree.rho * (1 + slack), kLeastRho);
    const check::TreeVerdict verdict = check::check_tree(f, boxes, proof.rho, proof.tree);
    result.leaves = verdict.leaves;
    if (!verdict.holds) continue;
    result.upper = UpperBound(sqrt_up(proof.rho));
    result.proof = std::move(proof);
    break;
  }
}

/// Returns initial multipliers: the first entries of `t`, which belong to the neurons of `chain`; none if `t` is too
/// short.
std::vector<double> beginning(const std::vector<double>& t, const LocalChain& chain) {
  const std::size_t size = multipliers_of(chain);
  if (t.size() < size) return {};
  return {t.begin(), t.begin() + static_cast<std::ptrdiff_t>(size)};
}

}  // namespace

LocalBounds::LocalBounds(const files::Network& network, const Claim& claim,
                         const std::vector<double>& joint_t) {
  const std::vector<files::FunctionId> names = claim.function.parts();
  const files::Parts parts = files::parts(network);
  const std::vector<files::Layer>& layers = parts.at(names.front())->layers;
  if (layers.size() < 2 || names.front().is_rho()) return;
  if (names.size() == 2) {
    const std::vector<check::Matrix> rho = check::stages(network, names.back());
    const std::size_t hidden = check::hidden_neurons(rho);
    if (rho.size() < 2 || joint_t.size() < hidden) return;
    form_ = rho_form(rho, {joint_t.end() - static_cast<std::ptrdiff_t>(hidden), joint_t.end()});
    if (!form_) return;
  }
  const Eigen::MatrixXd q = form_ ? form_->q : Eigen::MatrixXd();
  f_ = check::local_function(network, names.front(), claim.block, claim.scale, exact(q));
  chain_ = local_chain(reach_network(*parts.at(names.front())), q, f_.coordinates, f_.weight);
  start_ = beginning(joint_t, chain_);
  cover_radius_ = cover_radius(layers.front());
  has_bound_ = true;
}

LocalBound LocalBounds::over(const check::LocalFunction& f, const LocalChain& chain,
                             const std::vector<check::Sides>& boxes, const std::vector<double>& radius,
                             BranchOptions options) const {
  LocalBound result;
  options.start = start_;
  LocalProof proof;
  proof.form = form_;
  proof.radius = radius;
  prove(
      f, boxes, [&](const std::vector<Box>& roots) { return branch(chain, roots, options); },
      std::move(proof), result);
  return result;
}

LocalBound LocalBounds::on(const Box& box, const BranchOptions& options) const {
  if (!has_bound_) return {};
  return over(f_, chain_, {{box.lower, box.upper}}, {}, options);
}

LocalBound LocalBounds::everywhere(const BranchOptions& options) const {
  if (!has_bound_) return {};
  const std::vector<double> radius(static_cast<std::size_t>(chain_.inputs()), cover_radius_);
  LocalBound result =
      over(check::homogeneous(f_), homogeneous(chain_), check::projective_cover(radius), radius, options);
  for (Eigen::VectorXd& centre : result.steep_centres) {  // (u, s) represents the point u / s
    const double s = centre(centre.size() - 1);
    centre = Eigen::VectorXd(centre.head(centre.size() - 1) / (s > 0 ? s : 1));
  }
  return result;
}

LocalBound local_bound(const files::Network& network, const Claim& claim, const Domain& domain,
                       const std::vector<double>& joint_t, const BranchOptions& given) {
  const std::vector<files::FunctionId> names = claim.function.parts();
  if (claim.neighbours.empty()) {
    const LocalBounds bounds(network, claim, joint_t);
    return claim.domain == "global" ? bounds.everywhere(given) : bounds.on(domain.at(names.front()), given);
  }
  LocalBound result;
  const files::Parts parts = files::parts(network);
  if (parts.at(names.front())->layers.size() < 2 || names.front().is_rho() ||
      parts.at(names.back())->layers.size() < 2)
    return result;
  BranchOptions options = given;
  LocalProof proof;
  Others others = others_of(network, claim, domain, options.nodes);
  proof.others = std::move(others.ranges);
  const check::LocalFunction f =
      check::coupled_function(network, claim.function, claim.block, claim.scale, others.least, others.most);
  std::vector<check::HiddenLayer> layers = f.hidden;
  layers.insert(layers.end(), f.behind.begin(), f.behind.end());
  ReachNetwork whole = reach_layers(layers);
  whole.push_back(reach_network(*parts.at(names.back())).back());
  const SetChain set = set_chain(local_chain(whole, {}, f.coordinates, f.weight), f.hidden.size());
  options.start = beginning(joint_t, set.whole);
  const Box& box = domain.at(names.front());
  prove(
      f, {{box.lower, box.upper}}, [&](const std::vector<Box>& roots) { return branch(set, roots, options); },
      std::move(proof), result);
  return result;
}

LocalBound local_bound(const files::Network& network, const Claim& claim, const Box& box,
                       const std::vector<double>& joint_t, const BranchOptions& options) {
  return local_bound(network, claim, {{claim.function.input_part(), box}}, joint_t, options);
}

}  // namespace swarmcert::lipschitz
