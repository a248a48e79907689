#include "analysis/identification/kind_fit.h"

#include <algorithm>
#include <cmath>

#include "analysis/identification/box_least_squares.h"
#include "analysis/identification/passes.h"
#include "nn/base/doubles.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {

using residuals::Inputs;
using stability::EffectSpec;

residuals::VehicleUse use_of(const Inputs& inputs, const std::string& vehicle) {
  const auto known = inputs.fleet.find(vehicle);
  if (known != inputs.fleet.end()) return known->second;
  residuals::VehicleUse use;
  use.kind = inputs.fallback_kind;
  return use;
}

JointFit KindFit::solve(const std::map<std::string, Sum>& sums, const std::vector<int>& columns,
                        int first_offset, const std::vector<stability::Parameter>& bounds) {
  const auto shared = static_cast<Eigen::Index>(columns.size());
  const Eigen::Index size = shared + 3 * static_cast<Eigen::Index>(sums.size());
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(size);
  double y = 0;
  Eigen::Index vehicle = 0;
  for (const auto& [name, sum] : sums) {
    std::vector<int> from = columns;
    std::vector<Eigen::Index> to;
    for (Eigen::Index k = 0; k < shared; ++k) to.push_back(k);
    for (int axis = 0; axis < 3; ++axis) {
      from.push_back(first_offset + axis);
      to.push_back(shared + 3 * vehicle + axis);
    }
    for (std::size_t i = 0; i < from.size(); ++i) {
      b[to[i]] += sum.b[from[i]];
      for (std::size_t j = 0; j < from.size(); ++j)
        gram(to[i], to[j]) += sum.gram[Grams::packed(from[i], from[j])];
    }
    y += sum.y;
    ++vehicle;
  }
  // Regularise: a column that is never active would make the matrix singular.
  for (Eigen::Index k = 0; k < size; ++k) gram(k, k) += 1e-9 + 1e-9 * gram(k, k);
  Eigen::VectorXd lower = Eigen::VectorXd::Constant(size, -kInfinity);
  Eigen::VectorXd upper = Eigen::VectorXd::Constant(size, kInfinity);
  for (Eigen::Index k = 0; k < shared; ++k) {
    lower[k] = bounds[static_cast<std::size_t>(k)].lower;
    upper[k] = bounds[static_cast<std::size_t>(k)].upper;
  }
  const Eigen::VectorXd c = box_least_squares(gram, b, lower, upper);
  JointFit fit;
  fit.shared = c.head(shared);
  fit.square = y - 2 * c.dot(b) + c.dot(gram * c);
  vehicle = 0;
  for (const auto& [name, sum] : sums) fit.offsets_N[name] = c.segment<3>(shared + 3 * vehicle++);
  return fit;
}

KindFit::KindFit(const Inputs& inputs, const std::string& kind, int jobs)
    : inputs_(inputs), kind_(kind), jobs_(jobs) {
  std::vector<int> all;
  for (std::size_t i = 0; i < inputs.found.flights.size(); ++i) {
    all.push_back(static_cast<int>(i));
    for (const auto& [vehicle, path] : inputs.found.flights[i].logs) {
      if (use_of(inputs, vehicle).kind == kind && !use_of(inputs, vehicle).position_only)
        flights_of_[vehicle].push_back(static_cast<int>(i));
    }
  }
  covered_ = coverage(inputs, kind, all, jobs);
}

void KindFit::add(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    Part part;
    part.candidate = candidate(name, *inputs_.model_of(kind_), covered_);
    for (const stability::Parameter& p : part.candidate.info.shape) {
      part.shape.push_back(p.value);
      // The reference height of the ground effect only scales its amplitude.
      const bool scales = p.name == "height_reference_m";
      part.step.push_back(scales ? 0 : p.value != 0 ? 0.3 * std::abs(p.value) : 0.15);
    }
    parts_.push_back(std::move(part));
  }
}

void KindFit::search(int passes, const residuals::Progress& progress) {
  for (int pass = 0; pass < passes; ++pass) {
    step(pass + 1 < passes);
    progress(pass + 1, passes);
  }
}

std::vector<EffectSpec> KindFit::specs(const std::set<std::string>& names) const {
  std::vector<EffectSpec> specs;
  for (const Part& part : parts_) {
    if (names.count(part.candidate.name) == 0) continue;
    EffectSpec spec = part.candidate.spec;
    const stability::EffectInfo& info = part.candidate.info;
    for (std::size_t c = 0; c < info.linear.size(); ++c)
      spec.parameters[info.linear[c].name] = part.coefficients[c];
    for (std::size_t k = 0; k < info.shape.size(); ++k) spec.parameters[info.shape[k].name] = part.shape[k];
    specs.push_back(std::move(spec));
  }
  return specs;
}

void KindFit::choose(const Grams& grams, const std::map<std::string, Sum>& sums, std::size_t i,
                     std::vector<std::size_t>& chosen) {
  Part& part = parts_[i];
  const std::vector<std::vector<double>>& thetas = grams.candidates[i].thetas;
  std::vector<double> squares;
  std::size_t best = 0;
  for (std::size_t t = 0; t < thetas.size(); ++t) {
    chosen[i] = t;
    const JointFit trial = solve_with(grams, sums, chosen);
    squares.push_back(trial.square);
    if (trial.square < squares[best]) best = t;
  }
  chosen[i] = best;
  fit_ = solve_with(grams, sums, chosen);
  if (thetas.size() <= 2 * part.shape.size()) return;  // the last pass has no trial steps
  part.proposal = thetas[0];
  for (std::size_t k = 0; k < part.shape.size(); ++k) {
    const double up = squares[1 + 2 * k] - squares[0], down = squares[2 + 2 * k] - squares[0];
    if (up >= 0 && down >= 0) {
      part.step[k] /= 2;
      if (up + down > 0) part.proposal[k] += part.step[k] * (down - up) / (up + down);
    } else {
      // Move beyond the better side, to the vertex of the parabola, but at most two steps.
      const double bend = up + down, slope = (up - down) / 2;
      const double along = bend > 0 ? std::clamp(-slope / bend, -2.0, 2.0) : (up < down ? 2 : -2);
      part.proposal[k] += along * part.step[k];
    }
    const stability::Parameter& p = part.candidate.info.shape[k];
    part.proposal[k] = std::clamp(part.proposal[k], p.lower, p.upper);
  }
}

void KindFit::step(bool moves) {
  std::vector<Candidate> candidates;
  for (const Part& part : parts_) {
    Candidate trial = part.candidate;
    trial.thetas = {part.shape};
    for (std::size_t k = 0; moves && k < part.shape.size(); ++k) {
      for (const double sign : {1.0, -1.0}) {
        std::vector<double> shape = part.shape;
        const stability::Parameter& p = trial.info.shape[k];
        shape[k] = std::clamp(shape[k] + sign * part.step[k], p.lower, p.upper);
        trial.thetas.push_back(std::move(shape));
      }
    }
    if (!part.proposal.empty()) trial.thetas.push_back(part.proposal);
    candidates.push_back(std::move(trial));
  }
  candidates.push_back(
      candidate(stability::plain_effect(stability::Family::kPush), *inputs_.model_of(kind_), covered_));
  Grams grams;
  std::map<std::string, Sum> sums;
  for (const auto& [vehicle, flights] : flights_of_) {
    grams = block_grams({of_vehicle(vehicle), kind_, flights, 0, jobs_, [](int, int) {}}, candidates);
    Sum sum;
    for (const Block& block : grams.blocks) {
      if (sum.gram.size() == 0) {
        sum.gram = Eigen::VectorXd::Zero(block.gram.size());
        sum.b = Eigen::VectorXd::Zero(block.b.size());
      }
      sum.gram += block.gram;
      sum.b += block.b;
      sum.y += block.y;
    }
    if (sum.gram.size() > 0) sums[vehicle] = std::move(sum);
  }
  std::vector<std::size_t> chosen(parts_.size(), 0);
  fit_ = solve_with(grams, sums, chosen);
  for (std::size_t i = 0; i < parts_.size(); ++i) choose(grams, sums, i, chosen);
  fit_ = solve_with(grams, sums, chosen);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    Part& part = parts_[i];
    part.shape = grams.candidates[i].thetas[chosen[i]];
    part.coefficients.clear();
    for (std::size_t c = 0; c < part.candidate.info.linear.size(); ++c)
      part.coefficients.push_back(fit_.shared[column++]);
  }
}

Inputs KindFit::of_vehicle(const std::string& vehicle) const {
  Inputs alone = inputs_;
  for (const auto& [other, flights] : flights_of_) {
    alone.fleet[other] = use_of(inputs_, other);
    if (other != vehicle) alone.fleet[other].position_only = true;
  }
  return alone;
}

JointFit KindFit::solve_with(const Grams& grams, const std::map<std::string, Sum>& sums,
                             const std::vector<std::size_t>& chosen) const {
  std::vector<int> columns;
  std::vector<stability::Parameter> bounds;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const std::vector<stability::Parameter>& linear = parts_[i].candidate.info.linear;
    for (std::size_t c = 0; c < linear.size(); ++c) {
      columns.push_back(grams.first_column[i][chosen[i]] + static_cast<int>(c));
      bounds.push_back(linear[c]);
    }
  }
  return solve(sums, columns, grams.first_column.back()[0], bounds);
}

}  // namespace swarmcert::identification
