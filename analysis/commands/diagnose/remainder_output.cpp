#include "analysis/commands/diagnose/remainder_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

#include "analysis/identification/verdict.h"

namespace swarmcert::analysis {
namespace {

using identification::CurvePoint;
using identification::Diagnosis;
using identification::ScanEntry;
using identification::ScanVariable;

constexpr std::size_t kShownCurves = 4;

bool is_torque(const ScanEntry& entry) { return entry.quantity == "torque"; }

/// The unit in which a page shows a quantity of this magnitude.
struct ShownUnit {
  std::string name;
  double per_si;
};

ShownUnit shown_unit(const ScanEntry& entry, const residuals::ForceUnit& force) {
  if (!is_torque(entry)) return {force.name, force.per_newton()};
  if (entry.rmse_before < 1e-3) return {"µN m", 1e6};
  return entry.rmse_before < 1 ? ShownUnit{"mN m", 1e3} : ShownUnit{"N m", 1};
}

std::string fall_of(const ScanEntry& entry, const residuals::ForceUnit& force) {
  const auto [unit_name, per_unit] = shown_unit(entry, force);
  return fmt::format("{:.4g} -> {:.4g} {}", per_unit * entry.rmse_before, per_unit * entry.rmse_after,
                     unit_name);
}

/// Rewrites "m_s" as "m/s".
std::string with_slash(std::string unit) {
  std::replace(unit.begin(), unit.end(), '_', '/');
  return unit;
}

std::string words_of(const ScanEntry& entry) {
  return entry.quantity == "rotor_force" ? "force of" : entry.quantity;
}

std::string verdict_of(const ScanEntry& entry) {
  if (!entry.is_checked) return "not_applicable";
  const double width = entry.slope.interval.upper - entry.slope.interval.lower;
  if (!(width < 1)) return "too_weak";
  return entry.slope.interval.upper < 1 ? "contradicts" : "agrees";
}

/// An entry from the scan of the force, or of the torques and rotors.
struct Listed {
  const ScanEntry* entry = nullptr;
  const identification::Formula* formula = nullptr;  ///< null: none
};

std::vector<Listed> listed(const identification::Scan& scan,
                           const std::vector<identification::Formula>& formulas) {
  std::vector<Listed> all;
  for (const ScanEntry& entry : scan.entries) all.push_back({&entry, nullptr});
  for (const identification::Formula& formula : formulas) all[formula.entry].formula = &formula;
  return all;
}

/// Counts the curves shown, separately for the force and for torques and rotors.
struct Shown {
  std::size_t forces = 0, balances = 0;
  bool has_room(const ScanEntry& entry) {
    std::size_t& count = entry.quantity == "force" ? forces : balances;
    return ++count <= kShownCurves;
  }
};

/// Merges both scans, each sorted best first. The force precedes torques and rotors if its scan explains much;
/// otherwise entries are sorted by their share.
std::vector<Listed> all_listed(const Diagnosis& diagnosis) {
  if (!identification::leaves_something(diagnosis)) return {};
  const std::vector<Listed> forces = listed(diagnosis.scan, diagnosis.formulas),
                            balances = listed(diagnosis.balance, diagnosis.balance_formulas);
  const bool is_force_first = !forces.empty() && forces.front().entry->share >= identification::kMuchOfForce;
  std::vector<Listed> all;
  std::merge(forces.begin(), forces.end(), balances.begin(), balances.end(), std::back_inserter(all),
             [is_force_first](const Listed& a, const Listed& b) {
               if (is_force_first) return a.entry->quantity == "force" && b.entry->quantity != "force";
               return a.entry->share > b.entry->share;
             });
  return all;
}

/// A row of `remainder`.
struct RemainderRow {
  ScanEntry entry;
  std::optional<identification::Formula> formula;
  std::string kind;
};

template <class T>
std::optional<T> if_positive(T value) {
  return value > 0 ? std::optional(value) : std::nullopt;
}

void describe_remainder_row(files::Record& record, const RemainderRow& row) {
  const ScanEntry& entry = row.entry;
  record.field("variable", entry.variable, "It varies with this; body_constant: with nothing.");
  record.field("quantity", entry.quantity, "force, torque or rotor_force.");
  record.field("frame", entry.frame, "world, body, neighbour or velocity.");
  record.field("axis", entry.axis, "");
  record.field("kind", row.kind, "Kind of vehicle.");
  record.field("share", entry.share, "Of the mean square, corrected for the controller's reaction.", "",
               "estimate");
  record.field("share_ci", entry.share_interval, "90 % interval of share.");
  record.field("uncorrected_share", entry.uncorrected_share, "Before the correction.", "", "estimate");
  record.list("curve", entry.curve, "Its mean over the variable.",
              [&](files::Record& r, const CurvePoint& point) {
                r.field("at", point.at, "One number, or two for a map.");
                const bool torque = is_torque(entry);
                r.may(torque ? "torque_Nm" : "force_N", std::optional(point.value), "", torque ? "N m" : "N",
                      "estimate");
                if (r.is_shape()) r.may("torque_Nm", std::optional(0.0), "Of torques.", "N m", "estimate");
                r.field("interval_90", point.interval, "From fits without one part of the data.");
              });
  record.field("expression", row.formula ? std::optional(to_toml(*row.formula)) : std::nullopt,
               "The formula as a part of a model file; null: none fits.");
  record.field("rmse_before", entry.rmse_before, "Without the curve.", "N, N m");
  record.field("rmse_after", entry.rmse_after, "With it.", "N, N m");
  record.field("set_points", verdict_of(entry), "not_applicable, too_weak, contradicts or agrees.");
  record.may("lag_s", if_positive(entry.lag_s), "Age of the neighbour's state.", "s");
  record.may("over_ground", entry.over_ground ? std::optional(true) : std::nullopt,
             "The neighbour's velocity, not minus the vehicle's.");
  record.may("period_s", if_positive(entry.period_s), "Of a periodic force.", "s");
  record.may("form", row.formula ? std::optional(row.formula->form) : std::nullopt, "Form of the formula.");
  record.may("saved_bits", row.formula ? std::optional(row.formula->saved_bits) : std::nullopt,
             "By which the formula shortens the description of the data.", "bit", "estimate");
}

std::string place_of(const ScanEntry& entry) {
  if (entry.frame == "neighbour") return words_of(entry) + " towards the nearest neighbour, over its place";
  if (entry.frame == "velocity") return words_of(entry) + " along the velocity over " + entry.variable;
  std::string text = fmt::format("{} {} over {}", words_of(entry), entry.axis, entry.variable);
  if (entry.frame == "body" && entry.quantity == "force") text += " (body axes)";
  if (entry.over_ground) text += " over ground";
  if (entry.lag_s > 0) text += fmt::format(", {:.1f} s ago", entry.lag_s);
  if (entry.period_s > 0) text += fmt::format(", period {:.3g} s", entry.period_s);
  return text;
}

/// Axis labels of a curve (one) or a map (two).
std::pair<std::string, std::string> axis_labels(const ScanEntry& entry) {
  if (entry.variables.empty()) return {"neighbour to the side [m]", "neighbour above [m]"};
  const auto label = [](const std::string& name, ScanVariable variable) {
    const std::string unit = with_slash(identification::scan_variable(variable).unit);
    return name + (unit.empty() ? "" : " [" + unit + "]");
  };
  if (entry.variables.size() == 1) return {label(entry.variable, entry.variables[0]), ""};
  const auto named = [&](ScanVariable v) { return label(identification::scan_variable(v).name, v); };
  return {named(entry.variables[0]), named(entry.variables[1])};
}

/// @param name name of the figure.
void add_curve(Report& report, const ScanEntry& entry, const std::string& name,
               const residuals::ForceUnit& force) {
  const auto [unit_name, per_unit] = shown_unit(entry, force);
  const std::string shown = fmt::format("{} {} [{}]", words_of(entry), entry.axis, unit_name);
  const bool is_map = entry.curve[0].at.size() == 2;
  std::string data = is_map ? "# at_1 at_2 force\n" : "# at force lower upper\n";
  double last = NAN, most = 0;
  for (const CurvePoint& point : entry.curve) {
    most = std::max(most, std::abs(per_unit * point.value));
    if (is_map) {
      if (point.at[0] != last && !std::isnan(last)) data += "\n";
      last = point.at[0];
      data += fmt::format("{:.6g} {:.6g} {:.6g}\n", point.at[0], point.at[1], per_unit * point.value);
    } else {
      data += fmt::format("{:.6g} {:.6g} {:.6g} {:.6g}\n", point.at[0], per_unit * point.value,
                          per_unit * point.interval.lower, per_unit * point.interval.upper);
    }
  }
  const auto [along, across] = axis_labels(entry);
  std::string script = "set xlabel '" + along + "'\n";
  if (is_map) {
    // White means no force.
    script += fmt::format(
        "set ylabel '{}'\nset cblabel '{}'\nset palette @signed_colours\nset cbrange [{:.6g}:{:.6g}]\n"
        "plot '{}.dat' using 1:2:3 with points pointtype 5 pointsize 3 palette notitle\n",
        across, shown, -most, most, name);
  } else {
    script += "set ylabel '" + shown + "'\nplot '" + name +
              ".dat' using 1:3:4 with filledcurves fillcolor rgb '#cccccc' title '90 %', '' using 1:2 with "
              "linespoints linetype 1 title 'remainder'\n";
  }
  report.figure(name, data, script,
                fmt::format("Remainder: {}, {} axes; {:.0f} % of its mean square.", place_of(entry),
                            entry.frame, 100 * entry.share));
}

}  // namespace

void describe_remainder(files::Record& record, const std::vector<Diagnosis>& diagnoses) {
  std::vector<RemainderRow> rows;
  for (const Diagnosis& diagnosis : diagnoses) {
    for (const auto& [entry, formula] : all_listed(diagnosis))
      rows.push_back({*entry, formula == nullptr ? std::nullopt : std::optional(*formula), diagnosis.kind});
  }
  record.list("remainder", rows, "What is left of forces, torques and rotors, variable by variable.",
              describe_remainder_row);
}

void print_remainder(const Diagnosis& diagnosis, const residuals::ForceUnit& unit) {
  const std::vector<Listed> entries = all_listed(diagnosis);
  if (entries.empty()) return;
  fmt::print("  The remainder varies with:\n");
  Shown shown;
  for (const auto& [found, formula] : entries) {
    const ScanEntry& entry = *found;
    if (!shown.has_room(entry)) continue;
    fmt::print("    {:<34} {:.0f} % of it (90 %: {:.0f} .. {:.0f}), RMSE {}\n", place_of(entry),
               100 * entry.share, 100 * entry.share_interval.lower, 100 * entry.share_interval.upper,
               fall_of(entry, unit));
    if (formula != nullptr) {
      for (const auto& [target, text] : formula->effect.expression.formulas)
        fmt::print("      {} = {}\n", target, text);
    }
  }
}

void add_remainder(Report& report, const Diagnosis& diagnosis, std::size_t number,
                   const residuals::ForceUnit& unit) {
  const std::vector<Listed> entries = all_listed(diagnosis);
  if (entries.empty()) {
    report.paragraph("The remainder varies with no variable of the scan.");
    return;
  }
  std::vector<std::vector<std::string>> rows;
  for (const Listed& found : entries) {
    const ScanEntry& entry = *found.entry;
    std::string set_points = verdict_of(entry);
    std::replace(set_points.begin(), set_points.end(), '_', ' ');
    rows.push_back({place_of(entry),
                    fmt::format("{:.1f} % ({:.1f} .. {:.1f})", 100 * entry.share,
                                100 * entry.share_interval.lower, 100 * entry.share_interval.upper),
                    fall_of(entry, unit), set_points});
  }
  report.paragraph("The remainder varies with:");
  report.table({"what", "share of the remainder, 90 %", "RMSE", "set points"}, rows);
  std::size_t figures = 0;
  Shown shown;
  for (const Listed& found : entries) {
    const ScanEntry& entry = *found.entry;
    if (entry.curve.size() < 2 || !shown.has_room(entry)) continue;
    ++figures;
    add_curve(report, entry, fmt::format("remainder_{}_{}", number, figures), unit);
  }
}

}  // namespace swarmcert::analysis
