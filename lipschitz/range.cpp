#include "lipschitz/range.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "lipschitz/attained_values.h"
#include "lipschitz/convex_majorant.h"
#include "lipschitz/extremes.h"
#include "lipschitz/invariant_box.h"
#include "lipschitz/sum_climb.h"
#include "lipschitz/sum_support.h"
#include "lipschitz/value_bounds.h"
#include "nn/base/doubles.h"
#include "nn/base/parallel.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"
#include "nn/weights/invariants.h"

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
/// Parts of phi's box for its largest norm, at most.
constexpr int kMostParts = 20000;
/// Parts that linear forms over sums may halve, as shares of the boxes of a search: those above neurons of rho, those
/// that say where a form is about largest, and the one that is the bound.
struct FormShares {
  double neurons, hints, bound;
};
constexpr FormShares kShares{0.15, 0.025, 2};
/// Where such forms are but hints, since by_alike() bounds f more tightly.
constexpr FormShares kSharesOfHints{0.025, 0.01, 0.5};
/// What may be left of a form, as a share of how far its values are apart.
constexpr double kCloseForms = 0.002;

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
  constexpr double kNodes = 16000, kFewest = 600, kWeights = 8000;
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

/// How many neighbours there are, by network: "phi:<kind>".
using Composition = std::map<std::string, int>;

std::vector<std::string> parts_of(const Composition& neighbours) {
  std::vector<std::string> parts;
  for (const auto& [part, count] : neighbours)
    parts.insert(parts.end(), static_cast<std::size_t>(count), part);
  return parts;
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
        function_(function),
        parts_(files::parts(network)) {
    has_ground_ = names_.size() == 2 && parts_.count(files::kGroundPhi) == 1;
    if (names_.size() == 2) rho_ = reach_network(*parts_.at(names_[1]));
  }

  Index outputs() const { return parts_.at(names_.back())->outputs(); }
  double jump_norm() {
    return hull(term(names_[0]).network, domain_.at(names_[0]), std::min(8 * nodes_, kMostParts)).norm;
  }
  bool is_silent(const Composition& neighbours) const {
    return files::is_silent_among(network_, function_, parts_of(neighbours));
  }

  /// At least every value of sign * f_output among these neighbours, and no others; proposes points where it is
  /// attained. A plain network has none.
  double largest(int output, double sign, const Composition& neighbours,
                 std::vector<std::vector<VectorXd>>& candidates) {
    RowVectorXd direction = RowVectorXd::Zero(outputs());
    direction(output) = sign;
    if (names_.size() == 1) {
      const Maximum found =
          maximise(term(names_[0]).network, direction, domain_.at(names_[0]), search_of_boxes());
      propose({{names_[0], 1}}, direction, {{found.x}}, candidates);
      return found.upper;
    }
    const std::vector<std::pair<std::string, int>> terms = all_terms(neighbours);
    std::vector<std::vector<VectorXd>> starts;
    double upper = 0;
    if (!is_silent(neighbours)) {
      const bool is_one = parts_of(neighbours).size() == 1;
      upper = is_one ? beside_one(direction, neighbours, starts) : by_support(direction, neighbours, starts);
      if (is_alike(neighbours)) upper = std::min(upper, by_alike(direction, neighbours, starts));
    }
    if (starts.empty())
      candidates.push_back(middles(neighbours));
    else
      propose(terms, direction, starts, candidates);
    return upper;
  }

  /// @param candidates among neighbours of the function's own kind.
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
      one.value = sign > 0 ? round_down(exact) : 0 - round_down(-exact);
      if (!any || sign * one.value > sign * best.value) best = one;
      any = true;
    }
    return best;
  }

 private:
  /// A network whose outputs are added up.
  struct Term {
    ReachNetwork network;
    std::unique_ptr<PartTree> tree;
  };

  /// rho over the sums among some neighbours.
  struct Sums {
    SumSupport support;
    std::unique_ptr<const Reach> reach;
  };

  static double round_down(const mpq_class& exact) {
    double result = exact.get_d();  // truncates
    while (mpq_class(result) > exact) result = std::nextafter(result, -kInfinity);
    return result;
  }

  MaximiseOptions search_of_boxes() const { return {nodes_ + 2, kCloseEnough, jobs_}; }
  const FormShares& shares(const Composition& neighbours) const {
    return is_alike(neighbours) ? kSharesOfHints : kShares;
  }
  PartSearch search_of_forms(double share) const {
    return {static_cast<int>(nodes_ * share) + 1, kCloseForms, jobs_};
  }

  const Term& term(const std::string& part) {
    Term& term = terms_[part];
    if (!term.network.empty()) return term;
    term.network = reach_network(*parts_.at(part));
    term.tree = std::make_unique<PartTree>(term.network, domain_.at(part));
    return term;
  }

  /// The neighbours, and the ground's term where there is one.
  std::vector<std::pair<std::string, int>> all_terms(const Composition& neighbours) const {
    std::vector<std::pair<std::string, int>> all;
    for (const auto& [part, count] : neighbours)
      if (count > 0) all.emplace_back(part, count);
    if (has_ground_) all.emplace_back(files::kGroundPhi, 1);
    return all;
  }

  const Sums& sums(const Composition& neighbours) {
    Sums& sums = sums_[neighbours];
    if (!sums.reach) {
      for (const auto& [part, count] : all_terms(neighbours))
        sums.support.terms.push_back({term(part).tree.get(), count});
      sums.support.size = rho_.front().weights.cols();
      sums.support.search = search_of_forms(shares(neighbours).neurons);
      sums.reach = std::make_unique<const Reach>(rho_, box_of(sums.support.bounds()), sums.support);
    }
    return sums;
  }

  VectorXd middle(const std::string& part) const {
    const Box& box = domain_.at(part);
    VectorXd middle(static_cast<Index>(box.lower.size()));
    for (Index k = 0; k < middle.size(); ++k) {
      const auto i = static_cast<std::size_t>(k);
      middle(k) = (box.lower[i] + box.upper[i]) / 2;
    }
    return middle;
  }
  std::vector<VectorXd> middles(const Composition& neighbours) const {
    std::vector<VectorXd> points;
    for (const auto& [part, count] : all_terms(neighbours))
      points.insert(points.end(), static_cast<std::size_t>(count), middle(part));
    return points;
  }

  /// One neighbour and the ground, if there is one.
  double beside_one(const RowVectorXd& direction, const Composition& neighbour,
                    std::vector<std::vector<VectorXd>>& starts) {
    const std::string part = parts_of(neighbour).front();
    ReachNetwork chain = term(part).network;
    if (has_ground_) add_interval(chain.back(), sums({}).support.bounds());
    chain.insert(chain.end(), rho_.begin(), rho_.end());
    const Maximum found = maximise(chain, direction, domain_.at(part), search_of_boxes());
    starts.push_back({found.x});
    if (!has_ground_) return found.upper;
    starts.back().push_back(middle(files::kGroundPhi));
    return std::min(found.upper, by_support(direction, neighbour, starts));
  }

  /// Whether there are several neighbours, all of one kind.
  bool is_alike(const Composition& neighbours) const {
    return !has_ground_ && neighbours.size() == 1 && neighbours.begin()->second > 1;
  }

  /// Several neighbours of one kind: one neighbour of a network that is convex in the sum, tight where f is largest.
  double by_alike(const RowVectorXd& direction, const Composition& neighbours,
                  std::vector<std::vector<VectorXd>>& starts) {
    const auto& [part, count] = *neighbours.begin();
    const std::vector<PlacedTerm> terms = placed(all_terms(neighbours));
    std::vector<VectorXd> best = climb(terms, rho_, direction, starts);
    VectorXd sum = VectorXd::Zero(rho_.front().weights.cols());
    for (std::size_t k = 0; k < terms.size(); ++k)
      sum += terms[k].count * evaluate_roughly(*terms[k].network, best[k]);
    const ReachNetwork above =
        convex_majorant(term(part).network, domain_.at(part), count, rho_, direction, sum);
    const Maximum found = maximise(above, RowVectorXd::Ones(1), domain_.at(part), search_of_boxes());
    starts.push_back(best);
    best.front() = found.x;
    starts.push_back(std::move(best));
    return found.upper;
  }

  /// A linear form above rho over the sums, f <= c s + d, and the largest values of its terms.
  /// @param starts where the terms of forms above f are largest, one x per term.
  double by_support(const RowVectorXd& direction, const Composition& neighbours,
                    std::vector<std::vector<VectorXd>>& starts) {
    const Reach& reach = *sums(neighbours).reach;
    SumSupport support = sums(neighbours).support;
    if (support.terms.empty()) return reach.largest(reach.upper_forms(direction))(0);
    support.search = search_of_forms(shares(neighbours).hints);
    const LinearForms form = reach.sharpened_form(direction, [&](const LinearForms& one) -> VectorXd {
      starts.push_back(support.steepest(one.rows.row(0)));
      VectorXd sum = VectorXd::Zero(one.rows.cols());
      const auto all = all_terms(neighbours);
      for (std::size_t k = 0; k < all.size(); ++k)
        sum += all[k].second * evaluate_roughly(term(all[k].first).network, starts.back()[k]);
      return sum;
    });
    support.search = search_of_forms(shares(neighbours).bound);
    starts.push_back(support.steepest(form.rows.row(0)));
    return std::min(reach.largest(form)(0), support(form)(0));
  }

  std::vector<PlacedTerm> placed(const std::vector<std::pair<std::string, int>>& all) {
    std::vector<PlacedTerm> terms;
    for (const auto& [part, count] : all) terms.push_back({&term(part).network, &domain_.at(part), count});
    return terms;
  }

  /// Climbs from `starts`, all neighbours of a kind in one place.
  void propose(const std::vector<std::pair<std::string, int>>& all, const RowVectorXd& direction,
               const std::vector<std::vector<VectorXd>>& starts,
               std::vector<std::vector<VectorXd>>& candidates) {
    const std::vector<VectorXd> best = climb(placed(all), rho_, direction, starts);
    candidates.emplace_back();
    for (std::size_t k = 0; k < all.size(); ++k)
      candidates.back().insert(candidates.back().end(), static_cast<std::size_t>(all[k].second), best[k]);
  }

  const Network& network_;
  const std::map<std::string, Box>& domain_;
  std::vector<std::string> names_;
  int nodes_, jobs_;
  std::string function_;
  std::map<std::string, const files::Weights*> parts_;
  bool has_ground_ = false;
  ReachNetwork rho_;
  std::map<std::string, Term> terms_;
  std::map<Composition, Sums> sums_;
};

/// The ends of one output among some neighbours; the function is 0 throughout where it is silent.
struct Ends {
  double lower = 0, upper = 0;
  bool is_silent = false;
  double largest() const { return std::max(-lower, upper); }
};

/// Bounds of all outputs of one function, for 1, 2, ... neighbours.
class RangesOf {
 public:
  /// @param states where the inputs are; `domain`: what phi sees of them.
  RangesOf(const Network& network, const std::map<std::string, Box>& states,
           const std::map<std::string, Box>& domain, std::string function,
           const std::map<std::string, double>& rho_bound, const RangeOptions& options,
           std::function<void()> searched)
      : network_(network),
        states_(states),
        function_(std::move(function)),
        names_(files::networks_of(function_)),
        is_set_(names_.size() == 2),
        only_kind_(network.phi.size() == 1 + network.phi.count(files::kGroundKind)),
        neighbours_(options.neighbours),
        searched_(std::move(searched)),
        ranger_(network, domain, function_,
                options.nodes > 0 ? options.nodes : usual_nodes(network, function_), options.jobs) {
    if (!is_set_) return;
    jump_at_any_sum_ = up(ranger_.jump_norm() * rho_bound.at(files::kind_of(names_[1])));
    // Of one kind, all steps are seen one after the other.
    if (!only_kind_) beside_silent_ = steps_of(network, function_);
  }

  std::vector<CertifiedRange> all() {
    std::vector<CertifiedRange> found;
    for (int output = 0; output < ranger_.outputs(); ++output) add(output, found);
    return found;
  }

  /// Compositions in which values are bounded beside those of the function's own kind, for the jump.
  static std::vector<Composition> steps_of(const Network& network, const std::string& function) {
    std::vector<Composition> result;
    for (const std::vector<std::string>& parts : files::beside_silent(network, function)) {
      result.emplace_back();
      for (const std::string& part : parts) ++result.back()[part];
    }
    return result;
  }

 private:
  using Candidates = std::vector<std::vector<VectorXd>>;

  Ends ends(int output, const Composition& neighbours, Candidates& low, Candidates& high) {
    Ends found;
    found.is_silent = is_set_ && ranger_.is_silent(neighbours);
    found.upper = ranger_.largest(output, 1, neighbours, high);
    searched_();
    found.lower = 0 - ranger_.largest(output, -1, neighbours, low);  // 0, not -0, where it is silent
    searched_();
    return found;
  }

  /// |f - f'| where the second of two numbers of neighbours follows on the first.
  double step(const Ends& before, const Ends& after) const {
    if (before.is_silent && after.is_silent) return 0;
    const double between = std::max({0.0, up(after.upper - before.lower), up(before.upper - after.lower)});
    return before.is_silent || after.is_silent ? between : std::min(between, jump_at_any_sum_);
  }

  void add(int output, std::vector<CertifiedRange>& found) {
    Candidates high, low, unused;
    CertifiedRange range;
    range.function = function_;
    range.output = output;
    range.upper = -kInfinity;
    range.lower = kInfinity;
    if (is_set_ && !only_kind_) range.jump = jump_at_any_sum_;
    for (const Composition& beside : beside_silent_)
      range.jump = std::max(range.jump, ends(output, beside, unused, unused).largest());
    Ends before;
    for (int n = is_set_ ? 0 : 1; n <= (is_set_ ? neighbours_ : 1); ++n) {
      const Ends now = ends(output, is_set_ ? Composition{{names_[0], n}} : Composition(), low, high);
      range.upper = std::max(range.upper, now.upper);
      range.lower = std::min(range.lower, now.lower);
      if (n > 0 && only_kind_ && is_set_) range.jump = std::max(range.jump, step(before, now));
      before = now;
      if (is_set_ && n == 0) continue;
      range.neighbours_at_most = is_set_ ? n : 0;
      attain(output, n, low, high, range);
      found.push_back(range);
    }
  }

  /// Values of invariants are no rational numbers: they are enclosed, at states.
  void attain(int output, int neighbours, const Candidates& low, const Candidates& high,
              CertifiedRange& range) {
    if (files::maps_to_invariants(network_, function_)) {
      const std::vector<AttainedEnds> ends = attained_ends(network_, states_, function_, neighbours);
      range.least = ends[static_cast<std::size_t>(output)].least;
      range.greatest = ends[static_cast<std::size_t>(output)].greatest;
      return;
    }
    range.greatest = ranger_.attained(output, 1, high);
    range.least = ranger_.attained(output, -1, low);
  }

  const Network& network_;
  const std::map<std::string, Box>& states_;
  std::string function_;
  std::vector<std::string> names_;
  bool is_set_, only_kind_;
  int neighbours_;
  std::function<void()> searched_;
  Ranger ranger_;
  double jump_at_any_sum_ = 0;
  std::vector<Composition> beside_silent_;
};

/// Whether branch and bound on values can follow `function`, and with it the ground's term, and those of neighbours
/// beside which the network is silent.
bool is_of_relu(const Network& network, const std::string& function) {
  const auto is_relu = [&network](const std::string& kind) {
    const auto phi = network.phi.find(kind);
    return phi == network.phi.end() || phi->second.is_relu();
  };
  for (const std::vector<std::string>& parts : files::beside_silent(network, function))
    for (const std::string& part : parts)
      if (!is_relu(files::kind_of(part))) return false;
  return files::is_relu(network, function) && is_relu(files::kGroundKind);
}

/// What a certificate states of a function with other activations, and values that it takes.
std::vector<CertifiedRange> stated_ranges(const Network& network, const std::map<std::string, Box>& states,
                                          const std::map<std::string, Box>& domain,
                                          const std::string& function,
                                          const std::map<std::string, double>& rho_bound,
                                          const RangeOptions& options) {
  std::vector<CertifiedRange> result;
  for (const CertifiedValues& values :
       certified_values(network, domain, rho_bound, {options.neighbours, false, false, 0}, function)) {
    const std::vector<AttainedEnds> ends =
        attained_ends(network, states, function, std::max(1, values.neighbours));
    for (std::size_t i = 0; i < ends.size(); ++i) {
      CertifiedRange range;
      range.function = function;
      range.output = static_cast<int>(i);
      range.neighbours_at_most = values.neighbours;
      range.lower = values.lower[i];
      range.upper = values.upper[i];
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
  const std::map<std::string, Box> inner =
      clamped(network, network.invariants ? invariant_boxes(domain) : domain);
  const std::map<std::string, Box>& states = network.invariants ? domain : inner;
  // One function after the other: each search uses all threads.
  std::vector<CertifiedRange> result;
  int done = 0, total = 0;
  const std::vector<std::string> functions = value_functions(network);
  for (const std::string& function : functions) {
    if (!is_of_relu(network, function)) continue;
    const int outputs = files::parts(network).at(files::networks_of(function).back())->outputs();
    const int steps = static_cast<int>(RangesOf::steps_of(network, function).size());
    total += outputs * (files::is_set(function) ? 2 * (1 + options.neighbours + steps) : 2);
  }
  const auto searched = [&] {
    if (options.progress) options.progress(++done, total);
  };
  for (const std::string& function : functions) {
    const std::vector<CertifiedRange> found =
        is_of_relu(network, function)
            ? RangesOf(network, states, inner, function, rho_bound, options, searched).all()
            : stated_ranges(network, states, inner, function, rho_bound, options);
    result.insert(result.end(), found.begin(), found.end());
  }
  return result;
}

}  // namespace swarmcert::lipschitz
