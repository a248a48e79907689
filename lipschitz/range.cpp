#include "lipschitz/range.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "lipschitz/attained_values.h"
#include "lipschitz/extremes.h"
#include "lipschitz/sum_support.h"
#include "lipschitz/value_bounds.h"
#include "nn/base/doubles.h"
#include "nn/base/parallel.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using files::Network;

Box box_of(const Bounds& bounds) {
  return {{bounds.lower.begin(), bounds.lower.end()}, {bounds.upper.begin(), bounds.upper.end()}};
}

/// Searches end where the bound is this close to what was found, relatively.
constexpr double kCloseEnough = 0.01;
/// Parts of phi's box, at most; and the share of the boxes that a search over sums gets, which needs several.
constexpr int kMostParts = 2400, kShareOfSums = 4, kShareOfHints = 16;

/// Makes `layer` add anything within `bounds` to its output.
void add_interval(ReachLayer& layer, const Bounds& bounds) {
  for (Index i = 0; i < layer.bias.size(); ++i) {
    const double middle = layer.bias(i) + (bounds.lower(i) + bounds.upper(i)) / 2;
    const double half = (bounds.upper(i) - bounds.lower(i)) / 2;
    // Three roundings of numbers no larger than these, and one more for good measure.
    const double rounding =
        0x1p-50 * (std::abs(layer.bias(i)) + std::abs(bounds.lower(i)) + std::abs(bounds.upper(i)));
    layer.bias(i) = middle;
    layer.bias_radius(i) = up(half + rounding);
  }
}

/// Boxes per search where nobody says: a box costs about the square of the number of weights.
int usual_nodes(const Network& network, const std::string& function) {
  constexpr double kNodes = 8000, kFewest = 600, kWeights = 8000;
  double weights = 0;
  const auto parts = files::parts(network);
  for (const std::string& name : files::networks_of(function))
    for (const files::Layer& layer : parts.at(name)->layers) weights += layer.inputs * layer.outputs;
  return static_cast<int>(std::clamp(kNodes * std::pow(kWeights / weights, 2), kFewest, kNodes));
}

std::vector<float> float_point(const VectorXd& x, const Box& box) {
  std::vector<float> point;
  for (Index k = 0; k < x.size(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    auto value = static_cast<float>(x(k));
    if (static_cast<double>(value) < box.lower[i])
      value = std::nextafter(value, std::numeric_limits<float>::infinity());
    if (static_cast<double>(value) > box.upper[i])
      value = std::nextafter(value, -std::numeric_limits<float>::infinity());
    point.push_back(value);
  }
  return point;
}

bool within(const std::vector<float>& point, const Box& box) {
  for (std::size_t k = 0; k < point.size(); ++k)
    if (static_cast<double>(point[k]) < box.lower[k] || static_cast<double>(point[k]) > box.upper[k])
      return false;
  return true;
}

/// One function at work.
class Ranger {
 public:
  Ranger(const Network& network, const std::map<std::string, Box>& domain, const std::string& function,
         int nodes, int jobs)
      : network_(network),
        domain_(domain),
        names_(files::networks_of(function)),
        nodes_(nodes),
        jobs_(jobs),
        function_(function) {
    const auto parts = files::parts(network);
    has_ground_ = names_.size() == 2 && parts.count(files::kGroundPhi) == 1;
    first_ = reach_network(*parts.at(names_[0]));
    if (names_.size() == 1) return;
    rho_ = reach_network(*parts.at(names_[1]));
    const int most = std::min(8 * nodes, kMostParts);
    phi_hull_ = hull(first_, domain.at(names_[0]), most);
    if (!has_ground_) return;
    ground_network_ = reach_network(*parts.at(files::kGroundPhi));
    ground_hull_ = hull(ground_network_, domain.at(files::kGroundPhi), most);
  }

  Index outputs() const { return names_.size() == 1 ? first_.back().bias.size() : rho_.back().bias.size(); }
  double jump_norm() const { return phi_hull_.norm; }

  /// At least every value of sign * f_output with exactly `neighbours` neighbours; proposes points where it is
  /// attained.
  double largest(int output, double sign, int neighbours, std::vector<std::vector<VectorXd>>& candidates) {
    RowVectorXd direction = RowVectorXd::Zero(outputs());
    direction(output) = sign;
    if (names_.size() == 1) {
      const Maximum found = maximise(first_, direction, domain_.at(names_[0]), search(1));
      candidates.push_back({found.x});
      return found.upper;
    }
    if (neighbours != 1) return by_support(direction, neighbours, candidates);
    ReachNetwork chain = first_;
    if (has_ground_) add_interval(chain.back(), ground_hull_.bounds);
    chain.insert(chain.end(), rho_.begin(), rho_.end());
    const Maximum found = maximise(chain, direction, domain_.at(names_[0]), search(1));
    candidates.push_back(with_ground({found.x}, ground_middle()));
    if (!has_ground_) return found.upper;
    propose_ground(direction, found.x, candidates);
    return std::min(found.upper, by_support(direction, neighbours, candidates));
  }

  Attained attained(int output, double sign, const std::vector<std::vector<VectorXd>>& candidates) const {
    Attained best;
    bool any = false;
    for (const std::vector<VectorXd>& candidate : candidates) {
      Attained one;
      for (std::size_t j = 0; j < candidate.size(); ++j) {
        const bool is_ground = has_ground_ && j + 1 == candidate.size();
        one.networks.push_back(is_ground ? std::string(files::kGroundPhi) : names_[0]);
        one.points.push_back(float_point(candidate[j], domain_.at(one.networks.back())));
        if (!within(one.points.back(), domain_.at(one.networks.back())))
          return best;  // the box holds no float32
      }
      const mpq_class exact =
          value(network_, function_, one.networks, one.points)[static_cast<std::size_t>(output)];
      one.value = sign > 0 ? round_down(exact) : -round_down(-exact);
      if (!any || sign * one.value > sign * best.value) best = one;
      any = true;
    }
    return best;
  }

 private:
  /// rho over the sums with a number of neighbours.
  struct Sums {
    SumSupport support;
    std::unique_ptr<const Reach> reach;
  };

  static double round_down(const mpq_class& exact) {
    double result = exact.get_d();  // truncates
    while (mpq_class(result) > exact) result = std::nextafter(result, -kInfinity);
    return result;
  }

  MaximiseOptions search(int share) const { return {nodes_ / share + 2, kCloseEnough, jobs_}; }

  const Sums& sums(int neighbours) {
    Sums& sums = sums_[neighbours];
    if (!sums.reach) {
      sums.support = {&phi_hull_, neighbours, has_ground_ ? &ground_hull_ : nullptr, jobs_};
      sums.reach = std::make_unique<const Reach>(rho_, box_of(sums.support.bounds()), sums.support);
    }
    return sums;
  }

  VectorXd ground_middle() const {
    if (!has_ground_) return {};
    const Box& box = domain_.at(files::kGroundPhi);
    VectorXd middle(files::kGroundInputs);
    for (Index k = 0; k < middle.size(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      middle(k) = (box.lower[i] + box.upper[i]) / 2;
    }
    return middle;
  }
  std::vector<VectorXd> with_ground(std::vector<VectorXd> points, const VectorXd& ground) const {
    if (has_ground_) points.push_back(ground);
    return points;
  }

  /// The neighbour fixed at x: where should the ground's input be?
  void propose_ground(const RowVectorXd& direction, const VectorXd& x,
                      std::vector<std::vector<VectorXd>>& candidates) const {
    ReachNetwork chain = ground_network_;
    chain.back().bias += evaluate_roughly(first_, x);
    chain.insert(chain.end(), rho_.begin(), rho_.end());
    candidates.push_back(
        {x, maximise(chain, direction, domain_.at(files::kGroundPhi), search(kShareOfSums)).x});
  }

  /// phi and the ground where a form of their sum is largest: each for itself.
  struct Terms {
    std::optional<Maximum> phi, ground;
  };
  Terms largest_terms(const LinearForms& form, int neighbours, int share) const {
    Terms terms;
    const RowVectorXd row = form.rows.row(0);
    if (neighbours > 0) terms.phi = maximise(first_, row, domain_.at(names_[0]), search(share));
    if (has_ground_)
      terms.ground = maximise(ground_network_, row, domain_.at(files::kGroundPhi), search(share));
    return terms;
  }

  /// A linear form above rho over the sums, f <= c s + d, and the largest values of its terms.
  double by_support(const RowVectorXd& direction, int neighbours,
                    std::vector<std::vector<VectorXd>>& candidates) {
    const Reach& reach = *sums(neighbours).reach;
    if (neighbours == 0 && !has_ground_) {
      candidates.emplace_back();
      return reach.largest(reach.upper_forms(direction))(0);
    }
    const LinearForms form = reach.sharpened_form(direction, [&](const LinearForms& one) -> VectorXd {
      const Terms terms = largest_terms(one, neighbours, kShareOfHints);
      VectorXd sum = VectorXd::Zero(one.rows.cols());
      if (terms.phi) sum += neighbours * evaluate_roughly(first_, terms.phi->x);
      if (terms.ground) sum += evaluate_roughly(ground_network_, terms.ground->x);
      return sum;
    });
    const Terms terms = largest_terms(form, neighbours, kShareOfSums);
    double total = form.constants(0);
    std::vector<VectorXd> points;
    if (terms.phi) {
      total = sum_rounded_up(total, neighbours, terms.phi->upper);
      points.assign(static_cast<std::size_t>(neighbours), terms.phi->x);
    }
    if (terms.ground) {
      total = sum_rounded_up(total, 1, terms.ground->upper);
      points.push_back(terms.ground->x);
    }
    candidates.push_back(points);
    const double by_parts = reach.largest(form)(0);
    return std::isnan(total) ? by_parts : std::min(by_parts, total);
  }

  const Network& network_;
  const std::map<std::string, Box>& domain_;
  std::vector<std::string> names_;
  int nodes_, jobs_;
  std::string function_;
  bool has_ground_ = false;
  ReachNetwork first_, rho_, ground_network_;
  Hull phi_hull_, ground_hull_;
  std::map<int, Sums> sums_;
};

/// Bounds of all outputs of one function, for 1, 2, ... neighbours.
std::vector<CertifiedRange> ranges_of(const Network& network, const std::map<std::string, Box>& domain,
                                      const std::string& function,
                                      const std::map<std::string, double>& rho_bound,
                                      const RangeOptions& options, const std::function<void()>& searched) {
  std::vector<CertifiedRange> found;
  const bool is_set = function != "network";
  const bool only_kind = network.phi.size() == 1 + network.phi.count(files::kGroundKind);
  const int nodes = options.nodes > 0 ? options.nodes : usual_nodes(network, function);
  Ranger ranger(network, domain, function, nodes, options.jobs);
  for (int output = 0; output < ranger.outputs(); ++output) {
    std::vector<std::vector<VectorXd>> high, low;
    CertifiedRange range;
    range.function = function;
    range.output = output;
    range.upper = -kInfinity;
    range.lower = kInfinity;
    double jump_at_any_sum = 0, jump_between = 0, upper_before = 0, lower_before = 0;
    if (is_set)
      jump_at_any_sum =
          up(ranger.jump_norm() * rho_bound.at(files::kind_of(files::networks_of(function)[1])));
    for (int n = is_set ? 0 : 1; n <= (is_set ? options.neighbours : 1); ++n) {
      const double upper = ranger.largest(output, 1, n, high);
      searched();
      const double lower = -ranger.largest(output, -1, n, low);
      searched();
      range.upper = std::max(range.upper, upper);
      range.lower = std::min(range.lower, lower);
      if (n > 0) jump_between = std::max({jump_between, up(upper - lower_before), up(upper_before - lower)});
      upper_before = upper;
      lower_before = lower;
      if (is_set && n == 0) continue;
      range.neighbours_at_most = is_set ? n : 0;
      if (is_set) range.jump = only_kind ? std::min(jump_between, jump_at_any_sum) : jump_at_any_sum;
      range.greatest = ranger.attained(output, 1, high);
      range.least = ranger.attained(output, -1, low);
      found.push_back(range);
    }
  }
  return found;
}

/// Whether branch and bound on values can follow `function`, and the ground's term with it.
bool is_of_relu(const Network& network, const std::string& function) {
  const auto ground = network.phi.find(files::kGroundKind);
  return files::is_relu(network, function) && (ground == network.phi.end() || ground->second.is_relu());
}

/// What a certificate states of a function with other activations, and values that it takes.
std::vector<CertifiedRange> stated_ranges(const Network& network, const std::map<std::string, Box>& domain,
                                          const std::string& function,
                                          const std::map<std::string, double>& rho_bound,
                                          const RangeOptions& options) {
  std::vector<CertifiedRange> result;
  for (const CertifiedValues& values :
       certified_values(network, domain, rho_bound, {options.neighbours, false, false, 0}, function)) {
    const std::vector<AttainedEnds> ends =
        attained_ends(network, domain, function, std::max(1, values.neighbours));
    for (std::size_t i = 0; i < ends.size(); ++i) {
      CertifiedRange range;
      range.function = function;
      range.output = static_cast<int>(i);
      range.neighbours_at_most = values.neighbours;
      range.lower = values.output().lower[i];
      range.upper = values.output().upper[i];
      range.least = ends[i].least;
      range.greatest = ends[i].greatest;
      range.jump = values.jump.value_or(0);
      result.push_back(std::move(range));
    }
  }
  return result;
}

}  // namespace

std::map<std::string, Box> clamped(const Network& network, const std::map<std::string, Box>& domain) {
  std::map<std::string, Box> result = domain;
  if (!network.clamp) return result;
  for (auto& [part, box] : result) {
    if (!files::is_clamped(part)) continue;
    for (std::size_t k = 0; k < box.lower.size(); ++k) {
      box.lower[k] = std::clamp(box.lower[k], network.clamp->lower[k], network.clamp->upper[k]);
      box.upper[k] = std::clamp(box.upper[k], network.clamp->lower[k], network.clamp->upper[k]);
    }
  }
  return result;
}

std::map<std::string, Box> clamp_domain(const Network& network) {
  std::map<std::string, Box> result;
  if (!network.clamp || network.phi.count(files::kGroundKind) == 1) return result;
  for (const auto& [kind, phi] : network.phi)
    result[files::phi_name(kind)] = {network.clamp->lower, network.clamp->upper};
  if (network.plain) result["network"] = {network.clamp->lower, network.clamp->upper};
  return result;
}

std::vector<std::string> value_functions(const Network& network) {
  std::vector<std::string> functions;
  for (const std::string& function : files::functions(network)) {
    const bool is_set = files::is_set(function);
    if (function == "network" || (is_set && files::networks_of(function)[0] != files::kGroundPhi))
      functions.push_back(function);
  }
  return functions;
}

std::vector<CertifiedRange> ranges(const Network& network, const std::map<std::string, Box>& domain,
                                   const std::map<std::string, double>& rho_bound,
                                   const RangeOptions& options) {
  files::require_never_silent(network, "ranges are of networks that are silent nowhere");
  const std::map<std::string, Box> inner = clamped(network, domain);
  // One function after the other: each search uses all threads.
  std::vector<CertifiedRange> result;
  int done = 0, total = 0;
  const std::vector<std::string> functions = value_functions(network);
  for (const std::string& function : functions) {
    if (!is_of_relu(network, function)) continue;
    const int outputs = files::parts(network).at(files::networks_of(function).back())->outputs();
    total += outputs * (files::is_set(function) ? 2 * (1 + options.neighbours) : 2);
  }
  const auto searched = [&] {
    if (options.progress) options.progress(++done, total);
  };
  for (const std::string& function : functions) {
    const std::vector<CertifiedRange> found =
        is_of_relu(network, function) ? ranges_of(network, inner, function, rho_bound, options, searched)
                                      : stated_ranges(network, inner, function, rho_bound, options);
    result.insert(result.end(), found.begin(), found.end());
  }
  return result;
}

}  // namespace swarmcert::lipschitz
