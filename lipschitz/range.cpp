#include "lipschitz/range.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nn/base/doubles.h"
#include "nn/base/parallel.h"
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

/// [a] + [b], rounded outwards.
Bounds sum(const Bounds& a, const Bounds& b) {
  Bounds result{a.lower + b.lower, a.upper + b.upper};
  for (double& x : result.lower) x = next_down(x);
  for (double& x : result.upper) x = next_up(x);
  return result;
}

/// Makes `layer` add anything within `bounds` to its output.
void add_interval(ReachLayer& layer, const Bounds& bounds) {
  for (Index i = 0; i < layer.bias.size(); ++i) {
    const double middle = layer.bias(i) + (bounds.lower(i) + bounds.upper(i)) / 2;
    const double half = (bounds.upper(i) - bounds.lower(i)) / 2;
    // Three roundings of numbers no larger than these, and one more for good measure.
    const double rounding =
        0x1p-50 * (std::abs(layer.bias(i)) + std::abs(bounds.lower(i)) + std::abs(bounds.upper(i)));
    layer.bias(i) = middle;
    layer.bias_radius(i) = next_up(half + rounding);
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

/// One function at work.
class Ranger {
 public:
  Ranger(const Network& network, const std::map<std::string, Box>& domain, const std::string& function,
         int nodes)
      : network_(network),
        domain_(domain),
        names_(files::networks_of(function)),
        nodes_(nodes),
        function_(function) {
    const auto parts = files::parts(network);
    has_ground_ = names_.size() == 2 && parts.count(files::kGroundPhi) == 1;
    first_ = reach_network(*parts.at(names_[0]));
    if (names_.size() == 1) return;
    rho_ = reach_network(*parts.at(names_[1]));
    phi_hull_ = hull(first_, domain.at(names_[0]), 8 * nodes);
    const Index hidden = first_.back().bias.size();
    ground_ = {VectorXd::Zero(hidden), VectorXd::Zero(hidden)};
    if (!has_ground_) return;
    ground_network_ = reach_network(*parts.at(files::kGroundPhi));
    ground_ = hull(ground_network_, domain.at(files::kGroundPhi), 8 * nodes).bounds;
  }

  Index outputs() const { return names_.size() == 1 ? first_.back().bias.size() : rho_.back().bias.size(); }
  double jump_norm() const { return phi_hull_.norm; }

  /// At least every value of sign * f_output with exactly `neighbours` neighbours; proposes points where it is
  /// attained.
  double largest(int output, double sign, int neighbours,
                 std::vector<std::vector<VectorXd>>& candidates) const {
    RowVectorXd direction = RowVectorXd::Zero(outputs());
    direction(output) = sign;
    if (names_.size() == 1) {
      const Maximum found = maximise(first_, direction, domain_.at(names_[0]), nodes_);
      candidates.push_back({found.x});
      return found.upper;
    }
    if (neighbours == 1) {
      ReachNetwork chain = first_;
      add_interval(chain.back(), ground_);
      chain.insert(chain.end(), rho_.begin(), rho_.end());
      const Maximum found = maximise(chain, direction, domain_.at(names_[0]), nodes_);
      candidates.push_back(with_ground({found.x}, ground_middle()));
      if (has_ground_) propose_ground(direction, found.x, candidates);
      return std::min(found.upper, by_support(direction, neighbours, candidates));
    }
    return by_support(direction, neighbours, candidates);
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
  static double round_down(const mpq_class& exact) {
    double result = exact.get_d();  // truncates
    while (mpq_class(result) > exact) result = std::nextafter(result, -kInfinity);
    return result;
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
    candidates.push_back({x, maximise(chain, direction, domain_.at(files::kGroundPhi), nodes_ / 4 + 2).x});
  }

  double by_support(const RowVectorXd& direction, int neighbours,
                    std::vector<std::vector<VectorXd>>& candidates) const {
    Bounds s = ground_;
    for (int j = 0; j < neighbours; ++j) s = sum(s, phi_hull_.bounds);
    const Reach reach(rho_, box_of(s));
    const LinearForms form = reach.upper_forms(direction);
    const double from_box = reach.largest(form)(0);
    if (neighbours == 0 && !has_ground_) {
      candidates.emplace_back();
      return from_box;
    }
    double total = form.constants(0);
    std::vector<VectorXd> points;
    if (neighbours > 0) {
      const Maximum phi = maximise(first_, form.rows.row(0), domain_.at(names_[0]), nodes_);
      // A sum of n equal terms, rounded at most n times.
      total += neighbours * phi.upper + 0x1p-50 * neighbours * std::abs(neighbours * phi.upper);
      points.assign(static_cast<std::size_t>(neighbours), phi.x);
    }
    if (has_ground_) {
      const Maximum ground =
          maximise(ground_network_, form.rows.row(0), domain_.at(files::kGroundPhi), nodes_);
      total += ground.upper;
      points.push_back(ground.x);
    }
    candidates.push_back(points);
    // Each addition above is off by at most half a unit of a partial sum: covered by 2^-50 of the terms.
    const double with_support =
        next_up(total + 0x1p-50 * (std::abs(total) + std::abs(form.constants(0))) + 1e-300);
    return std::isnan(with_support) ? from_box : std::min(from_box, with_support);
  }

  const Network& network_;
  const std::map<std::string, Box>& domain_;
  std::vector<std::string> names_;
  int nodes_;
  std::string function_;
  bool has_ground_ = false;
  ReachNetwork first_, rho_, ground_network_;
  Hull phi_hull_;
  Bounds ground_;
};

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

std::vector<CertifiedRange> ranges(const Network& network, const std::map<std::string, Box>& domain,
                                   const std::map<std::string, double>& rho_bound,
                                   const RangeOptions& options) {
  const std::map<std::string, Box> inner = clamped(network, domain);
  std::vector<std::string> functions;
  for (const std::string& function : files::functions(network)) {
    const bool is_set = files::is_set(function);
    if (function == "network" || (is_set && files::networks_of(function)[0] != files::kGroundPhi))
      functions.push_back(function);
  }
  std::vector<std::vector<CertifiedRange>> found(functions.size());
  files::parallel_for(static_cast<int>(functions.size()), options.jobs, [&](int index) {
    const std::string& function = functions[static_cast<std::size_t>(index)];
    const bool is_set = function != "network";
    const Ranger ranger(network, inner, function, options.nodes);
    for (int output = 0; output < ranger.outputs(); ++output) {
      std::vector<std::vector<VectorXd>> high, low;
      CertifiedRange range;
      range.function = function;
      range.output = output;
      range.upper = -kInfinity;
      range.lower = kInfinity;
      if (is_set) {
        const std::string rho = files::kind_of(files::networks_of(function)[1]);
        range.jump = next_up(ranger.jump_norm() * rho_bound.at(rho));
      }
      for (int n = is_set ? 0 : 1; n <= (is_set ? options.neighbours : 1); ++n) {
        range.upper = std::max(range.upper, ranger.largest(output, 1, n, high));
        range.lower = std::min(range.lower, -ranger.largest(output, -1, n, low));
        if (is_set && n == 0) continue;
        range.neighbours_at_most = is_set ? n : 0;
        range.greatest = ranger.attained(output, 1, high);
        range.least = ranger.attained(output, -1, low);
        found[static_cast<std::size_t>(index)].push_back(range);
      }
    }
  });
  std::vector<CertifiedRange> result;
  for (auto& group : found) result.insert(result.end(), group.begin(), group.end());
  return result;
}

}  // namespace swarmcert::lipschitz
