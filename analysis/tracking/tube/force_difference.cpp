#include "analysis/tracking/tube/force_difference.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmcert::analysis {

using stability::up;

namespace {

using Eigen::Index;
using Eigen::VectorXd;
using lipschitz::Box;

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
/// Far above what a few hundred roundings of terms of one size can cost, relative to that size.
constexpr double kRounding = 1e-12;

Box box_of(const std::vector<Interval>& states) {
  Box box;
  for (const Interval& x : states) box.lower.push_back(x.lo), box.upper.push_back(x.hi);
  return box;
}

template <class T>
bool by_bound(const std::shared_ptr<const T>& a, const std::shared_ptr<const T>& b) {
  return a->bound < b->bound;
}

}  // namespace

/// row x + constant
struct ForceDifference::Form {
  VectorXd row;
  double constant = 0;

  /// At least its largest value over a box, rounding included.
  double largest(const double* lower, const double* upper) const {
    double value = constant;
    double size = std::abs(constant);
    for (Index k = 0; k < row.size(); ++k) {
      const double a = row(k) * lower[k];
      const double b = row(k) * upper[k];
      value += std::max(a, b);
      size += std::max(std::abs(a), std::abs(b));
    }
    const double result = value + kRounding * size;
    return std::isnan(result) ? kUnbounded : result;
  }
};

struct ForceDifference::Part {
  Box box;
  Form above, below;  ///< f_hat - f_a <= above, f_a - f_hat <= below
  double bound = 0;   ///< of |f_hat - f_a| on the part
  double found = 0;   ///< |f_hat - f_a| somewhere in it: an estimate
  Index widest = 0;   ///< coordinate to halve next
  LearnedForce::Forms learned;
};

ForceDifference::Part ForceDifference::part(const Box& box, const LearnedForce::Forms* around) const {
  const int neighbours = scene_->vehicles() - 1;
  Part part;
  part.box = box;
  part.learned = scene_->learned().over(box, around);
  const LearnedForce::Forms& net = part.learned;

  // x' is what the network saw, in `box`; the truth acts at x, which is x' up to what the network's age allows.
  std::vector<Interval> states;
  for (std::size_t k = 0; k < box.lower.size(); ++k) states.emplace_back(box.lower[k], box.upper[k]);
  const std::vector<Offset> reach = scene_->offsets(states, all_);
  const TruthForce::Wake wake = scene_->truth().wake(reach);
  std::vector<Offset> middle(static_cast<std::size_t>(neighbours));
  VectorXd centre(static_cast<Index>(states.size()));
  for (std::size_t k = 0; k < states.size(); ++k)
    centre(static_cast<Index>(k)) = states[k].lo + (states[k].hi - states[k].lo) / 2;
  for (int n = 0; n < neighbours; ++n) {
    for (std::size_t k = 0; k < 3; ++k)
      middle[static_cast<std::size_t>(n)][k] = centre(n * kPerNeighbour + static_cast<Index>(k));
  }
  const Interval at_centre = scene_->truth().wake(middle).value_N;

  // f_a = wake + rest; wake in at_centre + slope (x' - centre) -+ spread, where the slope is the gradient's middle.
  VectorXd slope = VectorXd::Zero(centre.size());
  double spread = wake.cut_off_N;
  double size = at_centre.mag() + spread;
  VectorXd bend = VectorXd::Zero(centre.size());
  for (int n = 0; n < neighbours && wake.has_gradient; ++n) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index at = n * kPerNeighbour + static_cast<Index>(k);
      const Interval g = wake.gradient_N_m[static_cast<std::size_t>(n)][k];
      const Interval& x = reach[static_cast<std::size_t>(n)][k];
      slope(at) = g.lo + (g.hi - g.lo) / 2;
      const double radius = up(std::max(g.hi - slope(at), slope(at) - g.lo));
      const double away = up(std::max(x.hi - centre(at), centre(at) - x.lo));
      const double aged = up(std::max(x.hi - box.upper[static_cast<std::size_t>(at)],
                                      box.lower[static_cast<std::size_t>(at)] - x.lo));
      bend(at) = radius;
      spread += radius * away + std::abs(slope(at)) * aged;
      size += std::abs(slope(at) * centre(at)) + radius * away;
    }
  }
  const double shift = slope.dot(centre);
  const double slack = spread + kRounding * size;
  const auto difference = [&](const VectorXd& row, double constant, double sign) {
    // sign (f_hat - f_a): once with the truth's slope, once with its range; the smaller counts.
    const Interval rest_N = rest_.force_N[2];
    const double rest_least = sign > 0 ? -rest_N.lo : rest_N.hi;
    Form flat{row, constant + (sign > 0 ? -wake.value_N.lo : wake.value_N.hi) + rest_least};
    flat.constant += kRounding * (std::abs(constant) + wake.value_N.mag() + rest_N.mag());
    if (!wake.has_gradient) return flat;
    Form sloped{row - sign * slope,
                constant + (sign > 0 ? -at_centre.lo : at_centre.hi) + sign * shift + slack + rest_least};
    sloped.constant += kRounding * (std::abs(constant) + size + rest_N.mag());
    return sloped.largest(box.lower.data(), box.upper.data()) <
                   flat.largest(box.lower.data(), box.upper.data())
               ? sloped
               : flat;
  };
  part.above = difference(net.upper_row, net.upper, 1);
  part.below = difference(net.lower_row, net.lower, -1);
  const double above = part.above.largest(box.lower.data(), box.upper.data());
  const double below = part.below.largest(box.lower.data(), box.upper.data());
  part.bound = std::max(above, below);

  // A value of the difference: in the middle, and at the corner where the form is largest.
  const Form& worse = above >= below ? part.above : part.below;
  VectorXd corner = centre;
  for (Index k = 0; k < corner.size(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    corner(k) = worse.row(k) > 0 ? box.upper[at] : box.lower[at];
  }
  const Interval rest_N = rest_.force_N[2];
  for (const VectorXd& x : {centre, corner}) {
    std::vector<Offset> there(static_cast<std::size_t>(neighbours));
    for (int n = 0; n < neighbours; ++n)
      for (std::size_t k = 0; k < 3; ++k)
        there[static_cast<std::size_t>(n)][k] = x(n * kPerNeighbour + static_cast<Index>(k));
    const Interval f = scene_->truth().wake(there).value_N + rest_N;
    part.found = std::max(part.found, std::abs(scene_->learned().roughly(x) - (f.lo + f.hi) / 2));
  }
  double most = -1;
  for (Index k = 0; k < centre.size(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double width = box.upper[at] - box.lower[at];
    const double gain = width * (std::abs(net.upper_row(k)) + std::abs(net.lower_row(k)) +
                                 2 * std::abs(slope(k)) + 2 * bend(k));
    if (gain > most) most = gain, part.widest = k;
  }
  return part;
}

ForceDifference::ForceDifference(const Scene& scene, const Stretch& stretch, const Deviations& largest)
    : scene_(&scene),
      stretch_(&stretch),
      all_(scene.states(stretch, largest)),
      rest_(scene.rest(stretch, largest, 0)) {
  parts_.push_back(std::make_shared<const Part>(part(box_of(all_), nullptr)));
}

double ForceDifference::bound_N() const { return parts_.front()->bound; }

void ForceDifference::refine(int boxes, double tolerance_N, const std::atomic<bool>* cancelled) {
  double found = parts_.front()->found;
  while (static_cast<int>(parts_.size()) < boxes && (cancelled == nullptr || !*cancelled)) {
    std::pop_heap(parts_.begin(), parts_.end(), by_bound<Part>);
    const std::shared_ptr<const Part> top = parts_.back();
    const auto k = static_cast<std::size_t>(top->widest);
    const bool can_halve = top->box.upper[k] > top->box.lower[k];
    if (!can_halve || !(top->bound > found + tolerance_N)) break;
    parts_.pop_back();
    const auto [first, second] = lipschitz::halves(top->box, top->widest);
    for (const Box& half : {first, second}) {
      parts_.push_back(std::make_shared<const Part>(part(half, &top->learned)));
      found = std::max(found, parts_.back()->found);
      std::push_heap(parts_.begin(), parts_.end(), by_bound<Part>);
    }
  }
  for (auto& one : parts_) {  // the relaxations are not needed any more
    auto light = std::make_shared<Part>(*one);
    light->learned = {};
    one = std::move(light);
  }
}

Interval ForceDifference::over(const Deviations& deviations) const {
  const Box all = box_of(scene_->states(*stretch_, deviations));
  double above = -kUnbounded;
  double below = -kUnbounded;
  for (const auto& part : parts_) {
    Box box = all;
    bool is_empty = false;
    for (std::size_t k = 0; k < box.lower.size(); ++k) {
      box.lower[k] = std::max(box.lower[k], part->box.lower[k]);
      box.upper[k] = std::min(box.upper[k], part->box.upper[k]);
      is_empty = is_empty || box.lower[k] > box.upper[k];
    }
    if (is_empty) continue;
    above = std::max(above, part->above.largest(box.lower.data(), box.upper.data()));
    below = std::max(below, part->below.largest(box.lower.data(), box.upper.data()));
  }
  return {-below, above};
}

}  // namespace swarmcert::analysis
