#include <cmath>

#include "lipschitz/branch/root_multipliers.h"
#include "lipschitz/branch/search.h"

namespace swarmcert::lipschitz {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A form is renewed only if the number of undecided neurons of rho is below the share kLazyRho of the number for which
/// the old form was computed; otherwise improving phi alone, without rho, is cheaper. If it is not renewed, the next
/// attempt is made as if kFormAgain times the current number of neurons had been undecided.
constexpr double kLazyRho = 0.985, kFormAgain = 0.95;
/// Margin of a form above the least one, relative to its largest entry: more than the error of rounding it to single
/// precision.
constexpr double kFormMargin = 4e-6;

}  // namespace

void BranchSearch::renew_form(Part& part) const {
  part.undecided_form = part.undecided;
  const OfRho* const old = part.form.get();
  OfRho own;
  const std::size_t first = chain_.hidden.size() + 1;  // first layer of rho
  std::vector<check::Decision> decided;
  own.reach = std::make_shared<const Reach>(set_->whole.hidden, *part.reach,
                                            old != nullptr ? old->reach.get() : nullptr,
                                            options_.better_slopes ? &decided : nullptr);
  const std::vector<NeuronState> behind = states_of(*own.reach, set_->rho, first);
  own.undecided = undecided_in(behind);
  if (old != nullptr && own.undecided > kLazyRho * old->undecided) {
    part.undecided_form = static_cast<int>(kFormAgain * part.undecided);
    return;
  }
  std::vector<NeuronState> states = part.states;
  states.insert(states.end(), static_cast<std::size_t>(set_->last.rows()), NeuronState::kOn);
  states.insert(states.end(), behind.begin(), behind.end());
  const NodeInequality joint(slope_layers(set_->whole, states), set_->whole.gram);
  const Index m = undecided_in(part.states);
  VectorXd t;
  if (old == nullptr) {
    t = root_multipliers(set_->whole, joint, options_.start, Stop(options_.cancelled));
  } else {
    VectorXd all(set_->whole.neurons());
    all << part.multipliers->t, VectorXd::Zero(set_->last.rows()), old->t;
    DescentOptions descent;
    descent.relative_gap = kGap;
    descent.steps = kSteps;
    t = descend(joint, all(joint.undecided()), descent);
  }
  t = t.cast<float>().cast<double>();
  const NodeInequality rho(slope_layers(set_->rho, behind), set_->rho.gram);
  MatrixXd q = rho.least_form(t.tail(t.size() - m));
  if (q.size() == 0) return;
  q.diagonal().array() += kFormMargin * q.diagonal().maxCoeff();
  q = MatrixXd(q.cast<float>().cast<double>().selfadjointView<Eigen::Lower>());
  own.gram = set_->gram(q);
  const double least = NodeInequality(slope_layers(chain_, part.states), own.gram).least_rho(t.head(m));
  if (!(least < part.rho)) return;
  part.undecided_then = least < kFar * part.rho ? std::numeric_limits<int>::max() : part.undecided;
  part.rho = least;
  own.t = VectorXd::Zero(set_->rho.neurons());
  for (Index i = 0; i < t.size() - m; ++i) own.t(rho.undecided()[static_cast<std::size_t>(i)]) = t(m + i);
  for (Index i = 0; i < q.rows(); ++i)
    for (Index j = 0; j <= i; ++j) own.written.q.push_back(std::ldexp(q(i, j), set_->form_exponent()));
  for (Index i = 0; i < own.t.size(); ++i)
    own.written.t.push_back(set_->whole.unscaled_multiplier(own.t(i), first + set_->rho.layer_of(i)));
  part.form = std::make_shared<const OfRho>(std::move(own));
  part.has_new_form = true;
  part.decided.insert(part.decided.end(), decided.begin(), decided.end());
  keep(part, t.head(m), {}, {});
}

}  // namespace swarmcert::lipschitz
