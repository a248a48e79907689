#include "analysis/identification/budget.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "analysis/identification/block_grams.h"
#include "analysis/identification/box_least_squares.h"
#include "nn/files/doubles.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::Inputs;
using stability::EffectSpec;
using stability::Model;

const std::vector<std::string> kKnown = {"motor_lag", "ground", "downwash"};
const std::vector<std::string> kRest = {"upper_lift", "drag_linear", "battery", "inflow"};

/// One effect of a joint fit, with the shape that it has now.
struct Part {
  Candidate candidate;
  std::vector<double> shape, step;
  std::vector<double> proposal;  ///< one more theta to try: where the parabolas of all parameters meet
  std::vector<double> coefficients;
};

/// Sums of a vehicle's blocks.
struct Sum {
  Eigen::VectorXd gram, b;
  double y = 0;
};

/// Shared coefficients of some columns, and a constant force for each vehicle, by least squares within the bounds of
/// the coefficients. Returns the squared error.
struct JointFit {
  Eigen::VectorXd shared;
  std::map<std::string, Eigen::Vector3d> offsets_N;
  double square = 0;
};

JointFit solve(const std::map<std::string, Sum>& sums, const std::vector<int>& columns, int first_offset,
               const std::vector<stability::Parameter>& bounds) {
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
  // A column that is nowhere active would make the matrix singular.
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

residuals::VehicleUse use_of(const Inputs& inputs, const std::string& vehicle) {
  const auto known = inputs.fleet.find(vehicle);
  if (known != inputs.fleet.end()) return known->second;
  residuals::VehicleUse use;
  use.kind = inputs.fallback_kind;
  return use;
}

/// Joint fit of effects with shapes to the flights of one kind.
class KindFit {
 public:
  KindFit(const Inputs& inputs, const std::string& kind, int jobs)
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

  void add(const std::vector<std::string>& names) {
    for (const std::string& name : names) {
      Part part;
      part.candidate = candidate(name, *inputs_.model_of(kind_), covered_);
      for (const stability::Parameter& p : part.candidate.info.shape) {
        part.shape.push_back(p.value);
        // The ground's reference height only scales its amplitude.
        const bool scales = p.name == "height_reference_m";
        part.step.push_back(scales ? 0 : p.value != 0 ? 0.3 * std::abs(p.value) : 0.15);
      }
      parts_.push_back(std::move(part));
    }
  }

  /// A search over all shapes at once: each pass through the flights tries one step up and one down in every shape
  /// parameter, and where the parabolas through the last pass's errors have their vertices; each effect moves to its
  /// best, and steps that gain nothing are halved.
  void search(int passes, const residuals::Progress& progress) {
    for (int pass = 0; pass < passes; ++pass) {
      step(pass + 1 < passes);
      progress(pass + 1, passes);
    }
  }

  bool is_empty() const { return covered_.records == 0; }
  const std::map<std::string, Eigen::Vector3d>& offsets_N() const { return fit_.offsets_N; }

  /// The effects that are in `names`, with values.
  std::vector<EffectSpec> specs(const std::set<std::string>& names) const {
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

 private:
  /// The best theta of effect `i` beside the others; where its shape goes next, and how far.
  void choose(const Grams& grams, const std::map<std::string, Sum>& sums, std::size_t i,
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
    if (thetas.size() <= 2 * part.shape.size()) return;  // the last pass tries nothing
    part.proposal = thetas[0];
    for (std::size_t k = 0; k < part.shape.size(); ++k) {
      const double up = squares[1 + 2 * k] - squares[0], down = squares[2 + 2 * k] - squares[0];
      if (up >= 0 && down >= 0) {
        part.step[k] /= 2;
        if (up + down > 0) part.proposal[k] += part.step[k] * (down - up) / (up + down);
      } else {
        // Past the better side: to the vertex of the parabola, at most two steps away.
        const double bend = up + down, slope = (up - down) / 2;
        const double along = bend > 0 ? std::clamp(-slope / bend, -2.0, 2.0) : (up < down ? 2 : -2);
        part.proposal[k] += along * part.step[k];
      }
      const stability::Parameter& p = part.candidate.info.shape[k];
      part.proposal[k] = std::clamp(part.proposal[k], p.lower, p.upper);
    }
  }

  void step(bool moves) {
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
    candidates.push_back(candidate("constant_force", *inputs_.model_of(kind_), covered_));
    Grams grams;
    std::map<std::string, Sum> sums;
    for (const auto& [vehicle, flights] : flights_of_) {
      grams = block_grams(of_vehicle(vehicle), kind_, candidates, flights, jobs_, [](int, int) {});
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

  /// The others are neighbours and nothing else.
  Inputs of_vehicle(const std::string& vehicle) const {
    Inputs alone = inputs_;
    for (const auto& [other, flights] : flights_of_) {
      alone.fleet[other] = use_of(inputs_, other);
      if (other != vehicle) alone.fleet[other].position_only = true;
    }
    return alone;
  }

  JointFit solve_with(const Grams& grams, const std::map<std::string, Sum>& sums,
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

  const Inputs& inputs_;
  const std::string kind_;
  const int jobs_;
  std::map<std::string, std::vector<int>> flights_of_;  ///< by vehicle
  Coverage covered_;
  std::vector<Part> parts_;
  JointFit fit_;
};

EffectSpec offset_spec(const Eigen::Vector3d& offset_N) {
  EffectSpec spec;
  spec.name = "constant_force";
  spec.parameters = {{"force_x_N", offset_N.x()}, {"force_y_N", offset_N.y()}, {"force_z_N", offset_N.z()}};
  return spec;
}

BudgetRow judged(const std::string& name, const Inputs& test, int jobs) {
  const residuals::Comparison comparison = residuals::compare(test, jobs, [](int, int) {});
  BudgetRow row;
  row.name = name;
  for (const auto& [composition, group] : comparison.compositions) row.of[composition] = group.statistics;
  for (const auto& [kind, group] : comparison.kinds) row.of["kind " + kind] = group.statistics;
  row.of["all"] = comparison.overall.statistics;
  return row;
}

void set_mass(Inputs& inputs, const std::string& kind, double mass_kg) {
  for (Model& model : inputs.models) {
    if (model.kind == kind) model.mass_kg = mass_kg;
  }
}

/// Vehicles of `kind` in `inputs`.
std::set<std::string> vehicles_of(const Inputs& inputs, const std::string& kind) {
  std::set<std::string> names;
  for (const residuals::FlightFiles& flight : inputs.found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      if (use_of(inputs, vehicle).kind == kind) names.insert(vehicle);
    }
  }
  return names;
}

}  // namespace

Budget error_budget(const Inputs& given_fit, const Inputs& given_test, const std::string& network, int jobs,
                    const residuals::Progress& progress) {
  constexpr double kWeighedSmall_kg = 0.032;
  constexpr int kPasses = 12, kRestPasses = 6;
  Budget budget;
  budget.fit_flights = given_fit.found.flights.size();
  budget.test_flights = given_test.found.flights.size();
  Inputs fit = given_fit, test = given_test;
  for (Inputs* inputs : {&fit, &test}) {
    inputs->vehicle_models.clear();
    for (Model& model : inputs->models) model.effects.clear();
  }
  budget.rows.push_back(judged("nominal", test, jobs));
  if (test.model_of("small") != nullptr) {
    Inputs lighter = test;
    set_mass(lighter, "small", kWeighedSmall_kg);
    BudgetRow other = judged("nominal", lighter, jobs);
    const auto error = [](const BudgetRow& row) {
      const auto small = row.of.find("kind small");
      return small == row.of.end() ? INFINITY : small->second.rmse.z;
    };
    if (error(other) < error(budget.rows[0])) {
      budget.rows[0] = std::move(other);
      set_mass(fit, "small", kWeighedSmall_kg);
      set_mass(test, "small", kWeighedSmall_kg);
    }
  }
  const int kinds = static_cast<int>(test.models.size());
  const int work = kinds * (kPasses + kRestPasses);
  int done = 0;
  std::vector<Inputs> stages(5, test);  // lag, offset, ground, jet, rest
  for (const Model& model : test.models) {
    budget.masses_kg[model.kind] = model.mass_kg;
    KindFit joint(fit, model.kind, jobs);
    if (joint.is_empty()) continue;
    const auto show = [&](int, int) { progress(++done, work); };
    joint.add(kKnown);
    joint.search(kPasses, show);
    const auto apply = [&](Inputs& stage, const std::set<std::string>& names, bool offsets) {
      for (const std::string& vehicle : vehicles_of(test, model.kind)) {
        Model own = model;
        own.effects = joint.specs(names);
        const auto offset = joint.offsets_N().find(vehicle);
        if (offsets && offset != joint.offsets_N().end()) own.effects.push_back(offset_spec(offset->second));
        stage.vehicle_models[vehicle] = std::move(own);
      }
    };
    apply(stages[0], {"motor_lag"}, false);
    apply(stages[1], {"motor_lag"}, true);
    apply(stages[2], {"motor_lag", "ground"}, true);
    apply(stages[3], {"motor_lag", "ground", "downwash"}, true);
    joint.add(kRest);
    joint.search(kRestPasses, show);
    std::set<std::string> everything(kKnown.begin(), kKnown.end());
    everything.insert(kRest.begin(), kRest.end());
    apply(stages[4], everything, true);
    for (const std::string& vehicle : vehicles_of(test, model.kind))
      budget.fitted[vehicle] = stages[4].vehicle_models.at(vehicle);
  }
  const char* const kNames[] = {"lag", "offset", "ground", "jet", "rest"};
  for (std::size_t k = 0; k < stages.size(); ++k) {
    budget.rows.push_back(judged(kNames[k], stages[k], jobs));
    budget.rows.back().models = stages[k].vehicle_models;
  }
  if (!network.empty()) {
    Inputs learned = test;
    learned.rules.published_signals = true;
    for (Model& model : learned.models) {
      if (model.kind == "small") model.mass_kg = kWeighedSmall_kg;
      EffectSpec spec;
      spec.name = "deep_set";
      spec.network = std::filesystem::absolute(network).string();
      model.effects = {spec};
    }
    budget.rows.push_back(judged("network", learned, jobs));
  }
  return budget;
}

}  // namespace swarmcert::identification
