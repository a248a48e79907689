#include "analysis/compare_report.h"

#include <fmt/core.h>

#include <algorithm>

#include "analysis/report.h"

namespace swarmcert::analysis {
namespace {

constexpr double kGramForce_N = stability::kGramForce_N;

std::string gf(double newton) { return fmt::format("{:.2f}", newton / kGramForce_N); }

std::vector<std::string> row(const std::string& name, const residuals::GroupErrors& group) {
  const residuals::ErrorStatistics& s = group.statistics;
  return {name,
          std::to_string(s.samples),
          gf(s.rmse.x),
          gf(s.rmse.y),
          gf(s.rmse.z),
          gf(group.rmse_interval[2].lower) + " .. " + gf(group.rmse_interval[2].upper),
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

/// Mean and spread of the vertical residual over the ranges of one variable.
void add_region_plot(Report& report, const residuals::Comparison& comparison, int variable,
                     const std::string& unit) {
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
                        s.bias.z / kGramForce_N, s.rmse.z / kGramForce_N);
  }
  const std::string name = fmt::format("over_{}", variable);
  const std::string label = residuals::variable_name(variable);
  report.figure(
      name, data,
      "set key outside top right\nset grid\nset xlabel '" + label + " " + unit +
          "'\nset ylabel 'vertical residual [gf]'\nplot '" + name +
          ".dat' using 1:2 with linespoints pt 7 title 'mean', '' using 1:3 with linespoints pt 6 title "
          "'root mean square', 0 lc 'gray' notitle\n",
      "Vertical residual over " + label + ".");
}

/// The flight with the worst moment.
void add_time_series(Report& report, const residuals::Comparison& comparison) {
  if (comparison.moments.empty()) return;
  const residuals::Moment& worst = comparison.moments[0];
  for (const residuals::TrackErrors& track : comparison.tracks) {
    if (track.flight != worst.flight || track.vehicle != worst.vehicle) continue;
    std::string data;
    for (std::size_t i = 0; i < track.time_s.size(); ++i) {
      data += fmt::format("{} {} {}\n", track.time_s[i],
                          static_cast<double>(track.residual_z_N[i]) / kGramForce_N,
                          static_cast<double>(track.nominal_z_N[i]) / kGramForce_N);
    }
    data += "\n\n";
    for (const residuals::Moment& moment : comparison.moments) {
      if (moment.flight == worst.flight && moment.vehicle == worst.vehicle)
        data += fmt::format("{} {}\n", moment.time_s, moment.residual_N.z() / kGramForce_N);
    }
    report.figure(
        "time", data,
        "set key outside top right\nset grid\nset xlabel 'time on the log [s]'\n"
        "set ylabel 'vertical residual [gf]'\nplot 'time.dat' index 0 using 1:3 with lines lc 'gray' title "
        "'without effects', '' index 0 using 1:2 with lines lw 1.5 title 'model', '' index 1 using 1:2 with "
        "points pt 7 lc 'red' title 'worst'\n",
        "The vertical residual of " + worst.vehicle + " in " + worst.flight +
            ", the flight with the worst moment.");
    return;
  }
}

}  // namespace

std::string write_compare_report(const residuals::Comparison& comparison, const residuals::Inputs& inputs,
                                 const std::string& folder, bool overwrite) {
  Report report("Model against flights");
  for (const stability::Model& model : inputs.models) {
    std::string effects;
    for (const stability::EffectSpec& effect : model.effects)
      effects += (effects.empty() ? "" : ", ") + effect.name;
    report.paragraph(fmt::format("Model {}: {}, {:.1f} g; effects: {}.", model.path, model.kind,
                                 1000 * model.mass_kg, effects.empty() ? "none" : effects));
  }
  report.paragraph(
      "Force residual: mass times measured specific force minus thrust and effects, in the world frame, in "
      "gram-force. "
      "Torque is not compared: logs at 100 Hz of a loop at 500 Hz alias.");
  report.heading("Scenarios and vehicles");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, errors] : comparison.scenarios) rows.push_back(row(name, errors));
  for (const auto& [name, errors] : comparison.vehicles) rows.push_back(row(name, errors));
  rows.push_back(row("all", comparison.overall));
  report.table(kHeader, rows);

  report.heading("Where the model fails");
  rows.clear();
  for (std::size_t i = 0; i < comparison.regions.size() && i < 12; ++i) {
    const residuals::RegionErrors& region = comparison.regions[i];
    rows.push_back({region.words, std::to_string(region.statistics.samples), gf(region.statistics.rmse.total),
                    fmt::format("{:.1f} %", 100 * region.share)});
  }
  report.table({"region", "records", "RMSE", "share of all squared residual in its mean"}, rows);
  const char* const kUnits[] = {"[m]", "[m/s]", "", "[V]", "[s]", "[degrees]"};
  for (int variable = 0; variable < 6; ++variable)
    add_region_plot(report, comparison, variable, kUnits[variable]);
  add_time_series(report, comparison);

  report.heading("Flights");
  rows.clear();
  for (const residuals::TrackErrors& track : comparison.tracks)
    if (!track.position_only) rows.push_back(row(track.flight + " " + track.vehicle, track.errors));
  report.table(kHeader, rows);
  report.heading("What was cut, and why");
  rows.clear();
  for (const residuals::TrackErrors& track : comparison.tracks) {
    std::string cuts, findings;
    for (std::size_t k = 1; k < track.cut.size(); ++k) {
      if (track.cut[k] > 0)
        cuts += fmt::format("{}{} {}", cuts.empty() ? "" : ", ", track.cut[k],
                            name(static_cast<residuals::Cut>(k)));
    }
    for (const std::string& finding : track.findings) findings += (findings.empty() ? "" : "; ") + finding;
    rows.push_back({track.flight + " " + track.vehicle, track.position_only ? "position only" : cuts,
                    findings,
                    track.clock_onsets > 0 ? fmt::format("{:.0f} ms", 1000 * track.clock_offset_s) : "-"});
  }
  report.table({"", "records cut", "the log", "clock offset"}, rows);
  for (const std::string& problem : comparison.problems) report.paragraph("Left out: " + problem);
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
