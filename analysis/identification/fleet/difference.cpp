#include "analysis/identification/fleet/difference.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>

#include "analysis/identification/verdict.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using residuals::Inputs;
using stability::EffectSpec;

/// Values of a coefficient in each group of the others.
using ScatterOfGroups = std::map<std::string, std::vector<double>>;

std::vector<FlightGroup> groups_of(const residuals::FoundFlights& found, bool by_day) {
  return by_day ? by_folder(found) : by_flight(found);
}

bool is_rich(const Inputs& inputs, const std::string& kind, const FlightGroup& group, int jobs) {
  return coverage(inputs, kind, group.flights, jobs).too_poor().empty();
}

/// A constant force of one vehicle says nothing about another vehicle, so all get the mean.
std::vector<EffectSpec> without_vehicles(const std::vector<EffectSpec>& specs) {
  std::vector<EffectSpec> shared;
  EffectSpec mean;
  int vehicles = 0;
  for (const EffectSpec& spec : specs) {
    if (spec.vehicle.empty()) {
      shared.push_back(spec);
      continue;
    }
    if (vehicles++ == 0) {
      mean = spec;
      mean.vehicle.clear();
      continue;
    }
    for (auto& [name, value] : mean.parameters) {
      const double other = spec.parameters.at(name), weight = 1.0 / vehicles;
      value += weight * (other - value);
    }
  }
  if (vehicles > 0) shared.push_back(std::move(mean));
  return shared;
}

/// Returns the first time-independent formula if there is a remainder: an event in the others' flights says nothing
/// about these. Null if there is none.
const Formula* lasting_formula(const Diagnosis& diagnosis) {
  if (!leaves_something(diagnosis)) return nullptr;
  const auto lasting = std::find_if(diagnosis.formulas.begin(), diagnosis.formulas.end(),
                                    [](const Formula& formula) { return formula.variable != "time"; });
  return lasting == diagnosis.formulas.end() ? nullptr : &*lasting;
}

/// Effects found in more than half of the groups separately.
struct Common {
  std::vector<std::string> names;  ///< for fit_effects(), in the order of the first group that shows them
  bool has_formula = false;
};

Common common_of(const Inputs& others, const std::string& kind, const std::vector<FlightGroup>& groups,
                 int jobs) {
  std::map<std::string, std::size_t> counts;
  std::vector<std::string> order;
  std::size_t formulas = 0;
  for (const FlightGroup& group : groups) {
    const Diagnosis diagnosis = diagnose(others, kind, group.flights, jobs, [](int, int) {});
    formulas += lasting_formula(diagnosis) != nullptr ? 1 : 0;
    for (const Missing& missing : diagnosis.ranking) {
      const bool each = !missing.specs.empty() && !missing.specs[0].vehicle.empty();
      const std::string name = each ? kVehicleOffset : missing.effect;
      if (counts[name]++ == 0) order.push_back(name);
    }
  }
  Common common;
  common.has_formula = 2 * formulas > groups.size();
  for (const std::string& name : order) {
    if (2 * counts[name] > groups.size()) common.names.push_back(name);
  }
  return common;
}

/// Returns the effects found in `others` for `kind`, and the best formula for their remainder. Values that differ from
/// day to day look like effects if the days are pooled. If there are groups, only effects found in most of them
/// separately are used, with values fitted to all.
std::vector<EffectSpec> baseline(const Inputs& others, const std::string& kind, bool one_vehicle,
                                 const std::vector<FlightGroup>& groups, int jobs,
                                 const residuals::Progress& progress) {
  const bool has_groups = groups.size() >= 2;
  const Common common = has_groups ? common_of(others, kind, groups, jobs) : Common{};
  std::vector<EffectSpec> specs;
  if (has_groups && !common.names.empty())
    specs = specs_of(fit_effects(others, kind, common.names, every_flight(others), jobs, progress));
  if (!has_groups || common.has_formula) {
    const Inputs held = with_model_of_kind(others, kind, with_effects(*others.model_of(kind), specs));
    const Diagnosis diagnosis = diagnose(held, kind, every_flight(held), jobs, progress);
    if (!has_groups) specs = specs_of(diagnosis.ranking);
    if (const Formula* const formula = lasting_formula(diagnosis)) specs.push_back(formula->effect);
  }
  if (!one_vehicle) specs = without_vehicles(specs);
  return specs;
}

/// Returns the model with `spec` at its shape and with zero coefficients, so that a fit changes only the coefficients.
stability::Model at_shape(const stability::Model& model, const EffectSpec& spec, const Missing& missing) {
  EffectSpec none = spec;
  for (const std::string& name : missing.coefficients) {
    none.parameters[name] = 0;
    none.fit.interval[name] = {0, 0};
  }
  return with_effects(model, {none});
}

/// Returns the coefficients of `missing` fitted to each group of the others on top of the fixed effects. Empty for lags
/// and delays, which have no coefficient that could be zero, and for formulas.
ScatterOfGroups scatter_of(const Inputs& others, const std::string& kind, const Missing& missing,
                           const std::vector<FlightGroup>& groups, int jobs) {
  ScatterOfGroups scatter;
  if (missing.specs.size() != 1 || missing.specs[0].is_expression()) return scatter;
  if (stability::effect_info(missing.effect).remembers) return scatter;
  const Inputs held =
      with_model_of_kind(others, kind, at_shape(*others.model_of(kind), missing.specs[0], missing));
  for (const FlightGroup& group : groups) {
    const std::vector<Missing> fitted =
        fit_effects(held, kind, {missing.effect}, group.flights, jobs, [](int, int) {});
    for (const std::string& name : missing.coefficients)
      scatter[name].push_back(fitted[0].parameters.at(name));
  }
  return scatter;
}

double deviation(const std::vector<double>& values) {
  double mean = 0, squares = 0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

/// Widens the intervals of `missing` by the scatter of `groups` and returns whether a coefficient exceeds it at 95 %.
/// The difference of the means of m and n groups has the variance s^2 (1/m + 1/n), in addition to that of the fit.
bool is_beyond(const ScatterOfGroups& scatter, int own_groups, Missing& missing) {
  const double normal = boost::math::quantile(boost::math::normal(), 0.95);
  bool beyond = false, is_known = false;
  for (const std::string& name : missing.coefficients) {
    const auto values = scatter.find(name);
    if (values == scatter.end() || values->second.size() < 2) continue;
    is_known = true;
    const auto n = static_cast<double>(values->second.size());
    const boost::math::students_t student(n - 1);
    Interval& interval = missing.intervals[name];
    const double fit = (interval.upper - interval.lower) / (2 * normal);
    const double between = deviation(values->second) * std::sqrt(1.0 / std::max(1, own_groups) + 1 / n);
    const double error = std::hypot(fit, between), value = missing.parameters.at(name);
    const double half = error * boost::math::quantile(student, 0.95);
    interval = {std::min(interval.lower, value - half), std::max(interval.upper, value + half)};
    beyond = beyond || std::abs(value) > error * boost::math::quantile(student, 0.975);
  }
  return beyond || !is_known;
}

void judge(const Inputs& others, const std::string& kind, const std::vector<FlightGroup>& groups, int jobs,
           Difference& difference) {
  if (groups.size() < 2) {
    difference.no_scatter =
        "the others have fewer than two flights or days with enough data; intervals contain only the error "
        "of the fit";
    return;
  }
  std::vector<Missing> beyond;
  for (Missing& missing : difference.diagnosis.ranking) {
    const ScatterOfGroups scatter = scatter_of(others, kind, missing, groups, jobs);
    std::vector<Missing>& place =
        is_beyond(scatter, difference.own_groups, missing) ? beyond : difference.within_scatter;
    place.push_back(std::move(missing));
  }
  difference.diagnosis.ranking = std::move(beyond);
}

std::vector<FlightGroup> rich_groups(const Inputs& inputs, const std::string& kind, bool by_day, int jobs) {
  std::vector<FlightGroup> groups = groups_of(inputs.found, by_day);
  groups.erase(std::remove_if(groups.begin(), groups.end(),
                              [&](const FlightGroup& g) { return !is_rich(inputs, kind, g, jobs); }),
               groups.end());
  return groups;
}

}  // namespace

std::vector<Difference> differences(const Inputs& inputs, const Inputs& others, const std::string& kind,
                                    int jobs, const residuals::Progress& progress) {
  const Coverage here = coverage(inputs, kind, every_flight(inputs), jobs);
  const Coverage there = coverage(others, kind, every_flight(others), jobs);
  std::vector<EffectSpec> of_all;
  bool has_all = false;
  std::vector<Difference> result;
  for (const std::string& vehicle : here.vehicles) {
    Difference difference;
    difference.vehicle = vehicle;
    difference.against_itself =
        std::find(there.vehicles.begin(), there.vehicles.end(), vehicle) != there.vehicles.end();
    if (!there.too_poor().empty()) {
      difference.diagnosis.kind = kind;
      difference.diagnosis.vehicle = vehicle;
      difference.diagnosis.too_poor = "of the other flights, " + there.too_poor();
      result.push_back(std::move(difference));
      continue;
    }
    const Inputs own = of_one_vehicle(inputs, kind, vehicle);
    const Inputs base = difference.against_itself ? of_one_vehicle(others, kind, vehicle) : others;
    const bool by_day = by_folder(base.found).size() >= kFewestDays;
    difference.grouped_by = by_day ? "folder" : "flight";
    const std::vector<FlightGroup> groups = rich_groups(base, kind, by_day, jobs);
    if (difference.against_itself) {
      difference.held = baseline(base, kind, true, groups, jobs, progress);
    } else {
      if (!has_all) of_all = baseline(others, kind, there.vehicles.size() == 1, groups, jobs, progress);
      has_all = true;
      difference.held = of_all;
    }
    const stability::Model held = with_effects(*inputs.model_of(kind), difference.held);
    difference.diagnosis =
        diagnose(with_model_of_kind(own, kind, held), kind, every_flight(own), jobs, progress);
    difference.diagnosis.vehicle = vehicle;
    const Inputs base_held = with_model_of_kind(base, kind, held);
    difference.other_groups = static_cast<int>(groups.size());
    difference.own_groups = static_cast<int>(rich_groups(own, kind, by_day, jobs).size());
    judge(base_held, kind, groups, jobs, difference);
    result.push_back(std::move(difference));
  }
  return result;
}

}  // namespace swarmcert::identification
