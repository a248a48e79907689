#include "lipschitz/branch/local_bound.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lipschitz/base/rounding.h"
#include "lipschitz/branch/search_tree.h"
#include "lipschitz/branch/slope_parts.h"
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
  if (!std::isfinite(found.tree.rho)) return;  // a part without multipliers remains
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

/// Returns how many boxes take about ten seconds: those of a program with many neurons cost the most.
int usual_boxes(Index neurons, Index inputs) {
  constexpr double kWork = 2e10, kFewest = 60, kMost = 20000;
  return static_cast<int>(
      std::clamp(kWork / std::pow(static_cast<double>(neurons + inputs), 3), kFewest, kMost));
}

/// What the searches of a claim without a number of neighbours start from.
struct Prepared {
  std::optional<RhoForm> form;
  check::LocalFunction f;
  LocalChain chain;
};

/// Returns nothing for functions that have no local bound.
std::optional<Prepared> prepared(const files::Network& network, const Claim& claim,
                                 const std::vector<double>& joint_t) {
  const std::vector<files::FunctionId> names = claim.function.parts();
  const files::Parts parts = files::parts(network);
  if (parts.at(names.front())->layers.size() < 2 || names.front().is_rho()) return std::nullopt;
  Prepared result;
  if (names.size() == 2) {
    const std::vector<check::Matrix> rho = check::stages(network, names.back());
    const std::size_t hidden = check::hidden_neurons(rho);
    if (rho.size() < 2 || joint_t.size() < hidden) return std::nullopt;
    result.form = rho_form(rho, {joint_t.end() - static_cast<std::ptrdiff_t>(hidden), joint_t.end()});
    if (!result.form) return std::nullopt;
  }
  const Eigen::MatrixXd q = result.form ? result.form->q : Eigen::MatrixXd();
  result.f = check::local_function(network, names.front(), claim.block, claim.scale, exact(q));
  result.chain =
      local_chain(reach_network(*parts.at(names.front())), q, result.f.coordinates, result.f.weight);
  return result;
}

/// Bounds the slope over the boxes. @param radius radius of the projective cover if `boxes` are one; else empty.
LocalBound bound_over(const Prepared& from, const check::LocalFunction& f, const LocalChain& chain,
                      const std::vector<check::Sides>& boxes, const std::vector<double>& radius,
                      BranchOptions options, const std::vector<double>& joint_t) {
  LocalBound result;
  options.start = beginning(joint_t, from.chain);
  if (options.nodes == 0) options.nodes = usual_boxes(chain.neurons(), chain.inputs());
  LocalProof proof;
  proof.form = from.form;
  proof.radius = radius;
  prove(
      f, boxes, [&](const std::vector<Box>& roots) { return branch(chain, roots, options); },
      std::move(proof), result);
  return result;
}

LocalBound bound_on(const Prepared& from, const Box& box, const BranchOptions& options,
                    const std::vector<double>& joint_t) {
  return bound_over(from, from.f, from.chain, {{box.lower, box.upper}}, {}, options, joint_t);
}

LocalBound bound_everywhere(const Prepared& from, double radius, const BranchOptions& options,
                            const std::vector<double>& joint_t) {
  const std::vector<double> radii(static_cast<std::size_t>(from.chain.inputs()), radius);
  LocalBound result = bound_over(from, check::homogeneous(from.f), homogeneous(from.chain),
                                 check::projective_cover(radii), radii, options, joint_t);
  for (Eigen::VectorXd& centre : result.steep_centres) {  // (u, s) represents the point u / s
    const double s = centre(centre.size() - 1);
    centre = Eigen::VectorXd(centre.head(centre.size() - 1) / (s > 0 ? s : 1));
  }
  return result;
}

/// Bounds a set function with a stated number of neighbours.
LocalBound bound_among(const files::Network& network, const Claim& claim, const Domain& domain,
                       const std::vector<double>& joint_t, BranchOptions options) {
  const std::vector<files::FunctionId> names = claim.function.parts();
  const files::Parts parts = files::parts(network);
  LocalBound result;
  if (parts.at(names.front())->layers.size() < 2 || names.front().is_rho() ||
      parts.at(names.back())->layers.size() < 2)
    return result;
  LocalProof proof;
  Others others = others_of(network, claim, domain, options.nodes > 0 ? options.nodes : kRangeNodes);
  proof.others = std::move(others.ranges);
  const check::LocalFunction f =
      check::coupled_function(network, claim.function, claim.block, claim.scale, others.least, others.most);
  std::vector<check::HiddenLayer> layers = f.hidden;
  layers.insert(layers.end(), f.behind.begin(), f.behind.end());
  ReachNetwork whole = reach_layers(layers);
  whole.push_back(reach_network(*parts.at(names.back())).back());
  const SetChain set = set_chain(local_chain(whole, {}, f.coordinates, f.weight), f.hidden.size());
  options.start = beginning(joint_t, set.whole);
  if (options.nodes == 0) options.nodes = usual_boxes(set.whole.neurons(), set.whole.inputs());
  const Box& box = domain.at(names.front());
  prove(
      f, {{box.lower, box.upper}}, [&](const std::vector<Box>& roots) { return branch(set, roots, options); },
      std::move(proof), result);
  return result;
}

}  // namespace

LocalBound local_bound(const files::Network& network, const Claim& claim, const Domain& domain,
                       const std::vector<double>& joint_t, const BranchOptions& options) {
  if (!claim.neighbours.empty()) return bound_among(network, claim, domain, joint_t, options);
  const files::FunctionId part = claim.function.input_part();
  if (!files::is_relu(network, claim.function))
    return claim.domain == "global" ? LocalBound() : slope_parts(network, claim, domain.at(part), options);
  const std::optional<Prepared> from = prepared(network, claim, joint_t);
  if (!from) return {};
  if (claim.domain != "global") return bound_on(*from, domain.at(part), options, joint_t);
  return bound_everywhere(*from, cover_radius(files::parts(network).at(part)->layers.front()), options,
                          joint_t);
}

LocalBound local_bound(const files::Network& network, const Claim& claim, const Box& box,
                       const std::vector<double>& joint_t, const BranchOptions& options) {
  return local_bound(network, claim, {{claim.function.input_part(), box}}, joint_t, options);
}

}  // namespace swarmcert::lipschitz
