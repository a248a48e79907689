#include "analysis/commands/compare/compare_output.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "analysis/cli/counted.h"
#include "analysis/commands/compare/compare_result.h"
#include "analysis/commands/compare/log_output.h"
#include "analysis/commands/shared/character_plot.h"
#include "analysis/commands/shared/flight_options.h"
#include "analysis/residuals/failing_place.h"

namespace swarmcert::analysis {
namespace {

using residuals::Comparison;

void print_torque(const Comparison& comparison) {
  const TorqueSummary summary = torque_summary(comparison);
  if (summary.tracks == 0) {
    fmt::print("Torque residual refused: {}.\n", summary.refused);
    const auto slow = std::count_if(comparison.tracks.begin(), comparison.tracks.end(),
                                    [](const auto& track) { return track.torque.slow_records > 0; });
    if (slow > 0)
      fmt::print(
          "Mean torque in slow flight (in all flight where no speed is known): {} logs, flights[].torque in "
          "the JSON.\n",
          slow);
    return;
  }
  for (const residuals::TrackErrors& track : comparison.tracks) {
    const residuals::TorqueErrors& t = track.torque;
    if (!t.refused.empty()) continue;
    fmt::print("Torque residual of {} {}, RMS x y z [uN m]: {:.1f} {:.1f} {:.1f}\n", track.flight,
               track.vehicle, 1e6 * t.rmse_Nm.x, 1e6 * t.rmse_Nm.y, 1e6 * t.rmse_Nm.z);
  }
}

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
  fmt::print("\n{:<28}{:>9}{:>16}{}\n", "Mean square by kinds", "records", fmt::format("z [{}^2]", unit.name),
             own != nullptr ? "   with own filter" : "");
  for (const auto& [name, group] : comparison.compositions) {
    fmt::print("{:<28}{:>9}{:>16.2f}", comparison.composition_words.at(name), group.statistics.samples,
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
  fmt::print("\nRMSE of all: {:.3g} {}, {}; {:.1f} % of the weight.\n",
             unit.per_newton() * comparison.overall.statistics.rmse.total, unit.name,
             interval
                 ? fmt::format("90 % interval {:.3g} .. {:.3g}", unit.per_newton() * (*interval)[3].lower,
                               unit.per_newton() * (*interval)[3].upper)
                 : "no interval: too short a flight",
             100 * comparison.overall.nrmse.total);
  if (!per_mass) {
    const residuals::FailingPlace fails = residuals::failing_place(comparison, unit);
    fmt::print("\n{}\n{}", sentence(fails), character_plot(comparison, fails, unit));
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

void print_comparison(const Comparison& comparison, const residuals::Inputs& inputs, const Comparison* own,
                      const residuals::ForceUnit& unit) {
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
    print_errors(comparison, own, unit, inputs.rules.per_mass);
  else if (std::any_of(comparison.tracks.begin(), comparison.tracks.end(),
                       [](const residuals::TrackErrors& track) { return !track.position_only; }))
    print_torque(comparison);
  for (const std::string& left_out : inputs.found.left_out) fmt::print("left out: {}\n", left_out);
  print_doubts(comparison);
  for (const std::string& problem : comparison.problems) fmt::print("not judged: {}\n", problem);
  if (!inputs.found.skipped.empty())
    fmt::print("Skipped, no flight logs: {}\n", counted(inputs.found.skipped.size(), "file"));
  const std::vector<CollectionRow> rows = collection_rows(inputs.words, outcomes_of(comparison, inputs));
  if (rows.size() > 1) print_collections(rows, "of the records that were compared");
}

}  // namespace swarmcert::analysis
