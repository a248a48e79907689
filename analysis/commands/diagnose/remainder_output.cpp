#include "analysis/commands/diagnose/remainder_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace swarmcert::analysis {
namespace {

using identification::CurvePoint;
using identification::Diagnosis;
using identification::ScanEntry;

constexpr std::size_t kShownCurves = 4;

std::string verdict_of(const ScanEntry& entry) {
  if (!entry.is_checked) return "not_applicable";
  const double width = entry.slope.interval.second - entry.slope.interval.first;
  if (!(width < 1)) return "too_weak";
  return entry.slope.interval.second < 1 ? "contradicts" : "agrees";
}

files::Json curve_json(const std::vector<CurvePoint>& curve) {
  files::Json points = files::Json::array();
  for (const CurvePoint& point : curve) {
    points.push_back({{"at", point.at},
                      {"force_N", point.force_N},
                      {"interval_90", {point.interval.first, point.interval.second}}});
  }
  return points;
}

const identification::Formula* formula_of(const Diagnosis& diagnosis, std::size_t entry) {
  for (const identification::Formula& formula : diagnosis.formulas) {
    if (formula.entry == entry) return &formula;
  }
  return nullptr;
}

files::Json json_of(const ScanEntry& entry, const std::string& kind) {
  files::Json json = {{"variable", entry.variable},
                      {"frame", entry.frame},
                      {"axis", entry.axis},
                      {"kind", kind},
                      {"share", entry.share},
                      {"share_ci", {entry.share_interval.first, entry.share_interval.second}},
                      {"uncorrected_share", entry.uncorrected_share},
                      {"curve", curve_json(entry.curve)},
                      {"expression", nullptr},
                      {"rmse_before", entry.rmse_before_N},
                      {"rmse_after", entry.rmse_after_N},
                      {"set_points", verdict_of(entry)}};
  if (entry.lag_s > 0) json["lag_s"] = entry.lag_s;
  if (entry.period_s > 0) json["period_s"] = entry.period_s;
  return json;
}

std::string place_of(const ScanEntry& entry) {
  std::string text = fmt::format("{} over {}", entry.axis, entry.variable);
  if (entry.frame == "body") text += " (body axes)";
  if (entry.lag_s > 0) text += fmt::format(", {:.1f} s ago", entry.lag_s);
  if (entry.period_s > 0) text += fmt::format(", period {:.3g} s", entry.period_s);
  return text;
}

/// @param name of the figure.
void add_curve(Report& report, const ScanEntry& entry, const std::string& name,
               const residuals::ForceUnit& force) {
  const bool is_map = entry.curve[0].at.size() == 2;
  std::string data = is_map ? "# at_1 at_2 force\n" : "# at force lower upper\n";
  double last = NAN;
  for (const CurvePoint& point : entry.curve) {
    if (is_map) {
      if (point.at[0] != last && !std::isnan(last)) data += "\n";
      last = point.at[0];
      data +=
          fmt::format("{:.6g} {:.6g} {:.6g}\n", point.at[0], point.at[1], force.per_newton() * point.force_N);
    } else {
      data +=
          fmt::format("{:.6g} {:.6g} {:.6g} {:.6g}\n", point.at[0], force.per_newton() * point.force_N,
                      force.per_newton() * point.interval.first, force.per_newton() * point.interval.second);
    }
  }
  const std::string unit =
      entry.variables.empty() ? "m" : identification::scan_variable(entry.variables[0]).unit;
  const std::string label = is_map ? "[m]" : entry.variable + (unit.empty() ? "" : " [" + unit + "]");
  std::string script = "set xlabel '" + label + "'\n";
  if (is_map) {
    script += "set ylabel '[m]'\nset cblabel 'force " + entry.axis + " [" + force.name +
              "]'\nset palette @signed_colours\nplot '" + name +
              ".dat' using 1:2:3 with points pointtype 5 pointsize 3 palette notitle\n";
  } else {
    script += "set ylabel 'force " + entry.axis + " [" + force.name + "]'\nplot '" + name +
              ".dat' using 1:3:4 with filledcurves fillcolor rgb '#cccccc' title '90 %', '' using 1:2 with "
              "linespoints linetype 1 title 'what is left'\n";
  }
  report.figure(
      name, data, script,
      fmt::format("What is left of the force along {} ({} axes) over {}: {:.0f} % of its mean square.",
                  entry.axis, entry.frame, entry.variable, 100 * entry.share));
}

}  // namespace

files::Json remainder_json(const Diagnosis& diagnosis) {
  files::Json entries = files::Json::array();
  for (std::size_t i = 0; i < diagnosis.scan.entries.size(); ++i) {
    files::Json json = json_of(diagnosis.scan.entries[i], diagnosis.kind);
    if (const identification::Formula* formula = formula_of(diagnosis, i); formula != nullptr) {
      json["expression"] = to_toml(*formula);
      json["form"] = formula->form;
      json["saved_bits"] = formula->saved_bits;
    }
    entries.push_back(std::move(json));
  }
  return entries;
}

void print_remainder(const Diagnosis& diagnosis) {
  const std::vector<ScanEntry>& entries = diagnosis.scan.entries;
  if (entries.empty()) return;
  fmt::print("  What is left varies with:\n");
  for (std::size_t i = 0; i < std::min(entries.size(), kShownCurves); ++i) {
    const ScanEntry& entry = entries[i];
    fmt::print("    force {:<28} {:.0f} % of it (90 %: {:.0f} .. {:.0f}), RMSE {:.5f} -> {:.5f} N\n",
               place_of(entry), 100 * entry.share, 100 * entry.share_interval.first,
               100 * entry.share_interval.second, entry.rmse_before_N, entry.rmse_after_N);
    if (const identification::Formula* formula = formula_of(diagnosis, i); formula != nullptr) {
      for (const auto& [target, text] : formula->effect.expression.formulas)
        fmt::print("      {} = {}\n", target, text);
    }
  }
}

void add_remainder(Report& report, const Diagnosis& diagnosis, std::size_t number,
                   const residuals::ForceUnit& unit) {
  const std::vector<ScanEntry>& entries = diagnosis.scan.entries;
  if (entries.empty()) {
    report.paragraph("What is left varies with no variable of the scan.");
    return;
  }
  std::vector<std::vector<std::string>> rows;
  for (const ScanEntry& entry : entries) {
    rows.push_back({place_of(entry),
                    fmt::format("{:.1f} % ({:.1f} .. {:.1f})", 100 * entry.share,
                                100 * entry.share_interval.first, 100 * entry.share_interval.second),
                    fmt::format("{:.4g} -> {:.4g}", unit.per_newton() * entry.rmse_before_N,
                                unit.per_newton() * entry.rmse_after_N),
                    verdict_of(entry)});
  }
  report.paragraph("What is left of the force varies with:");
  report.table(
      {"force", "share of what is left, 90 %", std::string("RMSE [") + unit.name + "]", "set points"}, rows);
  std::size_t shown = 0;
  for (const ScanEntry& entry : entries) {
    if (shown == kShownCurves) break;
    if (entry.curve.size() < 2) continue;
    ++shown;
    add_curve(report, entry, fmt::format("remainder_{}_{}", number, shown), unit);
  }
}

}  // namespace swarmcert::analysis
