#include "analysis/commands/compare/compare_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "analysis/cli/command_line.h"
#include "analysis/commands/shared/prediction_output.h"
#include "analysis/commands/shared/report_head.h"
#include "analysis/commands/shared/time_plots.h"
#include "analysis/report/report.h"
#include "analysis/residuals/failing_place.h"
#include "analysis/residuals/force_unit.h"

namespace swarmcert::analysis {
namespace {

/// Formats with two decimals, or with three significant digits if two decimals would lose too much.
std::string in_unit(double newton, const residuals::ForceUnit& unit) {
  const double value = newton / unit.size_N;
  return std::abs(value) < 1 ? fmt::format("{:.3g}", value) : fmt::format("{:.2f}", value);
}

std::vector<std::string> row(const std::string& name, const residuals::GroupErrors& group,
                             const residuals::ForceUnit& unit) {
  const residuals::ErrorStatistics& s = group.statistics;
  const auto gf = [&unit](double newton) { return in_unit(newton, unit); };
  return {name,
          std::to_string(s.samples),
          gf(s.rmse.x),
          gf(s.rmse.y),
          gf(s.rmse.z),
          group.rmse_interval
              ? gf((*group.rmse_interval)[2].lower) + " .. " + gf((*group.rmse_interval)[2].upper)
              : "-",
          gf(s.bias.z),
          gf(s.p95.z),
          gf(s.p999.z),
          gf(s.max.z),
          fmt::format("{:.1f} %", 100 * group.nrmse.total),
          fmt::format("{:.1f} %", 100 * s.variance_explained.total),
          fmt::format("{:.1f}", group.low_band_to_floor.z())};
}

const std::vector<std::string> kHeader = {"",
                                          "records",
                                          "RMSE x",
                                          "y",
                                          "z",
                                          "90 % of z",
                                          "bias z",
                                          "p95 z",
                                          "p99.9 z",
                                          "max z",
                                          "of weight",
                                          "variance explained",
                                          "low band / floor"};

/// Plots mean and spread of the vertical residual over the ranges of one variable.
void add_region_plot(Report& report, const residuals::Comparison& comparison, int variable,
                     const std::string& variable_unit, const residuals::ForceUnit& unit) {
  std::vector<const residuals::RegionErrors*> regions;
  for (const residuals::RegionErrors& region : comparison.regions) {
    if (region.variable == variable) regions.push_back(&region);
  }
  if (regions.size() < 2) return;
  std::sort(regions.begin(), regions.end(),
            [](const auto* a, const auto* b) { return a->region < b->region; });
  std::string data;
  for (const residuals::RegionErrors* region : regions) {
    const residuals::ErrorStatistics& s = region->statistics;
    data += fmt::format("{} {} {}\n", residuals::region_middle(variable, region->region),
                        s.bias.z / unit.size_N, s.rmse.z / unit.size_N);
  }
  const std::string name = fmt::format("over_{}", variable);
  const std::string label = residuals::variable_name(variable);
  report.figure(name, data,
                "set xlabel '" + label + " " + variable_unit + "'\nset ylabel 'vertical residual [" +
                    unit.name + "]'\nplot '" + name +
                    ".dat' using 1:2 with linespoints title 'mean', '' using 1:3 with linespoints title "
                    "'root mean square', 0 lc 'gray' notitle\n",
                "Vertical residual over " + label + ".");
}

/// Plots the mean vertical residual over the position of the nearest neighbour.
void add_neighbour_map(Report& report, const residuals::NeighbourMap& map, const residuals::ForceUnit& unit) {
  using Map = residuals::NeighbourMap;
  constexpr std::size_t kFewest = 20;
  std::string data;
  bool any = false;
  for (int i = 0; i < Map::kHeights; ++i) {
    for (int j = 0; j < Map::kLateral; ++j) {
      const Map::Cell& cell = map.cells[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      const bool enough = cell.records >= kFewest;
      any = any || enough;
      data += fmt::format("{} {} {}\n", (j + 0.5) * Map::kLateralStep_m,
                          Map::kLowest_m + (i + 0.5) * Map::kHeightStep_m,
                          enough ? in_unit(cell.sum_N / static_cast<double>(cell.records), unit) : "NaN");
    }
    data += "\n";
  }
  if (!any) return;
  report.figure(
      "neighbours", data,
      "stats 'neighbours.dat' using 3 nooutput\n"
      "m = abs(STATS_min) > abs(STATS_max) ? abs(STATS_min) : abs(STATS_max)\n"
      "set xlabel 'lateral distance [m]'\nset ylabel 'height of the neighbour above the vehicle [m]'\n"
      "set cblabel 'mean vertical residual [" +
          std::string(unit.name) +
          "]'\nset palette @signed_colours\nset xrange [0:0.6]\nset "
          "yrange [-1:1]\n"
          "set cbrange [-(m > 0 ? m : 1):(m > 0 ? m : 1)]\n"
          "plot 'neighbours.dat' using 1:2:3 with image notitle\n",
      "Mean vertical residual over the place of the laterally nearest neighbour; cells of fewer than 20 "
      "records are empty.");
}

void add_trajectories(Report& report, const residuals::Comparison& comparison) {
  const residuals::Trajectories& all = comparison.trajectories;
  report.heading("Closed loop from the logs' set points");
  if (!all.refused.empty()) {
    report.paragraph("Not simulated: " + all.refused + " (--gains).");
    return;
  }
  const auto row = [](const std::string& name, const residuals::Axes& a, double scale) {
    return std::vector<std::string>{name, fmt::format("{:.2f}", scale * a.x),
                                    fmt::format("{:.2f}", scale * a.y), fmt::format("{:.2f}", scale * a.z),
                                    fmt::format("{:.2f}", scale * a.total)};
  };
  report.paragraph(fmt::format("{} logs, {:.0f} s, sampled loop; {} diverged and are left out.", all.tracks,
                               all.seconds, all.diverged));
  std::vector<std::vector<std::string>> rows = {
      row("simulated minus measured, RMS [mm]", all.rmse_m, 1000),
      row("measured minus set point, RMS [mm]", all.measured_rms_m, 1000),
      row("simulated minus set point, RMS [mm]", all.simulated_rms_m, 1000)};
  if (all.peak_ratio.tracks > 0) {
    rows.push_back(row("peaks, measured over replayed: median", all.peak_ratio.p50, 1));
    rows.push_back(row("95 % of logs below", all.peak_ratio.p95, 1));
    rows.push_back(row("share of logs that replay covers", all.peak_ratio.coverage, 1));
  }
  report.table({"", "x", "y", "z", "vector"}, rows);
}

void add_learning_error(Report& report, const residuals::LearningError& learning,
                        const residuals::ForceUnit& unit) {
  report.heading("Values that bound --from uses from these flights");
  report.paragraph(fmt::format(
      "Quantiles over {} windows of {} s of the residual behind a low-pass of {} Hz; bias: "
      "mean of a flight.",
      learning.windows, residuals::LearningError::kWindow_s, residuals::LearningError::kBandwidth_hz));
  std::vector<std::vector<std::string>> rows;
  const auto add = [&rows, &unit](const std::string& name, const residuals::LearningError::Quantiles& q) {
    const auto cell = [&unit](const residuals::Axes& a) {
      const double factor = unit.per_newton();
      return fmt::format("{:.3g} {:.3g} {:.3g}", factor * a.x, factor * a.y, factor * a.z);
    };
    rows.push_back({name, cell(q.p50), cell(q.p95), cell(q.p99), cell(q.max)});
  };
  const std::string force = unit.name;
  add("bias [" + force + "]", learning.bias_N);
  add("amplitude [" + force + "]", learning.amplitude_N);
  add("rate [(" + force + ")/s]", learning.rate_N_s);
  add("variation per pass [" + force + "]", learning.variation_N);
  add("impulse per pass [" + force + " s]", learning.impulse_N_s);
  report.table({"x y z", "median", "95 %", "99 %", "largest"}, rows);
}

}  // namespace

std::string write_compare_report(const CompareResult& result,
                                 const std::vector<residuals::FlownFlight>& flights,
                                 const residuals::ForceUnit& unit, const files::Node& described,
                                 const std::string& folder, bool overwrite) {
  const residuals::Comparison& comparison = result.comparison;
  const residuals::Inputs& inputs = result.inputs;
  Report report("Model against flights");
  report.made_by(command_to_copy());
  report.result(described);
  add_report_head(report, inputs, comparison, nullptr);
  report.paragraph(
      "Force residual: mass times measured specific force minus thrust and effects, in the world frame, in " +
      std::string(unit.name) + (inputs.rules.per_mass ? ": no mass is known. " : ". ") +
      "A torque residual needs logs of at least 400 Hz: slower ones alias what the attitude loop does.");
  report.heading("Scenarios and vehicles");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, errors] : comparison.scenarios) rows.push_back(row(name, errors, unit));
  for (const auto& [name, errors] : comparison.vehicles) rows.push_back(row(name, errors, unit));
  rows.push_back(row("all", comparison.overall, unit));
  report.table(kHeader, rows);
  report.paragraph("By kinds of vehicles:");
  rows.clear();
  for (const auto& [name, errors] : comparison.compositions)
    rows.push_back(row(comparison.composition_words.at(name), errors, unit));
  report.table(kHeader, rows);

  report.heading("Where the model fails");
  rows.clear();
  for (std::size_t i = 0; i < comparison.regions.size() && i < 12; ++i) {
    const residuals::RegionErrors& region = comparison.regions[i];
    rows.push_back({residuals::region_words(region, unit), std::to_string(region.statistics.samples),
                    in_unit(region.statistics.rmse.total, unit),
                    fmt::format("{:.1f} %", 100 * region.share)});
  }
  report.table({"region", "records", std::string("RMSE [") + unit.name + "]",
                "share of all squared residual in its mean"},
               rows);
  for (int variable = 0; variable < kPlottedVariables; ++variable)
    add_region_plot(report, comparison, variable, kVariableUnits[variable], unit);
  add_neighbour_map(report, comparison.neighbours, unit);
  add_moments(report, comparison, unit);
  add_flown(report, flights, comparison, unit);
  add_trajectories(report, comparison);
  add_learning_error(report, comparison.learning_error, unit);
  if (result.prediction) {
    report.heading("Prediction");
    add_prediction(report, {{"model", *result.prediction}});
  }

  report.heading("Flights");
  rows.clear();
  for (const residuals::TrackErrors& track : comparison.tracks)
    if (!track.position_only) rows.push_back(row(track.flight + " " + track.vehicle, track.errors, unit));
  report.table(kHeader, rows);
  report.heading("What was cut, and why");
  rows.clear();
  for (int k = 1; k < static_cast<int>(residuals::Cut::kCount); ++k) {
    const auto cut = static_cast<residuals::Cut>(k);
    rows.push_back({name(cut), rule(cut)});
  }
  report.table({"cut", "rule"}, rows);
  rows.clear();
  for (const residuals::TrackErrors& track : comparison.tracks) {
    std::string cuts, findings;
    for (std::size_t k = 1; k < track.cut.size(); ++k) {
      if (track.cut[k] > 0)
        cuts += fmt::format("{}{} {}", cuts.empty() ? "" : ", ", track.cut[k],
                            name(static_cast<residuals::Cut>(k)));
    }
    for (const std::string& finding : track.findings) findings += (findings.empty() ? "" : "; ") + finding;
    for (const logs::Doubt& doubt : track.doubts) findings += (findings.empty() ? "" : "; ") + doubt.words;
    rows.push_back({track.flight + " " + track.vehicle, track.position_only ? "position only" : cuts,
                    findings,
                    track.has_reference_clock || track.has_absolute_clock || track.clock_onsets > 0
                        ? fmt::format("{:.0f} ms", 1000 * track.clock_offset_s)
                        : "not estimated"});
  }
  report.table({"", "records cut", "the log", "clock offset"}, rows);
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
