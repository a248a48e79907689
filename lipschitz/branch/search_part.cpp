#include <algorithm>
#include <cmath>
#include <iterator>

#include "lipschitz/branch/search.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A neuron counts as decided only with this relative margin, so that the checker decides it too despite its round-off.
constexpr double kStateMargin = 1e-9;

}  // namespace

void BranchSearch::look_at_centre(const Box& box) {
  VectorXd centre(chain_.inputs());
  for (Index j = 0; j < centre.size(); ++j) {
    const auto k = static_cast<std::size_t>(j);
    centre(j) = box.lower[k] + (box.upper[k] - box.lower[k]) / 2;
  }
  steep_.emplace(squared_slope(centre), centre);
  if (steep_.size() > kSteepCentres) steep_.erase(std::prev(steep_.end()));
}

BranchSearch::Part BranchSearch::part(const Box& box, const Part* parent) const {
  Part part;
  std::vector<MatrixXd> slopes;
  std::vector<LinearForms> forms;
  if (parent != nullptr) part.around = parent->reach;
  const bool has_pairs = parent != nullptr && parent->multipliers && !parent->multipliers->pairs.empty();
  part.reach = std::make_shared<const Reach>(chain_.hidden, box, part.around.get(), &slopes,
                                             has_pairs ? &forms : nullptr,
                                             options_.better_slopes ? &part.decided : nullptr);
  part.states = states_of(*part.reach, chain_, 0);
  part.undecided = undecided_in(part.states);
  if (parent != nullptr) {
    part.rho = parent->rho;
    part.multipliers = parent->multipliers;
    part.undecided_then = parent->undecided_then;
    part.form = parent->form;
    part.undecided_form = parent->undecided_form;
    part.in_vain = part.states == parent->states ? parent->in_vain + 1 : 0;
    std::vector<std::size_t> pairs;
    if (has_pairs) pairs = still_shown(part, NeuronForms(forms, box));
    const bool all_pairs = !has_pairs || pairs.size() == part.multipliers->pairs.size();
    if (part.multipliers && (part.states != parent->states || !all_pairs)) {
      NodeInequality inequality(slope_layers(chain_, part.states), gram_of(part));
      const double rho = inequality.least_rho(inherited(part, pairs, inequality));
      const bool is_worse = !all_pairs && !(rho <= part.rho);  // because a pair is missing
      part.rho = is_worse ? rho : std::min(part.rho, rho);
      if (is_worse) solve(part);
    }
  }
  part.split = best_split(*part.reach, slopes, part.states);
  return part;
}

std::vector<NeuronState> BranchSearch::states_of(const Reach& reach, const LocalChain& chain,
                                                 std::size_t first) {
  std::vector<NeuronState> states;
  for (std::size_t k = 0; k < chain.hidden.size(); ++k) {
    const Bounds& bounds = reach.before_relu(first + k);
    for (Index i = 0; i < bounds.lower.size(); ++i) {
      const double margin = kStateMargin * std::max(std::abs(bounds.lower(i)), std::abs(bounds.upper(i)));
      const bool has_relu = i < bounds.lower.size() - chain.without_relu[k];
      states.push_back(!has_relu || bounds.lower(i) > margin ? NeuronState::kOn
                       : bounds.upper(i) < -margin           ? NeuronState::kOff
                                                             : NeuronState::kUndecided);
    }
  }
  return states;
}

int BranchSearch::best_split(const Reach& reach, const std::vector<MatrixXd>& slopes,
                             const std::vector<NeuronState>& states) const {
  const Box& box = reach.box();
  VectorXd width(chain_.inputs());
  for (Index j = 0; j < width.size(); ++j) {
    const auto k = static_cast<std::size_t>(j);
    width(j) = box.upper[k] - box.lower[k];
  }
  VectorXd score = VectorXd::Zero(chain_.inputs());
  std::size_t neuron = 0;
  for (std::size_t k = 0; k < slopes.size(); ++k) {
    const VectorXd range = reach.before_relu(k).upper - reach.before_relu(k).lower;
    for (Index i = 0; i < range.size(); ++i, ++neuron) {
      if (states[neuron] != NeuronState::kUndecided || !(range(i) > 0)) continue;
      score += (slopes[k].row(i).transpose().cwiseProduct(width) / range(i)).cwiseAbs2();
    }
  }
  Index best = 0, widest = 0;
  for (Index j = 0; j < score.size(); ++j) {
    const auto relative = [&](Index coordinate) {
      return relative_width(box, static_cast<std::size_t>(coordinate));
    };
    if (relative(j) <= kThin) score(j) = -1;
    if (score(j) > score(best)) best = j;
    if (relative(j) > relative(widest)) widest = j;
  }
  return static_cast<int>(score(best) > 0 ? best : widest);
}

double BranchSearch::relative_width(const Box& box, std::size_t k) const {
  double whole = 0;
  for (const Box& root : boxes_) whole = std::max(whole, root.upper[k] - root.lower[k]);
  return whole > 0 ? (box.upper[k] - box.lower[k]) / whole : 0;
}

}  // namespace swarmcert::lipschitz
