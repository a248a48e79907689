#include "analysis/commands/study/study_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include "analysis/cli/command_line.h"
#include "analysis/commands/add/add_report.h"
#include "analysis/commands/compare/compare_report.h"
#include "analysis/commands/diagnose/diagnose_report.h"
#include "analysis/commands/diagnose/remainder_output.h"
#include "analysis/commands/shared/effect_output.h"
#include "analysis/report/report.h"
#include "analysis/report/report_text.h"
#include "nn/base/file_io.h"

namespace swarmcert::analysis {
namespace {

using identification::EffectCurve;
using identification::RoomMap;
using identification::Study;

/// gnuplot commands for two maps of NAME.dat on one colour scale, columns 3 (before) and 4 (after).
std::string two_maps(const std::string& name, const std::string& x, const std::string& y,
                     const residuals::ForceUnit& unit) {
  const std::string file = "'" + name + ".dat'";
  return "stats " + file + " using 3 nooutput\nlow = STATS_min; high = STATS_max\nstats " + file +
         " using 4 nooutput\nlow = STATS_min < low ? STATS_min : low\n"
         "high = STATS_max > high ? STATS_max : high\nm = -low > high ? -low : high\n"
         "set cbrange [-(m > 0 ? m : 1):(m > 0 ? m : 1)]\nset palette @signed_colours\nset key off\n"
         "set xlabel '" +
         x + "'\nset ylabel '" + y + "'\nset xtics rotate by -45\nset cblabel 'mean vertical residual [" +
         unit.name +
         "]'\nif (exists('narrow')) { set multiplot layout 2,1 } else { set multiplot layout 1,2 }\n"
         "set title 'before'\nplot " +
         file + " using 1:2:3 with image\nset title 'after'\nplot " + file +
         " using 1:2:4 with image\nunset multiplot\n";
}

std::string cell_text(std::size_t records, double newton, const residuals::ForceUnit& unit) {
  constexpr std::size_t kFewest = 20;
  return records >= kFewest ? fmt::format("{:.6g}", newton * unit.per_newton()) : "NaN";
}

void add_room(Report& report, const RoomMap& map, const residuals::ForceUnit& unit) {
  if (map.cells.empty()) return;
  std::string data = "# x_m y_m before after\n";
  for (int j = 0; j < RoomMap::kCells; ++j) {
    for (int i = 0; i < RoomMap::kCells; ++i) {
      const RoomMap::Cell& cell = map.cells[static_cast<std::size_t>(j * RoomMap::kCells + i)];
      data += fmt::format("{:.6g} {:.6g} {} {}\n", map.lower_m[0] + (i + 0.5) * map.step_m[0],
                          map.lower_m[1] + (j + 0.5) * map.step_m[1],
                          cell_text(cell.records, cell.before_N, unit),
                          cell_text(cell.records, cell.after_N, unit));
    }
    data += "\n";
  }
  report.figure("room", data, two_maps("room", "x [m]", "y [m]", unit),
                "Mean vertical residual over the place in the room, before and after, on one colour scale; "
                "cells of fewer than 20 records are empty.");
}

void add_neighbours(Report& report, const residuals::NeighbourMap& before,
                    const residuals::NeighbourMap& after, const residuals::ForceUnit& unit) {
  using Map = residuals::NeighbourMap;
  std::string data = "# lateral_m height_m before after\n";
  bool any = false;
  for (std::size_t i = 0; i < Map::kHeights; ++i) {
    for (std::size_t j = 0; j < Map::kLateral; ++j) {
      const auto text = [&](const Map& map) {
        const Map::Cell& cell = map.cells[i][j];
        return cell_text(cell.records,
                         cell.sum_N / static_cast<double>(std::max<std::size_t>(1, cell.records)), unit);
      };
      const std::string shown = text(before);
      any = any || shown != "NaN";
      data += fmt::format("{:.6g} {:.6g} {} {}\n", (static_cast<double>(j) + 0.5) * Map::kLateralStep_m,
                          Map::kLowest_m + (static_cast<double>(i) + 0.5) * Map::kHeightStep_m, shown,
                          text(after));
    }
    data += "\n";
  }
  if (!any) return;
  report.figure(
      "neighbours", data,
      two_maps("neighbours", "lateral distance [m]", "height of the neighbour above [m]", unit),
      "Mean vertical residual over the place of the laterally nearest neighbour, before and after, on "
      "one colour scale.");
}

/// The residual's mean over the ranges of one variable, before and after.
void add_variable(Report& report, const residuals::Comparison& before, const residuals::Comparison& after,
                  int variable, const residuals::ForceUnit& unit) {
  const auto mean_of = [&](const residuals::Comparison& comparison,
                           int region) -> const residuals::RegionErrors* {
    for (const residuals::RegionErrors& candidate : comparison.regions)
      if (candidate.variable == variable && candidate.region == region) return &candidate;
    return nullptr;
  };
  std::string data = "# value before after\n";
  int points = 0;
  for (int region = 0; region < residuals::num_regions(variable); ++region) {
    const residuals::RegionErrors* was = mean_of(before, region);
    const residuals::RegionErrors* is = mean_of(after, region);
    if (was == nullptr || is == nullptr) continue;
    ++points;
    data +=
        fmt::format("{:.6g} {:.6g} {:.6g}\n", residuals::region_middle(variable, region),
                    was->statistics.bias.z * unit.per_newton(), is->statistics.bias.z * unit.per_newton());
  }
  if (points < 2) return;
  const std::string label = residuals::variable_name(variable), name = fmt::format("over_{}", variable);
  const std::string axis = label + " " + kVariableUnits[variable];
  report.figure(name, data,
                "set xlabel '" + axis + "'\nset ylabel 'mean vertical residual [" + unit.name + "]'\nplot '" +
                    name +
                    ".dat' using 1:2 with linespoints title 'before', '' using 1:3 with linespoints title "
                    "'after', 0 linecolor 'gray' notitle\n",
                "Mean vertical residual over " + label + ", before and after.");
}

void add_effects(Report& report, const Study& study, const residuals::ForceUnit& unit) {
  std::size_t number = 0;
  for (const EffectCurve& curve : study.pictures.effects) {
    std::string data = "# predicted measured standard_error records\n";
    for (const EffectCurve::Point& point : curve.points)
      data +=
          fmt::format("{:.6g} {:.6g} {:.6g} {}\n", point.predicted_N * unit.per_newton(),
                      point.measured_N * unit.per_newton(), point.error_N * unit.per_newton(), point.records);
    const std::string name = fmt::format("effect_{}", ++number);
    report.figure(
        name, data,
        fmt::format(
            "set xlabel {0}\nset ylabel {1}\nset key top left\nplot x title 'the fitted formula' "
            "linecolor 'gray', '{2}.dat' using 1:2:(1.645*$3) with yerrorbars title 'measured, 90 %'\n",
            plot_string(fmt::format("{} as fitted, along {} [{}]", curve.effect, curve.axis, unit.name)),
            plot_string(fmt::format("measured without it [{}]", unit.name)), name),
        "Effect " + curve.effect +
            ": what was measured where the model has every effect but this one, over what this one "
            "predicts. Points on the line confirm the fit.");
  }
}

void add_findings(Report& report, const Study& study) {
  std::vector<std::vector<std::string>> rows;
  for (const stability::EffectSpec& effect : study.ladder.model.effects) {
    for (const auto& [parameter, value] : effect.parameters) {
      const auto interval = effect.fit.interval.find(parameter);
      const double beyond = shown_beyond_file(effect.name, parameter);
      rows.push_back({effect.name, parameter, fmt::format("{:.4g}", beyond + value),
                      interval == effect.fit.interval.end()
                          ? "-"
                          : fmt::format("{:.4g} .. {:.4g}", beyond + interval->second.first,
                                        beyond + interval->second.second)});
    }
  }
  if (!rows.empty()) report.table({"effect", "parameter", "value", "90 % interval"}, rows);
  rows.clear();
  for (const identification::Missing& missing : study.diagnosis.ranking) {
    std::string rivals;
    for (const identification::Rival& rival : missing.finding.rivals)
      rivals += (rivals.empty() ? "" : ", ") + rival.effect;
    if (!rivals.empty() || missing.equivalence_class != missing.effect)
      rows.push_back({missing.effect, missing.equivalence_class, rivals, missing.excitation});
  }
  if (!rows.empty())
    report.table(
        {"effect", "cannot be told apart in flight", "rivals on these flights", "flights that separate"},
        rows);
}

void add_moments(Report& report, const Study& study, const residuals::ForceUnit& unit) {
  std::vector<ShownMoment> shown;
  for (const residuals::Moment& moment : study.before.all.moments) {
    for (const residuals::TrackErrors& track : study.before.all.tracks) {
      if (track.path != moment.path) continue;
      shown.push_back({series_name(track), moment.time_s, track.flight, moment.time_s - track.clock_offset_s,
                       fmt::format("{:.3g} {}", moment.residual_N.norm() * unit.per_newton(), unit.name)});
    }
  }
  if (shown.empty()) return;
  report.paragraph("The worst moments of the given model, means over 0.1 s:");
  report.moments(shown);
}

std::size_t count_flights(const residuals::Comparison& comparison) {
  std::set<std::string> flights;
  for (const residuals::TrackErrors& track : comparison.tracks) flights.insert(track.flight);
  return flights.size();
}

void add_replay(Report& report, const Study& study, const residuals::ForceUnit& unit) {
  std::vector<Replay> flights;
  for (const identification::ReplayFlight& flight : study.replay) {
    Replay replay{flight.name, {}};
    for (const identification::ReplayVehicle& vehicle : flight.vehicles) {
      replay.vehicles.push_back({vehicle.name, vehicle.rows});
      for (std::array<float, 10>& row : replay.vehicles.back().rows)
        for (std::size_t k = 4; k < row.size(); ++k) row[k] *= static_cast<float>(unit.per_newton());
    }
    flights.push_back(std::move(replay));
  }
  if (flights.empty()) return;
  report.heading("In space");
  report.replay(flights, unit.name,
                fmt::format("{} of {} flights, those with the worst moments first. Arrows are the residual "
                            "force on each vehicle under the given and under the fitted model; trails are "
                            "4 s long. Drag, or use the arrow keys, to turn; + and - zoom.",
                            flights.size(), count_flights(study.before.all)));
}

std::string write_page(const Study& study, const residuals::ForceUnit& unit, const files::Json& result,
                       const std::string& folder) {
  Report report("What does the model lack?");
  report.made_by(command_to_copy());
  report.result(result);
  report.paragraph(headline(study, unit));
  report.heading("Where the model failed");
  add_neighbours(report, study.before.all.neighbours, study.after.all.neighbours, unit);
  add_room(report, study.pictures.room, unit);
  for (int variable = 0; variable < kPlottedVariables; ++variable)
    add_variable(report, study.before.all, study.after.all, variable, unit);
  add_moments(report, study, unit);
  report.heading("What was missing");
  if (study.pictures.effects.empty()) report.paragraph("No effect was added.");
  add_effects(report, study, unit);
  add_findings(report, study);
  report.heading("How the error fell");
  add_ladder_figure(report, study.ladder.rows, "ladder", unit.name, unit.per_newton());
  report.heading("What is left, and what to fly next");
  add_left(report, study.diagnosis);
  add_remainder(report, study.diagnosis, 1);
  const std::vector<std::string> next = next_flights(study);
  if (next.empty())
    report.paragraph("These flights leave no question open that another flight would answer.");
  for (const std::string& flight : next) report.paragraph("Fly " + flight + ".");
  add_time_series(report, study.after.all, &study.before.all, unit.name, unit.per_newton());
  add_replay(report, study, unit);
  return report.write(folder, true, "study.html");
}

}  // namespace

std::string write_study_folder(const Study& study, const residuals::ForceUnit& unit,
                               const files::Json& result, const std::string& folder) {
  const std::filesystem::path path(folder);
  std::filesystem::create_directories(path);
  if (study.ladder.any_accepted) {
    files::write_file(
        (path / "fitted.toml").string(),
        stability::to_toml(study.ladder.model, {"Effects fitted to flights by swarmcert study."}), true);
  }
  files::write_file((path / "study.json").string(), files::to_text(result), true);
  return write_page(study, unit, result, folder);
}

}  // namespace swarmcert::analysis
