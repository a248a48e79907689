#include "analysis/tracking/tube/force_difference.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"

namespace swarmcert::analysis {

namespace {

using Eigen::Index;
using Eigen::VectorXd;
using lipschitz::Box;

/// Relative allowance for round-off, far above the error of a few hundred operations on terms of equal magnitude.
constexpr double kRounding = 1e-12;

Box box_of(const std::vector<Interval>& states) {
  Box box;
  for (const Interval& x : states) box.lower.push_back(x.lower), box.upper.push_back(x.upper);
  return box;
}

template <class T>
bool by_bound(const std::shared_ptr<const T>& a, const std::shared_ptr<const T>& b) {
  return a->bound < b->bound;
}

}  // namespace

/// The linear form row x + constant.
struct ForceDifference::Form {
  VectorXd row;
  double constant = 0;

  /// Upper bound of the form over a box, including round-off.
  double largest(const Box& box) const {
    double value = constant;
    double size = std::abs(constant);
    for (Index k = 0; k < row.size(); ++k) {
      const double a = row(k) * box.lower[static_cast<std::size_t>(k)];
      const double b = row(k) * box.upper[static_cast<std::size_t>(k)];
      value += std::max(a, b);
      size += std::max(std::abs(a), std::abs(b));
    }
    const double result = value + kRounding * size;
    return std::isnan(result) ? kInfinity : result;
  }
};

struct ForceDifference::Part {
  Box box;
  Form above, below;  ///< f_hat - f_a <= above, f_a - f_hat <= below
  double bound = 0;   ///< bound on |f_hat - f_a| over the part
  double found = 0;   ///< an attained |f_hat - f_a| in the part: an estimate
  Index widest = 0;   ///< coordinate to bisect next
  LearnedForce::Forms learned;
};

/// The true wake over a part of the states. With a gradient it lies in at_centre_N + slope (x' - centre) -+ spread_N
/// for x' in the part, where x' is the state that the network received; the truth acts at x, which differs from x' by
/// what the network's age allows.
struct ForceDifference::WakeForm {
  TruthForce::Wake wake;
  Interval at_centre_N;
  VectorXd centre;  ///< of the part
  VectorXd slope;   ///< the middle of the gradient
  VectorXd bend;    ///< half the width of the gradient
  double spread_N = 0;
  double size_N = 0;  ///< magnitude of the terms, for the bound on their rounding
};

ForceDifference::WakeForm ForceDifference::wake_form(const Box& box) const {
  std::vector<Interval> states;
  VectorXd centre(static_cast<Index>(box.lower.size()));
  for (std::size_t k = 0; k < box.lower.size(); ++k) {
    states.emplace_back(box.lower[k], box.upper[k]);
    centre(static_cast<Index>(k)) = states[k].lower + (states[k].upper - states[k].lower) / 2;
  }
  const std::vector<Offset> reach = scene_->offsets(states, all_, true);
  const VectorXd zero = VectorXd::Zero(centre.size());
  WakeForm form{scene_->truth().wake(reach), scene_->truth().wake(offsets_at(centre)).value_N, centre, zero,
                zero};
  form.spread_N = form.wake.cut_off_N;
  form.size_N = form.at_centre_N.mag() + form.spread_N;
  if (!form.wake.has_gradient) return form;
  for (std::size_t n = 0; n < reach.size(); ++n) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index at = static_cast<Index>(n) * kPerNeighbour + static_cast<Index>(k);
      const Interval g = form.wake.gradient_N_m[n][k];
      const Interval& x = reach[n][k];
      const double slope = g.lower + (g.upper - g.lower) / 2;
      const double radius = up(std::max(g.upper - slope, slope - g.lower));
      const double away = up(std::max(x.upper - centre(at), centre(at) - x.lower));
      const double aged = up(std::max(x.upper - box.upper[static_cast<std::size_t>(at)],
                                      box.lower[static_cast<std::size_t>(at)] - x.lower));
      form.slope(at) = slope;
      form.bend(at) = radius;
      form.spread_N += radius * away + std::abs(slope) * aged;
      form.size_N += std::abs(slope * centre(at)) + radius * away;
    }
  }
  return form;
}

std::vector<Offset> ForceDifference::offsets_at(const VectorXd& x) const {
  std::vector<Offset> offsets(static_cast<std::size_t>(scene_->vehicles() - 1));
  for (std::size_t n = 0; n < offsets.size(); ++n) {
    for (std::size_t k = 0; k < 3; ++k)
      offsets[n][k] = x(static_cast<Index>(n) * kPerNeighbour + static_cast<Index>(k));
  }
  return offsets;
}

/// Upper bound of sign (f_hat - f_a) on the box, where sign f_hat <= row x' + constant: computed once with the slope
/// of the truth and once with its range; the smaller bound is used.
ForceDifference::Form ForceDifference::difference(const Box& box, const WakeForm& truth, const VectorXd& row,
                                                  double constant, double sign) const {
  const Interval wake_N = truth.wake.value_N;
  const double rest_least = sign > 0 ? -rest_N_.lower : rest_N_.upper;
  Form flat{row, constant + (sign > 0 ? -wake_N.lower : wake_N.upper) + rest_least};
  flat.constant += kRounding * (std::abs(constant) + wake_N.mag() + rest_N_.mag());
  if (!truth.wake.has_gradient) return flat;
  const double shift = truth.slope.dot(truth.centre);
  const double slack = truth.spread_N + kRounding * truth.size_N;
  Form sloped{row - sign * truth.slope, constant +
                                            (sign > 0 ? -truth.at_centre_N.lower : truth.at_centre_N.upper) +
                                            sign * shift + slack + rest_least};
  sloped.constant += kRounding * (std::abs(constant) + truth.size_N + rest_N_.mag());
  return sloped.largest(box) < flat.largest(box) ? sloped : flat;
}

/// |f_hat - f_a| with both forces evaluated at x: an estimate.
double ForceDifference::roughly(const VectorXd& x) const {
  const Interval f = scene_->truth().wake(offsets_at(x)).value_N + rest_N_;
  return std::abs(scene_->learned().roughly(x) - (f.lower + f.upper) / 2);
}

ForceDifference::Part ForceDifference::part(const Box& box, const LearnedForce::Forms* around) const {
  Part part;
  part.box = box;
  part.learned = scene_->learned().over(box, around);
  const LearnedForce::Forms& net = part.learned;
  const WakeForm truth = wake_form(box);
  part.above = difference(box, truth, net.upper_row, net.upper, 1);
  part.below = difference(box, truth, net.lower_row, net.lower, -1);
  const double above = part.above.largest(box);
  const double below = part.below.largest(box);
  part.bound = std::max(above, below);

  const Form& worse = above >= below ? part.above : part.below;
  VectorXd corner = truth.centre;
  double most = -1;
  for (Index k = 0; k < corner.size(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    corner(k) = worse.row(k) > 0 ? box.upper[at] : box.lower[at];
    const double width = box.upper[at] - box.lower[at];
    const double gain = width * (std::abs(net.upper_row(k)) + std::abs(net.lower_row(k)) +
                                 2 * std::abs(truth.slope(k)) + 2 * truth.bend(k));
    if (gain > most) most = gain, part.widest = k;
  }
  part.found = std::max({0.0, roughly(truth.centre), roughly(corner)});
  return part;
}

ForceDifference::ForceDifference(const Scene& scene, const Stretch& stretch, const Deviations& largest)
    : scene_(&scene),
      stretch_(&stretch),
      all_(scene.seen_states(stretch, largest)),
      rest_N_(scene.without_wakes_N(stretch, largest)[2]) {
  parts_.push_back(std::make_shared<const Part>(part(box_of(all_), nullptr)));
}

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
  for (auto& one : parts_) {  // the relaxations are no longer needed
    auto light = std::make_shared<Part>(*one);
    light->learned = {};
    one = std::move(light);
  }
}

Interval ForceDifference::over(const Deviations& deviations) const {
  const Box all = box_of(scene_->seen_states(*stretch_, deviations));
  double above = -kInfinity;
  double below = -kInfinity;
  for (const auto& part : parts_) {
    Box box = all;
    bool is_empty = false;
    for (std::size_t k = 0; k < box.lower.size(); ++k) {
      box.lower[k] = std::max(box.lower[k], part->box.lower[k]);
      box.upper[k] = std::min(box.upper[k], part->box.upper[k]);
      is_empty = is_empty || box.lower[k] > box.upper[k];
    }
    if (is_empty) continue;
    above = std::max(above, part->above.largest(box));
    below = std::max(below, part->below.largest(box));
  }
  return {-below, above};
}

}  // namespace swarmcert::analysis
