#include "analysis/commands/compare/compare_output.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "analysis/cli/counted.h"
#include "analysis/commands/compare/log_output.h"
#include "analysis/commands/shared/collection_table.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/commands/shared/plausibility_output.h"
#include "analysis/residuals/force_unit.h"
#include "nn/base/json_number.h"

namespace swarmcert::analysis {
namespace {

using analysis::json_of;
using residuals::Comparison;

files::Json json_of(const Eigen::Vector3d& v) {
  // JSON has no NaN: null if a spectrum could not be computed.
  return {{"x", files::finite(v[0])}, {"y", files::finite(v[1])}, {"z", files::finite(v[2])}};
}

files::Json json_of(const residuals::ErrorStatistics& s) {
  return {{"samples", s.samples},
          {"rmse", json_of(s.rmse)},
          {"bias", json_of(s.bias)},
          {"p95", json_of(s.p95)},
          {"p999", json_of(s.p999)},
          {"max", json_of(s.max)},
          {"variance_explained", json_of(s.variance_explained)}};
}

files::Json json_of(const residuals::GroupErrors& g) {
  files::Json json = json_of(g.statistics);
  const char* const kAxes[] = {"x", "y", "z", "total"};
  for (std::size_t k = 0; k < 4; ++k) json["rmse_interval_90"][kAxes[k]] = g.rmse_interval[k];
  json["nrmse"] = json_of(g.nrmse);
  json["low_band_to_floor"] = json_of(g.low_band_to_floor);
  json["noise_floor"] = json_of(g.noise_floor_N);
  return json;
}

files::Json json_of(const residuals::LearningError::Quantiles& q) {
  return {{"p50", json_of(q.p50)}, {"p95", json_of(q.p95)}, {"p99", json_of(q.p99)}, {"max", json_of(q.max)}};
}

files::Json json_of(const residuals::TrajectoryErrors& trajectory) {
  if (!trajectory.refused.empty()) return {{"refused", trajectory.refused}};
  return {{"seconds", trajectory.seconds},
          {"pieces", trajectory.pieces},
          {"diverged", trajectory.diverged},
          {"rmse", json_of(trajectory.rmse)},
          {"max", json_of(trajectory.max)},
          {"measured_rms", json_of(trajectory.measured_rms)},
          {"measured_max", json_of(trajectory.measured_max)},
          {"simulated_rms", json_of(trajectory.simulated_rms)},
          {"simulated_max", json_of(trajectory.simulated_max)},
          {"replayed_max", json_of(trajectory.replayed_max)}};
}

files::Json json_of(const residuals::Trajectories& all) {
  if (!all.refused.empty()) return {{"refused", all.refused}};
  return {{"unit", "m"},
          {"loop", "sampled"},
          {"tracks", all.tracks},
          {"diverged", all.diverged},
          {"seconds", all.seconds},
          {"settle_s", residuals::TrajectoryErrors::kSettle_s},
          {"rmse", json_of(all.rmse_m)},
          {"max", json_of(all.max_m)},
          {"measured_rms", json_of(all.measured_rms_m)},
          {"simulated_rms", json_of(all.simulated_rms_m)}};
}

files::Json json_of(const residuals::Trajectories::PeakRatio& ratio) {
  if (ratio.tracks == 0) return nullptr;
  return {{"p50", json_of(ratio.p50)},
          {"p95", json_of(ratio.p95)},
          {"max", json_of(ratio.max)},
          {"coverage", json_of(ratio.coverage)},
          {"tracks", ratio.tracks}};
}

files::Json json_of(const residuals::NeighbourMap& map) {
  using Map = residuals::NeighbourMap;
  files::Json cells = files::Json::array();
  for (int i = 0; i < Map::kHeights; ++i) {
    for (int j = 0; j < Map::kLateral; ++j) {
      const Map::Cell& cell = map.cells[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      if (cell.records == 0) continue;
      const auto n = static_cast<double>(cell.records);
      cells.push_back({{"height_m", Map::kLowest_m + (i + 0.5) * Map::kHeightStep_m},
                       {"lateral_m", (j + 0.5) * Map::kLateralStep_m},
                       {"records", cell.records},
                       {"bias_z", cell.sum_N / n},
                       {"rmse_z", std::sqrt(cell.squares_N2 / n)}});
    }
  }
  return {
      {"meaning", "neighbour above the vehicle by height_m, laterally away by lateral_m; middles of cells"},
      {"cells", std::move(cells)}};
}

/// Sets the axes that cannot be judged to null in every {x, y, z} below `json`.
void blank_axes(files::Json& json, const Eigen::Vector3d& judged) {
  if (json.is_array()) {
    for (files::Json& element : json) blank_axes(element, judged);
  }
  if (!json.is_object()) return;
  const char* const kAxes[] = {"x", "y", "z"};
  const bool is_vector = json.contains("x") && json.contains("y") && json.contains("z");
  for (int k = 0; k < 3 && is_vector; ++k) {
    if (judged[k] == 0) json[kAxes[k]] = nullptr;
  }
  for (auto& [key, member] : json.items()) blank_axes(member, judged);
}

files::Json axes_of(const Eigen::Vector3d& judged) {
  files::Json axes = files::Json::array();
  const char* const kAxes[] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    if (judged[k] != 0) axes.push_back(kAxes[k]);
  }
  return axes;
}

const char* name(logs::ThrustSource source) {
  const char* const kNames[] = {"none", "duty and battery", "commanded force",
                                "multiples of the hover thrust"};
  return kNames[static_cast<int>(source)];
}

const char* name(logs::ForceSource source) {
  const char* const kNames[] = {"none", "accelerometer", "derivative of the velocity",
                                "second derivative of the position"};
  return kNames[static_cast<int>(source)];
}

files::Json slow_mean(const residuals::TorqueErrors& torque) {
  if (torque.slow_records == 0) return nullptr;
  return {{"unit", "N m"},
          {"slower_than_m_s", residuals::TorqueErrors::kSlow_m_s},
          {"records", torque.slow_records},
          {"mean", json_of(torque.slow_mean_Nm)}};
}

files::Json json_of(const residuals::TorqueErrors& torque) {
  if (!torque.refused.empty()) return {{"refused", torque.refused}, {"slow_flight", slow_mean(torque)}};
  return {{"unit", "N m"},
          {"records", torque.records},
          {"rate_hz", torque.rate_hz},
          {"slow_flight", slow_mean(torque)},
          {"rmse", json_of(torque.rmse_Nm)},
          {"bias", json_of(torque.bias_Nm)},
          {"max", json_of(torque.max_Nm)}};
}

/// The outcome for every log: axes with records that were compared.
std::vector<LogOutcome> outcomes_of(const Comparison& comparison, const residuals::Inputs& inputs) {
  std::map<std::string, const residuals::TrackErrors*> tracks;
  for (const residuals::TrackErrors& track : comparison.tracks) tracks[track.path] = &track;
  std::vector<LogOutcome> outcomes;
  for (const residuals::FlightFiles& flight : inputs.found.flights) {
    for (const auto& [vehicle, path] : flight.logs) {
      LogOutcome outcome;
      outcome.path = path;
      const auto found = tracks.find(path);
      outcome.opened = found != tracks.end();
      const bool is_used = outcome.opened && found->second->errors.statistics.samples > 0;
      if (!outcome.opened)
        outcome.left_out_why = "unreadable";
      else if (found->second->position_only)
        outcome.left_out_why = "only a neighbour";
      else if (!is_used)
        outcome.left_out_why = "no usable record";
      for (int k = 0; k < 3 && is_used; ++k) outcome.force[k] = found->second->judged[k] != 0;
      if (is_used) {
        const residuals::TorqueErrors& torque = found->second->torque;
        outcome.torque = torque.refused.empty() || torque.slow_records > 0;
        outcome.seconds = found->second->used_s;
      }
      outcomes.push_back(outcome);
    }
  }
  return outcomes;
}

/// The number of logs with a torque residual; if there are none, the reason.
files::Json torque_json(const Comparison& comparison) {
  std::size_t tracks = 0;
  std::string refused = "no vehicle has a model";
  for (const residuals::TrackErrors& track : comparison.tracks) {
    if (track.torque.refused.empty()) ++tracks;
    if (!track.torque.refused.empty() && !track.position_only) refused = track.torque.refused;
  }
  if (tracks == 0) return {{"refused", refused}};
  return {{"tracks", tracks}, {"where", "flights[].torque"}};
}

void print_torque(const Comparison& comparison) {
  const files::Json summary = torque_json(comparison);
  if (summary.contains("refused")) {
    fmt::print("Torque residual refused: {}.\n", summary["refused"].get<std::string>());
    const auto slow = std::count_if(comparison.tracks.begin(), comparison.tracks.end(),
                                    [](const auto& track) { return track.torque.slow_records > 0; });
    if (slow > 0) fmt::print("Mean torque in slow flight: {} logs, flights[].torque in the JSON.\n", slow);
    return;
  }
  for (const residuals::TrackErrors& track : comparison.tracks) {
    const residuals::TorqueErrors& t = track.torque;
    if (!t.refused.empty()) continue;
    fmt::print("Torque residual of {} {}, RMS x y z [uN m]: {:.1f} {:.1f} {:.1f}\n", track.flight,
               track.vehicle, 1e6 * t.rmse_Nm.x, 1e6 * t.rmse_Nm.y, 1e6 * t.rmse_Nm.z);
  }
}

files::Json json_of(const residuals::TrackErrors& track) {
  files::Json json = {
      {"flight", track.flight},
      {"scenario", track.scenario},
      {"vehicle", track.vehicle},
      {"kind", track.kind},
      {"composition", track.composition},
      {"file", track.path},
      {"position_only", track.position_only},
      {"clock", clock_of(track)},
      {"clock_offset_s", !track.has_reference_clock && !track.has_absolute_clock && track.clock_onsets == 0
                             ? files::Json(nullptr)
                             : files::Json(track.clock_offset_s)},
      {"clock_onsets", track.clock_onsets},
      {"findings", track.findings},
      {"plausibility", analysis::json_of(track.doubts)}};
  files::Json& records = json["records"] = files::Json::object();
  for (std::size_t k = 0; k < track.cut.size(); ++k)
    records[residuals::name(static_cast<residuals::Cut>(k))] = track.cut[k];
  files::Json errors = json_of(track.errors);
  if (!track.position_only) {
    const bool has_torque = track.torque.refused.empty() || track.torque.slow_records > 0;
    json["judged"] = {{"force", axes_of(track.judged)},
                      {"torque", axes_of(has_torque ? Eigen::Vector3d::Ones() : Eigen::Vector3d::Zero())}};
    json["thrust"] = name(track.thrust_source);
    json["specific_force"] = name(track.force_source);
    blank_axes(errors, track.judged);
  }
  json.update(errors);
  json["trajectory"] = json_of(track.trajectory);
  json["torque"] = json_of(track.torque);
  return json;
}

files::Json groups(const std::map<std::string, residuals::GroupErrors>& members) {
  files::Json json = files::Json::object();
  for (const auto& [name, errors] : members) json[name] = json_of(errors);
  return json;
}

}  // namespace

files::Json json_of(const residuals::VelocityError& error) {
  return {{"windows", error.windows},
          {"window_s", residuals::LearningError::kWindow_s},
          {"slope_s", residuals::kSlopeWindow_s},
          {"bandwidth_hz", residuals::LearningError::kBandwidth_hz},
          {"bias", json_of(error.bias_m_s)},
          {"amplitude", json_of(error.amplitude_m_s)},
          {"rate", json_of(error.rate_m_s2)},
          {"variation", json_of(error.variation_m_s)},
          {"impulse", json_of(error.impulse_m)}};
}

void add_comparison(const Comparison& comparison, const residuals::Inputs& inputs, files::Json& json) {
  json["unit"] = inputs.rules.per_mass ? "m/s^2" : "N";
  json["judged"] = {{"force", axes_of(comparison.judged)}};
  json["overall"] = json_of(comparison.overall);
  json["flights"] = files::Json::array();
  for (const residuals::TrackErrors& track : comparison.tracks) json["flights"].push_back(json_of(track));
  json["scenarios"] = groups(comparison.scenarios);
  json["vehicles"] = groups(comparison.vehicles);
  json["kinds"] = groups(comparison.kinds);
  json["compositions"] = groups(comparison.compositions);
  json["mean_square_z_gf2"] =
      inputs.rules.per_mass ? files::Json(nullptr) : files::Json(mean_squares_gf2(comparison));
  json["regions"] = files::Json::array();
  for (const residuals::RegionErrors& region : comparison.regions) {
    files::Json entry = {{"variable", residuals::variable_name(region.variable)},
                         {"words", region.words},
                         {"share", region.share}};
    entry.update(json_of(region.statistics));
    json["regions"].push_back(std::move(entry));
  }
  json["neighbour_map"] = json_of(comparison.neighbours);
  json["moments"] = files::Json::array();
  for (const residuals::Moment& moment : comparison.moments) {
    json["moments"].push_back({{"flight", moment.flight},
                               {"vehicle", moment.vehicle},
                               {"time_s", moment.time_s},
                               {"residual", json_of(moment.residual_N)}});
  }
  const residuals::LearningError& learning = comparison.learning_error;
  json["learning_error"] = {{"windows", learning.windows},
                            {"window_s", residuals::LearningError::kWindow_s},
                            {"bandwidth_hz", residuals::LearningError::kBandwidth_hz},
                            {"bias", json_of(learning.bias_N)},
                            {"amplitude", json_of(learning.amplitude_N)},
                            {"rate", json_of(learning.rate_N_s)},
                            {"variation", json_of(learning.variation_N)},
                            {"impulse", json_of(learning.impulse_N_s)},
                            {"peak_ratio", json_of(comparison.trajectories.peak_ratio)}};
  json["trajectory"] = json_of(comparison.trajectories);
  for (int k = 1; k < static_cast<int>(residuals::Cut::kCount); ++k) {
    const auto cut = static_cast<residuals::Cut>(k);
    json["cut_rules"][residuals::name(cut)] = residuals::rule(cut);
  }
  json["clocks"] = clocks_json(comparison);
  json["torque"] = torque_json(comparison);
  if (comparison.judged != Eigen::Vector3d::Ones()) {
    for (const char* key : {"overall", "scenarios", "vehicles", "kinds", "compositions", "regions", "moments",
                            "learning_error"})
      blank_axes(json[key], comparison.judged);
  }
  json["problems"] = comparison.problems;
  const std::vector<CollectionRow> rows = collection_rows(inputs.words, outcomes_of(comparison, inputs));
  if (!rows.empty()) json["collections"] = json_of(rows);
  json["left_out"] = inputs.found.left_out;
  json["skipped_files"] = inputs.found.skipped;
}

files::Json mean_squares_gf2(const Comparison& comparison) {
  files::Json json = files::Json::object();
  for (const auto& [name, group] : comparison.compositions)
    json[name] = std::pow(group.statistics.rmse.z / stability::kGramForce_N, 2);
  return json;
}

namespace {

void print_trajectories(const residuals::Trajectories& all) {
  if (!all.refused.empty()) {
    fmt::print("\nTrajectories were not simulated: {} (--gains).\n", all.refused);
    return;
  }
  fmt::print("\nClosed loop from the logs' set points, {}, {:.0f} s; RMS over x, y, z, vector [mm]:\n",
             counted(all.tracks, "track"), all.seconds);
  const auto line = [](const char* what, const residuals::Axes& a, double scale) {
    fmt::print("  {:<34}{:>9.2f}{:>9.2f}{:>9.2f}{:>9.2f}\n", what, scale * a.x, scale * a.y, scale * a.z,
               scale * a.total);
  };
  line("simulated minus measured", all.rmse_m, 1000);
  line("measured minus set point", all.measured_rms_m, 1000);
  line("simulated minus set point", all.simulated_rms_m, 1000);
  if (all.diverged > 0) fmt::print("  {} tracks diverged in simulation and are left out\n", all.diverged);
  const residuals::Trajectories::PeakRatio& ratio = all.peak_ratio;
  if (ratio.tracks == 0) return;
  fmt::print("Peaks, measured over replayed with the residual as force, {} tracks:\n", ratio.tracks);
  line("median", ratio.p50, 1);
  line("95 % of tracks below", ratio.p95, 1);
  line("share of tracks that replay covers", ratio.coverage, 1);
}

void print_compositions(const Comparison& comparison, const Comparison* own,
                        const residuals::ForceUnit& unit) {
  fmt::print("\n{:<28}{:>9}{:>16}{}\n", "Kinds: neighbours 2 vehicle", "records",
             fmt::format("z, mean [{}^2]", unit.name), own != nullptr ? "   with own filter" : "");
  for (const auto& [name, group] : comparison.compositions) {
    fmt::print("{:<28}{:>9}{:>16.2f}", name, group.statistics.samples,
               std::pow(group.statistics.rmse.z / unit.size_N, 2));
    if (own != nullptr) {
      const auto same = own->compositions.find(name);
      if (same != own->compositions.end())
        fmt::print("{:>18.2f}", std::pow(same->second.statistics.rmse.z / unit.size_N, 2));
    }
    fmt::print("\n");
  }
}

void print_errors(const Comparison& comparison, const Comparison* own, const residuals::ForceUnit& unit,
                  bool per_mass) {
  print_torque(comparison);
  fmt::print("\n");
  fmt::print("{:<28}{:>9}{:>22}{:>22}{:>10}{:>9}\n", "", "records", fmt::format("RMSE x y z [{}]", unit.name),
             fmt::format("bias x y z [{}]", unit.name), "p99.9 z", "max z");
  const auto cell = [&](double value, int axis) {
    return comparison.judged[axis] == 0 ? std::string("-") : fmt::format("{:.2f}", value / unit.size_N);
  };
  const auto line = [&](const std::string& name, const residuals::GroupErrors& group) {
    const residuals::ErrorStatistics& s = group.statistics;
    fmt::print("{:<28}{:>9}{:>8}{:>7}{:>7}{:>8}{:>7}{:>7}{:>10}{:>9}\n", name, s.samples, cell(s.rmse.x, 0),
               cell(s.rmse.y, 1), cell(s.rmse.z, 2), cell(s.bias.x, 0), cell(s.bias.y, 1), cell(s.bias.z, 2),
               cell(s.p999.z, 2), cell(s.max.z, 2));
  };
  for (const auto& [name, errors] : comparison.scenarios) line(name, errors);
  for (const auto& [name, errors] : comparison.vehicles) line(name, errors);
  line("all", comparison.overall);
  if (!per_mass || comparison.compositions.size() > 1) print_compositions(comparison, own, unit);
  const auto& interval = comparison.overall.rmse_interval;
  fmt::print("\nRMSE of all: {:.4f} {}, 90 % interval {:.4f} .. {:.4f}; {:.1f} % of the weight.\n",
             comparison.overall.statistics.rmse.total, per_mass ? unit.name : "N", interval[3].lower,
             interval[3].upper, 100 * comparison.overall.nrmse.total);
  fmt::print("\nWhere it fails most:\n");
  for (std::size_t i = 0; i < comparison.regions.size() && i < 8; ++i) {
    const residuals::RegionErrors& region = comparison.regions[i];
    fmt::print("  {} ({} records)\n", region.words, region.statistics.samples);
  }
  if (!comparison.moments.empty()) {
    const residuals::Moment& worst = comparison.moments[0];
    fmt::print("Worst moment: {} {} at {:.2f} s, {:.2f} {}\n", worst.flight, worst.vehicle, worst.time_s,
               worst.residual_N.norm() / unit.size_N, unit.name);
  }
  print_trajectories(comparison.trajectories);
}

/// Names the vehicles of a flights.toml and the vehicles that flew instead.
std::string vehicles_without_model(const residuals::Inputs& inputs) {
  std::set<std::string> flown;
  for (const residuals::FlightFiles& flight : inputs.found.flights) {
    for (const auto& [vehicle, path] : flight.logs) flown.insert(vehicle);
  }
  std::string known;
  for (const auto& [vehicle, use] : inputs.fleet) known += (known.empty() ? "" : ", ") + vehicle;
  return fmt::format("flights.toml names {}; the logs are of {}.", known, fmt::join(flown, ", "));
}

}  // namespace

void print_comparison(const Comparison& comparison, const residuals::Inputs& inputs, const Comparison* own) {
  for (const stability::Model& model : inputs.models) {
    if (inputs.rules.per_mass) break;
    fmt::print("Model {}: {}, {}, {}\n", model.path, model.kind, residuals::mass_text(model.mass_kg),
               counted(model.effects.size(), "effect"));
  }
  fmt::print("{}; force residual f_a = m a - model, in the world.\n",
             counted(inputs.found.flights.size(), "flight"));
  if (inputs.rules.per_mass) {
    fmt::print(
        "No model is known: residuals are per mass, and thrust is in multiples of each log's hover thrust, "
        "so the mean vertical force is meaningless.\n");
    if (!inputs.fleet.empty()) fmt::print("{}\n", vehicles_without_model(inputs));
  }
  for (const std::string& pattern : residuals::patterns_without_log(inputs.log_rules, inputs.found))
    fmt::print("flights.toml: [log.\"{}\"] matches none of these logs.\n", pattern);
  print_cuts(comparison);
  if (comparison.overall.statistics.samples > 0)
    print_errors(comparison, own, residuals::force_unit(inputs), inputs.rules.per_mass);
  for (const std::string& left_out : inputs.found.left_out) fmt::print("left out: {}\n", left_out);
  print_doubts(comparison);
  for (const std::string& problem : comparison.problems) fmt::print("not judged: {}\n", problem);
  if (!inputs.found.skipped.empty())
    fmt::print("Skipped, no flight logs: {}\n", counted(inputs.found.skipped.size(), "file"));
  const std::vector<CollectionRow> rows = collection_rows(inputs.words, outcomes_of(comparison, inputs));
  if (rows.size() > 1) print_collections(rows, "of the records that were compared");
}

}  // namespace swarmcert::analysis
