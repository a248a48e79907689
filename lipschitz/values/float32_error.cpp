#include "lipschitz/values/float32_error.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>
#include <queue>
#include <stdexcept>

#include "lipschitz/checker/stages.h"
#include "lipschitz/upper/eclipse_fast.h"
#include "lipschitz/upper/sdp_bound.h"
#include "lipschitz/values/extremes.h"
#include "lipschitz/values/float32_layers.h"
#include "lipschitz/values/range.h"
#include "nn/base/doubles.h"
#include "nn/base/parallel.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using files::Network;

constexpr int kUsualRoundingNodes = 16000;
/// Number of parts halved at the same time; fixed, so that the result does not depend on the number of threads.
constexpr std::size_t kErrorPartsAtOnce = 8;

/// All sums here are of numbers that are not negative, with far fewer than 2^20 operations: their rounding in double is
/// below this relative amount.
double safely(double x) { return std::isnan(x) ? kInfinity : x * (1 + 0x1p-30) + 1e-300; }

double float_gamma(Index n) {
  const double nu = static_cast<double>(n) * kFloatUnit;
  return safely(nu / (1 - nu));
}

/// A proved bound of a chain: that of the semidefinite program, or layer by layer where it was stopped.
double chain_bound(const std::vector<check::Matrix>& chain, const Stop& stop) {
  const SdpBound program = sdp_bound(chain, {stop, std::nullopt});
  double bound = program.proof ? program.proof->upper.value() : kInfinity;
  if (!is_interrupted(program.stop)) return bound;
  const std::optional<UpperProof> layers = eclipse_fast(chain);
  return layers ? std::min(bound, layers->upper.value()) : bound;
}

/// Proved bounds of what follows each layer of a chain: tails[k] for an error in y_k, the last one 1. A chain that is
/// cut behind k starts with a ReLU, which is no steeper than 1.
std::vector<double> tails(const std::vector<check::Matrix>& chain, const Stop& stop) {
  std::vector<double> result;
  for (std::size_t k = 1; k < chain.size(); ++k) {
    result.push_back(chain_bound({chain.begin() + static_cast<std::ptrdiff_t>(k), chain.end()}, stop));
  }
  result.push_back(1);
  return result;
}

VectorXd exact_inputs(const ReachNetwork& network) { return VectorXd::Zero(network.front().weights.cols()); }

/// What the errors that the layers make come to behind everything that follows: for each layer the smaller of its
/// Lipschitz bound and of the local sensitivities times `slope`, a Lipschitz bound of what follows the chain.
double behind(const ReachNetwork& chain, const Reach& reach, const LayerErrors& errors,
              const std::vector<double>& tail, double slope) {
  const std::vector<Eigen::MatrixXd> local = sensitivities(chain, reach, errors);
  double total = 0;
  for (std::size_t k = 0; k < chain.size(); ++k) {
    const double everywhere = tail[k] * errors.made[k].norm();
    const double here = slope * (local[k] * errors.made[k]).norm();
    total += here < everywhere ? here : everywhere;
  }
  return safely(total);
}

/// Options of the search for the largest error over parts of the box.
struct ErrorPartSearch {
  int nodes;  ///< parts, at most
  int jobs;   ///< threads; the result does not depend on them
  Stop stop;
};

/// Returns the coordinate along which halving the box of the reach may change the outputs most; -1 if there is none.
Index dimension_to_halve(const ReachNetwork& chain, const Reach& reach) {
  VectorXd gain = reach.influence(Eigen::RowVectorXd::Ones(chain.back().weights.rows()));
  for (Index k = 0; k < gain.size(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    gain(k) *= reach.box().upper[i] - reach.box().lower[i];
  }
  Index widest = -1;
  return gain.maxCoeff(&widest) > 0 ? widest : -1;
}

/// Returns the largest value over the box of `cost`, a function of the bounds over a part of the box, by best-first
/// search with the number of parts given by `search`, or fewer if it is stopped.
template <class Cost>
double largest_over_parts(const ReachNetwork& chain, const Box& box, const ErrorPartSearch& search,
                          const Cost& cost) {
  struct Part {
    double cost = 0;
    std::shared_ptr<const Reach> reach;
    bool operator<(const Part& other) const { return cost < other.cost; }
  };
  const auto part_of = [&](const Box& piece, const Reach* around, double at_most) {
    auto reach = std::make_shared<const Reach>(chain, piece, around);
    return Part{std::min(at_most, cost(*reach)), std::move(reach)};
  };
  std::priority_queue<Part> queue;
  queue.push(part_of(box, nullptr, kInfinity));
  for (int done = 1; !search.stop.now();) {
    std::vector<Part> halved;
    std::vector<Box> pieces;
    while (!queue.empty() && halved.size() < kErrorPartsAtOnce &&
           done + 2 * static_cast<int>(halved.size() + 1) <= search.nodes) {
      const Index widest = dimension_to_halve(chain, *queue.top().reach);
      if (widest < 0) break;
      const auto [first, second] = halves(queue.top().reach->box(), widest);
      pieces.push_back(first);
      pieces.push_back(second);
      halved.push_back(queue.top());
      queue.pop();
    }
    if (halved.empty()) break;
    std::vector<Part> children(pieces.size());
    files::parallel_for(static_cast<int>(pieces.size()), search.jobs, [&](int index) {
      const auto i = static_cast<std::size_t>(index);
      children[i] = part_of(pieces[i], halved[i / 2].reach.get(), halved[i / 2].cost);
    });
    for (Part& child : children) queue.push(std::move(child));
    done += static_cast<int>(pieces.size());
  }
  return queue.top().cost;
}

Box inflated(const Box& box, const std::vector<double>& by) {
  Box result = box;
  for (std::size_t k = 0; k < by.size(); ++k) {
    result.lower[k] = down(box.lower[k] - by[k]);
    result.upper[k] = up(box.upper[k] + by[k]);
  }
  return result;
}

double norm(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return safely(std::sqrt(squares));
}

/// What a term of the sum contributes: its own error behind everything that follows, the error and size of its output.
struct TermError {
  double weighted = 0;
  VectorXd output;  ///< error, entry by entry
  Bounds values;    ///< exact output over the box
};

class SetError {
 public:
  SetError(const Network& network, const files::FunctionId& function, const Domain& domain, int nodes,
           int jobs, const Stop& stop)
      : names_(function.parts()), parts_(files::parts(network)), domain_(domain), search_{nodes, jobs, stop} {
    has_ground_ = names_.size() == 2 && !names_[0].is_ground_phi() &&
                  parts_.count(files::FunctionId::ground_phi()) == 1;
    phi_ = reach_network(*parts_.at(names_[0]));
    const std::vector<double> whole = tails(check::stages(network, function), stop);
    phi_tails_ = whole;
    if (names_.size() == 1) return;
    rho_ = reach_network(*parts_.at(names_[1]));
    const std::vector<check::Matrix> rho_stages = check::stages(network, names_[1]);
    rho_tails_ = tails(rho_stages, stop);
    rho_bound_ = chain_bound(rho_stages, stop);
    phi_tails_.resize(phi_.size() - 1);
    phi_tails_.push_back(rho_bound_);  // an error in phi's output goes through rho
    neighbour_ = term(phi_, names_[0], phi_tails_);
    if (!has_ground_) return;
    std::vector<double> ground_tails =
        tails(check::stages(network, files::FunctionId::set(files::kGroundKind, names_[1].kind())), stop);
    const ReachNetwork ground = reach_network(*parts_.at(files::FunctionId::ground_phi()));
    ground_tails.resize(ground.size() - 1);
    ground_tails.push_back(rho_bound_);
    ground_ = term(ground, files::FunctionId::ground_phi(), ground_tails);
  }

  double plain() const {
    return largest_over_parts(phi_, domain_.at(names_[0]), search_, [&](const Reach& reach) {
      return behind(phi_, reach, layer_errors(phi_, reach, exact_inputs(phi_)), phi_tails_, 1);
    });
  }

  /// With exactly `neighbours` neighbours.
  double set(int neighbours) const {
    double result = separate(neighbours);
    if (neighbours == 1 && !has_ground_) result = std::min(result, coupled());
    return result;
  }

 private:
  TermError term(const ReachNetwork& network, const files::FunctionId& part,
                 const std::vector<double>& tail) const {
    TermError result;
    const Box& box = domain_.at(part);
    result.values = hull(network, box, search_.nodes).bounds;
    result.weighted = largest_over_parts(network, box, search_, [&](const Reach& reach) {
      return behind(network, reach, layer_errors(network, reach, exact_inputs(network)), tail, rho_bound_);
    });
    result.output = layer_errors(network, Reach(network, box), exact_inputs(network)).total.back();
    return result;
  }

  /// Additions that round: the sum starts with the ground's term, or with zero, to which the first is added exactly.
  int additions(int neighbours) const { return std::max(0, neighbours - (has_ground_ ? 0 : 1)); }

  /// The terms one by one, then rho over the box of their sum.
  double separate(int neighbours) const {
    const Index hidden = rho_.front().weights.cols();
    double total = neighbours * neighbour_.weighted;
    VectorXd lower = VectorXd::Zero(hidden), upper = lower, magnitude = lower, error = lower;
    const auto add = [&](const TermError& one, double count) {
      lower += count * one.values.lower;
      upper += count * one.values.upper;
      magnitude += count * (one.values.magnitude() + one.output);
      error += count * one.output;
    };
    add(neighbour_, neighbours);
    if (has_ground_) {
      total += ground_.weighted;
      add(ground_, 1);
    }
    const VectorXd rounding = float_gamma(additions(neighbours)) * magnitude;
    total += rho_bound_ * rounding.norm();
    error += rounding;
    Box box;
    for (Index i = 0; i < hidden; ++i) {
      const double slack =
          1e-9 * (std::abs(lower(i)) + std::abs(upper(i))) + 1e-300;  // far above the rounding here
      box.lower.push_back(lower(i) - slack);
      box.upper.push_back(upper(i) + slack);
    }
    const Reach reach(rho_, box);
    total += behind(rho_, reach, layer_errors(rho_, reach, error), rho_tails_, 1);
    return safely(total);
  }

  /// One neighbour: phi and rho over the same part of the box.
  double coupled() const {
    ReachNetwork chain = phi_;
    chain.insert(chain.end(), rho_.begin(), rho_.end());
    std::vector<double> tail = phi_tails_;
    tail.insert(tail.end(), rho_tails_.begin(), rho_tails_.end());
    return largest_over_parts(chain, domain_.at(names_[0]), search_, [&](const Reach& reach) {
      return behind(chain, reach, layer_errors(chain, reach, exact_inputs(chain)), tail, 1);
    });
  }

  std::vector<files::FunctionId> names_;
  files::Parts parts_;
  const Domain& domain_;
  ErrorPartSearch search_;
  bool has_ground_ = false;
  ReachNetwork phi_, rho_;
  std::vector<double> phi_tails_, rho_tails_;
  double rho_bound_ = 0;
  TermError neighbour_, ground_;
};

}  // namespace

std::vector<double> input_errors(const Box& box, double step) {
  std::vector<double> result;
  for (std::size_t k = 0; k < box.lower.size(); ++k) {
    const double largest = std::max(std::abs(box.lower[k]), std::abs(box.upper[k]));
    result.push_back(safely(step / 2 + kFloatUnit * (largest + step) + 0x1p-149));
  }
  return result;
}

std::vector<Float32Error> float32_errors(const Network& network, const Domain& domain,
                                         const std::map<files::FunctionId, double>& lipschitz,
                                         const Float32Options& options) {
  for (const auto& [part, weights] : files::parts(network)) {
    if (weights->precision != files::Precision::kFloat32)
      throw std::invalid_argument("float32_errors: " + part.name() + " is not stored in float32");
  }
  const Domain inner = clamped(network, domain);
  std::map<files::FunctionId, double> moved;  // |q(x) - x| per part
  Domain inflated_domain;
  for (const auto& [part, box] : inner) {
    const std::vector<double> errors = input_errors(box, options.input_step);
    moved[part] = norm(errors);
    inflated_domain[part] = inflated(box, errors);
  }
  const std::vector<files::FunctionId> functions = value_functions(network);
  std::vector<std::vector<Float32Error>> found(functions.size());
  const int jobs = files::thread_count(options.jobs), functions_at_once = static_cast<int>(functions.size());
  const int jobs_each = std::max(1, jobs / std::max(1, functions_at_once));
  files::parallel_for(functions_at_once, jobs, [&](int index) {
    const files::FunctionId& function = functions[static_cast<std::size_t>(index)];
    const std::vector<files::FunctionId> names = function.parts();
    const int nodes = options.nodes > 0 ? options.nodes : usual_nodes(network, function, kUsualRoundingNodes);
    const SetError error(network, function, inflated_domain, nodes, jobs_each, options.stop);
    double evaluation = 0;
    for (int n = names.size() == 1 ? 1 : 0; n <= (names.size() == 1 ? 1 : options.neighbours); ++n) {
      evaluation = std::max(evaluation, names.size() == 1 ? error.plain() : error.set(n));
      if (n == 0) continue;
      double inputs = n * lipschitz.at(function) * moved.at(names[0]);
      if (names.size() == 2 && moved.count(files::FunctionId::ground_phi()) == 1) {
        const files::FunctionId ground = files::FunctionId::set(files::kGroundKind, names[1].kind());
        inputs += lipschitz.at(ground) * moved.at(files::FunctionId::ground_phi());
      }
      Float32Error one;
      one.function = function;
      one.neighbours_at_most = names.size() == 1 ? 0 : n;
      one.evaluation = UpperBound(evaluation);
      one.inputs = UpperBound(safely(inputs));
      one.total = UpperBound(safely(evaluation + inputs));
      found[static_cast<std::size_t>(index)].push_back(one);
    }
  });
  std::vector<Float32Error> result;
  for (auto& group : found) result.insert(result.end(), group.begin(), group.end());
  return result;
}

}  // namespace swarmcert::lipschitz
