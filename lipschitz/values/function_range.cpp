#include "lipschitz/values/function_range.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lipschitz/values/convex_majorant.h"
#include "nn/base/doubles.h"
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

const FormShares& shares(bool is_alike) { return is_alike ? kSharesOfHints : kShares; }

std::vector<files::FunctionId> parts_of(const Composition& neighbours) {
  std::vector<files::FunctionId> parts;
  for (const auto& [part, count] : neighbours)
    parts.insert(parts.end(), static_cast<std::size_t>(count), part);
  return parts;
}

double round_down(const mpq_class& exact) {
  double result = exact.get_d();  // truncates
  while (mpq_class(result) > exact) result = std::nextafter(result, -kInfinity);
  return result;
}

}  // namespace

FunctionRange::FunctionRange(const Network& network, const Domain& domain, const files::FunctionId& function,
                             int nodes, int jobs)
    : network_(network),
      domain_(domain),
      names_(function.parts()),
      nodes_(nodes),
      jobs_(jobs),
      function_(function),
      parts_(files::parts(network)) {
  has_ground_ = names_.size() == 2 && parts_.count(files::FunctionId::ground_phi()) == 1;
  if (names_.size() == 2) rho_ = reach_network(*parts_.at(names_[1]));
}

double FunctionRange::jump_norm() {
  return hull(term(names_[0]).network, domain_.at(names_[0]), std::min(8 * nodes_, kMostParts)).norm;
}

bool FunctionRange::is_silent(const Composition& neighbours) const {
  return files::is_silent_among(network_, function_, parts_of(neighbours));
}

double FunctionRange::largest(int output, double sign, const Composition& neighbours,
                              Candidates& candidates) {
  RowVectorXd direction = RowVectorXd::Zero(outputs());
  direction(output) = sign;
  if (names_.size() == 1) {
    const Maximum found =
        maximise(term(names_[0]).network, direction, domain_.at(names_[0]), search_of_boxes());
    propose({{names_[0], 1}}, direction, {{found.x}}, candidates);
    return found.upper;
  }
  const Terms terms = all_terms(neighbours);
  Candidates starts;
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

Attained FunctionRange::attained(int output, double sign, const Candidates& candidates) const {
  Attained best;
  bool any = false;
  for (const std::vector<VectorXd>& candidate : candidates) {
    Attained one;
    for (std::size_t j = 0; j < candidate.size(); ++j) {
      const bool is_ground = has_ground_ && j + 1 == candidate.size();
      one.networks.push_back(is_ground ? files::FunctionId::ground_phi() : names_[0]);
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

MaximiseOptions FunctionRange::search_of_boxes() const { return {nodes_ + 2, kCloseEnough, jobs_}; }

PartSearch FunctionRange::search_of_forms(double share) const {
  return {static_cast<int>(nodes_ * share) + 1, kCloseForms, jobs_};
}

const FunctionRange::Term& FunctionRange::term(const files::FunctionId& part) {
  Term& term = terms_[part];
  if (!term.network.empty()) return term;
  term.network = reach_network(*parts_.at(part));
  term.tree = std::make_unique<PartTree>(term.network, domain_.at(part));
  return term;
}

FunctionRange::Terms FunctionRange::all_terms(const Composition& neighbours) const {
  Terms all;
  for (const auto& [part, count] : neighbours)
    if (count > 0) all.emplace_back(part, count);
  if (has_ground_) all.emplace_back(files::FunctionId::ground_phi(), 1);
  return all;
}

const FunctionRange::Sums& FunctionRange::sums(const Composition& neighbours) {
  Sums& sums = sums_[neighbours];
  if (!sums.reach) {
    for (const auto& [part, count] : all_terms(neighbours))
      sums.support.terms.push_back({term(part).tree.get(), count});
    sums.support.size = rho_.front().weights.cols();
    sums.support.search = search_of_forms(shares(is_alike(neighbours)).neurons);
    sums.reach = std::make_unique<const Reach>(rho_, box_of(sums.support.bounds()), sums.support);
  }
  return sums;
}

VectorXd FunctionRange::middle(const files::FunctionId& part) const {
  const Box& box = domain_.at(part);
  VectorXd middle(static_cast<Index>(box.lower.size()));
  for (Index k = 0; k < middle.size(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    middle(k) = (box.lower[i] + box.upper[i]) / 2;
  }
  return middle;
}

std::vector<VectorXd> FunctionRange::middles(const Composition& neighbours) const {
  std::vector<VectorXd> points;
  for (const auto& [part, count] : all_terms(neighbours))
    points.insert(points.end(), static_cast<std::size_t>(count), middle(part));
  return points;
}

double FunctionRange::beside_one(const RowVectorXd& direction, const Composition& neighbour,
                                 Candidates& starts) {
  const files::FunctionId part = parts_of(neighbour).front();
  ReachNetwork chain = term(part).network;
  if (has_ground_) add_interval(chain.back(), sums({}).support.bounds());
  chain.insert(chain.end(), rho_.begin(), rho_.end());
  const Maximum found = maximise(chain, direction, domain_.at(part), search_of_boxes());
  starts.push_back({found.x});
  if (!has_ground_) return found.upper;
  starts.back().push_back(middle(files::FunctionId::ground_phi()));
  return std::min(found.upper, by_support(direction, neighbour, starts));
}

bool FunctionRange::is_alike(const Composition& neighbours) const {
  return !has_ground_ && neighbours.size() == 1 && neighbours.begin()->second > 1;
}

double FunctionRange::by_alike(const RowVectorXd& direction, const Composition& neighbours,
                               Candidates& starts) {
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

double FunctionRange::by_support(const RowVectorXd& direction, const Composition& neighbours,
                                 Candidates& starts) {
  const Reach& reach = *sums(neighbours).reach;
  SumSupport support = sums(neighbours).support;
  if (support.terms.empty()) return reach.largest(reach.upper_forms(direction))(0);
  support.search = search_of_forms(shares(is_alike(neighbours)).hints);
  const LinearForms form = reach.sharpened_form(direction, [&](const LinearForms& one) -> VectorXd {
    starts.push_back(support.steepest(one.rows.row(0)));
    VectorXd sum = VectorXd::Zero(one.rows.cols());
    const auto all = all_terms(neighbours);
    for (std::size_t k = 0; k < all.size(); ++k)
      sum += all[k].second * evaluate_roughly(term(all[k].first).network, starts.back()[k]);
    return sum;
  });
  support.search = search_of_forms(shares(is_alike(neighbours)).bound);
  starts.push_back(support.steepest(form.rows.row(0)));
  return std::min(reach.largest(form)(0), support(form)(0));
}

std::vector<PlacedTerm> FunctionRange::placed(const Terms& all) {
  std::vector<PlacedTerm> terms;
  for (const auto& [part, count] : all) terms.push_back({&term(part).network, &domain_.at(part), count});
  return terms;
}

void FunctionRange::propose(const Terms& all, const RowVectorXd& direction, const Candidates& starts,
                            Candidates& candidates) {
  const std::vector<VectorXd> best = climb(placed(all), rho_, direction, starts);
  candidates.emplace_back();
  for (std::size_t k = 0; k < all.size(); ++k)
    candidates.back().insert(candidates.back().end(), static_cast<std::size_t>(all[k].second), best[k]);
}

}  // namespace swarmcert::lipschitz
