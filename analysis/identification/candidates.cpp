#include "analysis/identification/candidates.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "analysis/identification/column_run.h"
#include "analysis/identification/scan/named_forms.h"
#include "analysis/identification/swinging_load.h"
#include "analysis/logs/read_log.h"
#include "analysis/residuals/thrust_stage.h"
#include "nn/base/parallel.h"
#include "stability/effects/registry.h"

namespace swarmcert::identification {
namespace {

using stability::EffectInfo;
using stability::EffectSpec;
using stability::ShownBy;

const EffectSpec* find(const stability::Model& model, const std::string& name,
                       const std::string& vehicle = "") {
  for (const EffectSpec& spec : model.effects) {
    if (spec.name == name && spec.vehicle == vehicle) return &spec;
  }
  return nullptr;
}

EffectInfo info_of(const EffectSpec& spec, const std::string& path) {
  if (!spec.is_expression()) return stability::effect_info(spec.name);
  return stability::make_effect(spec, {"", {}, path})->info();
}

/// Turns the candidate into a change of `present`: bounds of the change, and the shape in the model.
void make_change(Candidate& candidate, const EffectSpec& present) {
  const stability::EffectValues values = stability::effect_values(candidate.info, present);
  candidate.thetas = {values.shape};
  for (std::size_t c = 0; c < values.linear.size(); ++c) {
    candidate.info.linear[c].lower -= values.linear[c];
    candidate.info.linear[c].upper -= values.linear[c];
  }
  for (std::size_t i = 0; i < values.shape.size(); ++i) {
    candidate.info.shape[i].lower = candidate.info.shape[i].upper = values.shape[i];
    candidate.info.shape[i].grid.clear();
  }
}

/// Excludes effects of a surface that decay over more than half of the height range of a flight: they act almost
/// uniformly, so a thrust scale that differs between flights, as their heights do, explains the same without them.
void hold_within_flights(Candidate& candidate, double height_span_m) {
  constexpr double kDecays = 2;
  for (std::size_t i = 0; i < candidate.info.shape.size(); ++i) {
    stability::Parameter& decay_m = candidate.info.shape[i];
    if (decay_m.name != "decay_m" || decay_m.grid.empty()) continue;
    decay_m.upper = std::min(decay_m.upper, height_span_m / kDecays);
    std::vector<std::vector<double>>& thetas = candidate.thetas;
    thetas.erase(std::remove_if(thetas.begin(), thetas.end(),
                                [&](const std::vector<double>& theta) { return theta[i] > decay_m.upper; }),
                 thetas.end());
  }
}

Candidate vehicle_offset(const stability::Model& model, const Coverage& coverage) {
  Candidate result;
  result.name = result.spec.name = stability::plain_effect(stability::Family::kPush);
  result.info = stability::effect_info(result.name, model);
  result.thetas = {{}};
  result.vehicles = coverage.vehicles;
  std::vector<stability::Parameter> all;
  for (const std::string& vehicle : coverage.vehicles) {
    const EffectSpec* present = find(model, result.name, vehicle);
    for (stability::Parameter parameter : result.info.linear) {
      const double value = present == nullptr || present->parameters.count(parameter.name) == 0
                               ? 0
                               : present->parameters.at(parameter.name);
      parameter.lower -= value;
      parameter.upper -= value;
      parameter.name = vehicle + "." + parameter.name;
      all.push_back(parameter);
    }
  }
  result.info.linear = all;
  return result;
}

}  // namespace

std::string Coverage::too_poor() const {
  if (blocks >= kFewestBlocks) return "";
  return fmt::format(
      "{} usable records make {} blocks of 2 s without a cut; an answer needs at least {} blocks", records,
      blocks, kFewestBlocks);
}

Coverage coverage(const residuals::Inputs& inputs, const std::string& kind, const std::vector<int>& which,
                  int jobs) {
  using residuals::Track;
  struct Part {
    Coverage covered;
    std::set<std::string> vehicles;
  };
  std::vector<Part> parts(which.size());
  files::parallel_for(static_cast<int>(which.size()), jobs, [&](int i) {
    Part& part = parts[static_cast<std::size_t>(i)];
    part.covered.range = {INFINITY, -INFINITY};
    for (const Track& track :
         inputs.load(static_cast<std::size_t>(which[static_cast<std::size_t>(i)]), part.covered.problems)) {
      for (const logs::Doubt& doubt : track.doubts) {
        if (!doubt.refuses_force) part.covered.problems.push_back(track.path + ": " + doubt.words);
      }
      if (!logs::is_sound(track.health)) {
        part.covered.problems.push_back(
            fmt::format("{}: {}", track.path, fmt::join(logs::findings(track.health), "; ")));
      }
      if (track.position_only || track.kind != kind) continue;
      part.covered.has_set_points = part.covered.has_set_points || !track.targets.empty();
      double lowest_m = INFINITY, highest_m = -INFINITY;
      part.covered.blocks += cut_into_blocks(track).blocks.size();
      for (std::size_t s = 0; s < track.instants.size(); ++s) {
        if (track.cut[s] != residuals::Cut::kNone) continue;
        const stability::Instant& now = track.instants[s];
        stability::FlightRange& range = part.covered.range;
        lowest_m = std::min(lowest_m, now.p_W_m.z());
        highest_m = std::max(highest_m, now.p_W_m.z());
        range.z_min_m = std::min(range.z_min_m, now.p_W_m.z());
        range.z_max_m = std::max(range.z_max_m, now.p_W_m.z());
        part.covered.battery_most_V = std::max(part.covered.battery_most_V, now.battery_V);
        part.covered.most_neighbours = std::max(part.covered.most_neighbours, now.num_neighbours);
        part.vehicles.insert(track.vehicle);
        ++part.covered.records;
      }
      part.covered.height_span_m = std::max(part.covered.height_span_m, highest_m - lowest_m);
    }
  });
  Coverage all;
  all.range = {INFINITY, -INFINITY};
  std::set<std::string> vehicles;
  for (const Part& part : parts) {
    all.range.z_min_m = std::min(all.range.z_min_m, part.covered.range.z_min_m);
    all.range.z_max_m = std::max(all.range.z_max_m, part.covered.range.z_max_m);
    all.battery_most_V = std::max(all.battery_most_V, part.covered.battery_most_V);
    all.height_span_m = std::max(all.height_span_m, part.covered.height_span_m);
    all.most_neighbours = std::max(all.most_neighbours, part.covered.most_neighbours);
    all.has_set_points = all.has_set_points || part.covered.has_set_points;
    all.records += part.covered.records;
    all.blocks += part.covered.blocks;
    vehicles.insert(part.vehicles.begin(), part.vehicles.end());
    all.problems.insert(all.problems.end(), part.covered.problems.begin(), part.covered.problems.end());
  }
  all.vehicles.assign(vehicles.begin(), vehicles.end());
  return all;
}

bool is_plain_scale(const std::string& effect) {
  return stability::traits_of(effect).is_plain(stability::Family::kThrustScale);
}

double own_thrust_ratio(const stability::Model& model) {
  double sum = 0;
  for (const EffectSpec& spec : model.effects) {
    const auto ratio = spec.parameters.find("ratio");
    if (is_plain_scale(spec.name) && ratio != spec.parameters.end()) sum += ratio->second;
  }
  return sum;
}

bool is_taken(const std::string& name, const stability::Model& model) {
  const EffectSpec* present = find(model, name);
  return present != nullptr && info_of(*present, model.path).remembers;
}

Candidate candidate(const std::string& name, const stability::Model& model, const Coverage& coverage) {
  if (name == kVehicleOffset) return vehicle_offset(model, coverage);
  Candidate result;
  result.name = name;
  const EffectSpec* present = find(model, name);
  if (present != nullptr && present->is_expression()) {
    result.spec = *present;
  } else {
    result.spec.name = name;
  }
  result.info =
      result.spec.is_expression() ? info_of(result.spec, model.path) : stability::effect_info(name, model);
  stability::FlightRange range = coverage.range;
  const bool is_stated = model.battery_range_V != stability::kOneCell_V;
  range.full_battery_V =
      is_stated ? model.full_battery_V() : stability::full_battery_V(coverage.battery_most_V);
  result.thetas = stability::make_effect(result.spec, {"", {}, model.path})->grid(range);
  for (std::size_t i = 0; i < result.info.shape.size(); ++i) {
    stability::Parameter& parameter = result.info.shape[i];
    if (parameter.unit != stability::Unit::kArm) continue;
    const double size = model.arm_m / stability::kCrazyflieArm_m;
    parameter.value *= size;
    for (double& value : parameter.grid) value *= size;
    for (std::vector<double>& theta : result.thetas) theta[i] *= size;
  }
  if (result.info.remembers) {
    // A lag or delay has gain 1. Some tolerance lets a coarse grid of times find it.
    result.info.linear[0].lower = 1 - kMemoryTolerance;
    result.info.linear[0].upper = 1 + kMemoryTolerance;
  }
  if (residuals::is_thrust_stage(name)) {
    for (const EffectSpec& spec : model.effects) {
      if (is_plain_scale(spec.name) && spec.vehicle.empty())
        result.scale = 1 + stability::effect_values(info_of(spec, model.path), spec).linear[0];
    }
  }
  if (present == nullptr) return result;
  const stability::EffectValues values = stability::effect_values(result.info, *present);
  const bool is_switched_off =
      present->is_expression() &&
      std::all_of(values.linear.begin(), values.linear.end(), [](double value) { return value == 0; });
  if (!is_switched_off) make_change(result, *present);
  return result;
}

std::vector<ScaledStage> scaled_stages(const std::vector<const Candidate*>& effects) {
  std::vector<ScaledStage> pairs;
  for (std::size_t scale = 0; scale < effects.size(); ++scale) {
    if (!effects[scale]->info.traits.is_plain(stability::Family::kThrustScale)) continue;
    for (std::size_t stage = 0; stage < effects.size(); ++stage) {
      if (effects[stage]->info.traits.place == stability::Place::kThrust) pairs.push_back({stage, scale});
    }
  }
  return pairs;
}

bool is_written_by_hand(const std::string& name) {
  const ShownBy shown_by = stability::traits_of(name).shown_by;
  return shown_by == ShownBy::kTorques || shown_by == ShownBy::kAccelerometer ||
         shown_by == ShownBy::kNothing;
}

bool is_turning(const std::string& name) { return stability::traits_of(name).shown_by == ShownBy::kTurning; }

std::string rotor_effect() { return stability::effect_shown_by(ShownBy::kRotors); }

std::vector<std::string> candidate_names(const stability::Model& model) {
  std::vector<std::string> names;
  for (const std::string& name : stability::effect_names()) {
    if (!is_written_by_hand(name) && name != rotor_effect() && !is_turning(name)) names.push_back(name);
  }
  for (const EffectSpec& spec : model.effects) {
    if (spec.is_expression()) names.push_back(spec.name);
  }
  names.emplace_back(kVehicleOffset);
  return names;
}

std::vector<Candidate> all_candidates(const stability::Model& model, const Coverage& coverage) {
  std::vector<Candidate> all;
  for (const std::string& name : candidate_names(model)) {
    if (name == kVehicleOffset && coverage.vehicles.size() < 2) continue;
    if (is_taken(name, model)) continue;
    // Effects that the model already has may still need a change.
    if ((needs_scan(name) || swings(name)) && find(model, name) == nullptr) continue;
    Candidate next = candidate(name, model, coverage);
    if (next.info.needs_neighbours && coverage.most_neighbours == 0) continue;
    if (coverage.range.z_min_m > next.info.traits.seen_below_arms * model.arm_m) continue;
    if (next.info.traits.within_flights) hold_within_flights(next, coverage.height_span_m);
    if (next.thetas.empty()) continue;
    all.push_back(std::move(next));
  }
  return all;
}

std::vector<EffectSpec> specs_of(const Candidate& candidate, const std::vector<double>& coefficients,
                                 const std::vector<double>& theta,
                                 const std::vector<Interval>& linear_intervals,
                                 const std::vector<Interval>& shape_intervals) {
  const std::vector<std::string> vehicles =
      candidate.vehicles.empty() ? std::vector<std::string>{""} : candidate.vehicles;
  const std::size_t each = coefficients.size() / vehicles.size();
  std::vector<EffectSpec> specs;
  for (std::size_t v = 0; v < vehicles.size(); ++v) {
    EffectSpec spec = candidate.spec;
    spec.vehicle = vehicles[v];
    for (std::size_t c = 0; c < each; ++c) {
      std::string name = candidate.info.linear[v * each + c].name;
      if (!vehicles[v].empty()) name = name.substr(vehicles[v].size() + 1);
      spec.parameters[name] = coefficients[v * each + c];
      spec.fit.interval[name] = linear_intervals[v * each + c];
    }
    for (std::size_t i = 0; i < theta.size(); ++i) {
      const std::string& name = candidate.info.shape[i].name;
      spec.parameters[name] = theta[i];
      if (shape_intervals[i].lower < shape_intervals[i].upper) spec.fit.interval[name] = shape_intervals[i];
    }
    specs.push_back(std::move(spec));
  }
  return specs;
}

stability::Model with_effects(const stability::Model& model, const std::vector<EffectSpec>& specs) {
  stability::Model result = model;
  for (const EffectSpec& spec : specs) {
    const auto known = std::find_if(result.effects.begin(), result.effects.end(), [&](const EffectSpec& e) {
      return e.name == spec.name && e.vehicle == spec.vehicle;
    });
    if (known == result.effects.end()) {
      result.effects.push_back(spec);
      continue;
    }
    // candidate() kept the shape, or the coefficients were zero, so c1 X + c2 X = (c1 + c2) X; the intervals are those
    // of the change.
    const EffectInfo info = info_of(*known, model.path);
    const stability::EffectValues values = stability::effect_values(info, *known);
    for (std::size_t c = 0; c < info.linear.size(); ++c) {
      const std::string& name = info.linear[c].name;
      known->parameters[name] = values.linear[c] + spec.parameters.at(name);
      const auto& [lower, upper] = spec.fit.interval.at(name);
      known->fit.interval[name] = {values.linear[c] + lower, values.linear[c] + upper};
    }
    for (const stability::Parameter& p : info.shape) {
      known->parameters[p.name] = spec.parameters.at(p.name);
      const auto interval = spec.fit.interval.find(p.name);
      if (interval != spec.fit.interval.end()) known->fit.interval[p.name] = interval->second;
    }
    known->fit.flights = spec.fit.flights;
    known->fit.note = spec.fit.note;
  }
  return result;
}

}  // namespace swarmcert::identification
