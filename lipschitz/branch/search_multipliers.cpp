#include <algorithm>
#include <cmath>
#include <numeric>

#include "lipschitz/branch/root_multipliers.h"
#include "lipschitz/branch/search.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A pair is used only if it decreases the barrier by more than this.
constexpr double kLeastGain = 1e-2;

}  // namespace

std::vector<std::size_t> BranchSearch::still_shown(const Part& part, const NeuronForms& forms) const {
  std::vector<std::size_t> result;
  const std::vector<NeuronPair>& pairs = part.multipliers->pairs;
  const auto is_undecided = [&](Index neuron) {
    return part.states[static_cast<std::size_t>(neuron)] == NeuronState::kUndecided;
  };
  for (std::size_t c = 0; c < pairs.size(); ++c)
    if (is_undecided(pairs[c].first) && is_undecided(pairs[c].second) && forms.excludes(pairs[c]))
      result.push_back(c);
  return result;
}

VectorXd BranchSearch::inherited(const Part& part, const std::vector<std::size_t>& pairs,
                                 NodeInequality& inequality) const {
  const Multipliers& own = *part.multipliers;
  VectorXd t(inequality.neurons() + static_cast<Index>(pairs.size()));
  t.head(inequality.neurons()) = own.t(inequality.undecided());
  for (std::size_t c = 0; c < pairs.size(); ++c) {
    inequality.add(own.pairs[pairs[c]]);
    t(inequality.neurons() + static_cast<Index>(c)) = own.of_pairs[pairs[c]];
  }
  return t;
}

std::vector<NeuronPair> BranchSearch::chosen_pairs(const Part& part, std::size_t most, VectorXd& t) const {
  if (most == 0 && part.multipliers->pairs.empty()) {
    NodeInequality inequality(slope_layers(chain_, part.states), gram_of(part));
    t = inherited(part, {}, inequality);
    return {};
  }
  std::vector<LinearForms> found;
  std::vector<check::Decision> same_as_before;
  const Reach again(chain_.hidden, part.reach->box(), part.around.get(), nullptr, &found,
                    options_.better_slopes ? &same_as_before : nullptr);
  const NeuronForms forms(found, part.reach->box());
  NodeInequality inequality(slope_layers(chain_, part.states), gram_of(part));
  const std::vector<std::size_t> old = still_shown(part, forms);
  t = inherited(part, old, inequality);
  std::vector<NeuronPair> result;
  for (const std::size_t c : old) result.push_back(part.multipliers->pairs[c]);
  const auto same = [](const NeuronPair& a, const NeuronPair& b) {
    return a.first == b.first && a.second == b.second && a.first_on == b.first_on &&
           a.second_on == b.second_on;
  };
  std::vector<NeuronPair> all;
  if (result.size() >= most) return result;
  for (const NeuronPair& pair : forms.pairs(inequality.undecided())) {
    if (std::any_of(result.begin(), result.end(), [&](const NeuronPair& other) { return same(pair, other); }))
      continue;
    all.push_back(pair);
    inequality.add(pair);
  }
  if (all.empty()) return result;
  const Index before = t.size();
  t.conservativeResize(before + static_cast<Index>(all.size()));
  t.tail(static_cast<Index>(all.size())).setZero();
  const std::vector<double> gain = gains(inequality, t, kGap);
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto of = [&](std::size_t c) { return gain[old.size() + c]; };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return of(a) > of(b) || (of(a) == of(b) && a < b); });
  order.resize(std::min(order.size(), most - old.size()));
  for (const std::size_t c : order)
    if (of(c) > kLeastGain) result.push_back(all[c]);
  t.conservativeResize(inequality.neurons() + static_cast<Index>(result.size()));
  return result;
}

void BranchSearch::solve(Part& part) const {
  const double attained = std::max(steepest(), options_.known * options_.known / chain_.unscaled_rho(1));
  const double wanted = attained > 0 ? kShareOfDistance * (part.rho / attained - 1) : kGap;
  DescentOptions descent;
  descent.relative_gap = std::clamp(wanted, kFineGap, kGap);
  descent.steps = kSteps;
  solve(part, descent, static_cast<std::size_t>(std::max(options_.pairs, 0)));
}

void BranchSearch::solve(Part& part, const DescentOptions& descent, std::size_t most_pairs) const {
  NodeInequality inequality(slope_layers(chain_, part.states), gram_of(part));
  const Index m = inequality.neurons();
  std::vector<NeuronPair> pairs;
  VectorXd t;
  if (!part.multipliers) {
    t = root_multipliers(chain_, inequality, options_.start, Stop(options_.cancelled));
  } else {
    pairs = chosen_pairs(part, most_pairs, t);
    for (const NeuronPair& pair : pairs) inequality.add(pair);
    t = descend(inequality, t, descent);
    if (!std::isfinite(inequality.least_rho(t)) && !pairs.empty()) {
      pairs.clear();
      inequality = NodeInequality(slope_layers(chain_, part.states), gram_of(part));
      t = root_multipliers(chain_, inequality, options_.start, Stop(options_.cancelled));
    }
  }
  part.undecided_then = part.undecided;
  // Rounded to single precision, which halves the length of the certificate; any multipliers that prove the part are
  // valid.
  t = t.cast<float>().cast<double>();
  const double rho = inequality.least_rho(t);
  if (!(rho < part.rho)) return;
  if (rho < kFar * part.rho) part.undecided_then = std::numeric_limits<int>::max();
  part.rho = rho;
  keep(part, t.head(m), std::move(pairs), t.tail(t.size() - m));
}

void BranchSearch::keep(Part& part, const VectorXd& t, std::vector<NeuronPair> pairs,
                        const VectorXd& of_pairs) const {
  Multipliers own;
  own.t = VectorXd::Zero(chain_.neurons());
  Index next = 0;
  for (std::size_t i = 0; i < part.states.size(); ++i)
    if (part.states[i] == NeuronState::kUndecided) own.t(static_cast<Index>(i)) = t(next++);
  for (Index i = 0; i < own.t.size(); ++i)
    own.written.multipliers.push_back(chain_.unscaled_multiplier(own.t(i), chain_.layer_of(i)));
  for (std::size_t c = 0; c < pairs.size(); ++c) {
    own.of_pairs.push_back(of_pairs(static_cast<Index>(c)));
    own.written.conflicts.push_back(chain_.unscaled(pairs[c], own.of_pairs.back()));
  }
  own.pairs = std::move(pairs);
  part.multipliers = std::make_shared<const Multipliers>(std::move(own));
}

}  // namespace swarmcert::lipschitz
