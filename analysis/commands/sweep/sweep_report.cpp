#include "analysis/commands/sweep/sweep_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/cli/counted.h"
#include "analysis/report/report.h"
#include "analysis/report/report_text.h"

namespace swarmcert::analysis {
namespace {

using stability::Cell;
using stability::MergedSweep;

std::string unit_of(const std::string& quantity) {
  for (const stability::Quantity& q : stability::grid_quantities()) {
    if (q.name == quantity) return q.unit;
  }
  return "";
}

int better(const std::string& quantity) {
  for (const stability::Quantity& q : stability::grid_quantities()) {
    if (q.name == quantity) return q.better;
  }
  return -1;
}

stability::Grid axes_of(const MergedSweep& sweep) {
  stability::Grid grid;
  for (std::size_t i = 0; i < sweep.axis_names.size(); ++i) {
    grid.axes.push_back({sweep.axis_names[i], sweep.axis_values[i]});
  }
  return grid;
}

std::string where(const MergedSweep& sweep, const Cell& cell) {
  const std::vector<double> at = axes_of(sweep).at(cell.index);
  std::string text;
  for (std::size_t i = 0; i < at.size(); ++i)
    text += fmt::format("{}{} {:.6g}", i > 0 ? ", " : "", sweep.axis_names[i], at[i]);
  return text;
}

/// The number of infeasible cells by reason, with the numbers removed from the reason.
std::map<std::string, int> reasons(const MergedSweep& sweep) {
  std::map<std::string, int> result;
  for (const Cell& cell : sweep.cells) {
    if (cell.infeasible.empty()) continue;
    const std::size_t number = cell.infeasible.find_first_of("0123456789");
    std::string reason = cell.infeasible.substr(0, number);
    while (!reason.empty() && (reason.back() == ' ' || reason.back() == '-')) reason.pop_back();
    ++result[reason];
  }
  return result;
}

/// Axes that have more than one value.
std::vector<std::size_t> varying(const MergedSweep& sweep) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < sweep.axis_values.size(); ++i) {
    if (sweep.axis_values[i].size() > 1) result.push_back(i);
  }
  return result;
}

/// Cells in the plane of the first one or two varying axes, with the other axes at their first value.
std::string plane_data(const MergedSweep& sweep, const std::vector<std::size_t>& axes, std::size_t quantity) {
  const stability::Grid grid = axes_of(sweep);
  std::string data;
  double last = NAN;
  for (const Cell& cell : sweep.cells) {
    const std::vector<double> at = grid.at(cell.index);
    bool in_plane = true;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const bool is_shown = i == axes[0] || (axes.size() > 1 && i == axes[1]);
      if (!is_shown && at[i] != sweep.axis_values[i].front()) in_plane = false;
    }
    if (!in_plane) continue;
    const double value =
        cell.infeasible.empty() && std::isfinite(cell.values[quantity]) ? cell.values[quantity] : NAN;
    const std::string text = std::isnan(value) ? "NaN" : fmt::format("{:.10g}", value);
    if (axes.size() > 1) {
      if (!std::isnan(last) && last != at[axes[0]]) data += "\n";
      last = at[axes[0]];
      data += fmt::format("{:.10g} {:.10g} {}\n", at[axes[0]], at[axes[1]], text);
    } else {
      data += fmt::format("{:.10g} {}\n", at[axes[0]], text);
    }
  }
  return data;
}

bool is_geometric(const std::vector<double>& values) {
  if (values.size() < 3 || !(values.front() > 0)) return false;
  const double ratio = values[1] / values[0];
  return std::abs(values[2] / values[1] - ratio) < 1e-9 * ratio &&
         std::abs(values[2] - 2 * values[1] + values[0]) > 1e-9 * values[1];
}

void add_plane(Report& report, const MergedSweep& sweep, std::size_t quantity) {
  std::vector<std::size_t> axes = varying(sweep);
  if (axes.empty()) return;
  if (axes.size() > 2) axes.resize(2);
  const std::string& name = sweep.compute[quantity];
  const std::string file = "sweep_" + name;
  std::string script = "set xlabel " + plot_string(sweep.axis_names[axes[0]]) + "\nset key off\n";
  if (is_geometric(sweep.axis_values[axes[0]])) script += "set logscale x\n";
  const std::string label = name + " [" + unit_of(name) + "]";
  if (axes.size() > 1) {
    if (is_geometric(sweep.axis_values[axes[1]])) script += "set logscale y\n";
    script += "set ylabel " + plot_string(sweep.axis_names[axes[1]]) + "\nset cblabel " + plot_string(label) +
              "\nset view map\nset pm3d map corners2color c1\n"
              "if (exists('narrow')) { set lmargin at screen 0.17 }\n"
              "splot '" +
              file + ".dat' using 1:2:3 with pm3d\n";
  } else {
    script +=
        "set ylabel " + plot_string(label) + "\nplot '" + file + ".dat' using 1:2 with lines linewidth 2\n";
  }
  report.figure(file, plane_data(sweep, axes, quantity), script,
                label + ". Empty: infeasible." +
                    (varying(sweep).size() > 2 ? " Further axes at their first value." : ""));
}

void add_front(Report& report, const MergedSweep& sweep) {
  if (sweep.front.empty()) return;
  report.heading("Pareto front");
  std::vector<std::string> header = sweep.axis_names;
  for (const std::string& name : sweep.pareto) header.push_back(name + " [" + unit_of(name) + "]");
  std::vector<std::vector<std::string>> rows;
  std::string data;
  const stability::Grid grid = axes_of(sweep);
  for (const long index : sweep.front) {
    const Cell& cell = sweep.cells[static_cast<std::size_t>(index)];
    std::vector<std::string> row;
    for (const double value : grid.at(index)) row.push_back(fmt::format("{:.6g}", value));
    for (const std::string& name : sweep.pareto) {
      const auto column = std::find(sweep.compute.begin(), sweep.compute.end(), name) - sweep.compute.begin();
      const double value = cell.values[static_cast<std::size_t>(column)];
      row.push_back(fmt::format("{:.6g}", value));
      data += fmt::format("{:.10g} ", value);
    }
    data += "\n";
    if (rows.size() < 200) rows.push_back(std::move(row));
  }
  if (sweep.pareto.size() >= 2) {
    report.figure("pareto", data,
                  "set xlabel " + plot_string(sweep.pareto[0] + " [" + unit_of(sweep.pareto[0]) + "]") +
                      "\nset ylabel " + plot_string(sweep.pareto[1] + " [" + unit_of(sweep.pareto[1]) + "]") +
                      "\nset key off\nplot 'pareto.dat' using 1:2 with points pointtype 7\n",
                  "Cells that no other beats in every one of the listed quantities.");
  }
  report.table(header, rows);
}

}  // namespace

void print_sweep(const MergedSweep& sweep) {
  const auto feasible = std::count_if(sweep.cells.begin(), sweep.cells.end(),
                                      [](const Cell& cell) { return cell.infeasible.empty(); });
  fmt::print("{}, {} feasible\n", counted(sweep.cells.size(), "cell"), feasible);
  for (const auto& [reason, count] : reasons(sweep)) fmt::print("  {:>7} infeasible: {}\n", count, reason);
  for (std::size_t q = 0; q < sweep.compute.size(); ++q) {
    const Cell* best = nullptr;
    const int sign = better(sweep.compute[q]);
    for (const Cell& cell : sweep.cells) {
      if (!cell.infeasible.empty() || !std::isfinite(cell.values[q])) continue;
      if (best == nullptr || sign * cell.values[q] > sign * best->values[q]) best = &cell;
    }
    if (best == nullptr) continue;
    fmt::print("  best {:<21} {:.6g} {} at {}\n", sweep.compute[q], best->values[q],
               unit_of(sweep.compute[q]), where(sweep, *best));
  }
  if (!sweep.front.empty()) fmt::print("  Pareto front: {}\n", counted(sweep.front.size(), "cell"));
}

std::string write_sweep_report(const MergedSweep& sweep, const std::string& folder, bool overwrite) {
  Report report("Sweep of " + sweep.grid_path);
  report.result(sweep_json(sweep));
  // The page is the same whether the cells come from one run or from merged shards.
  report.made_by(shell_line({"swarmcert", "sweep", sweep.grid_path, "-o", "OUTPUT"}));
  for (std::size_t q = 0; q < sweep.compute.size(); ++q) add_plane(report, sweep, q);
  add_front(report, sweep);
  const std::map<std::string, int> why = reasons(sweep);
  if (!why.empty()) {
    report.heading("Infeasible cells");
    std::vector<std::vector<std::string>> rows;
    for (const auto& [reason, count] : why) rows.push_back({reason, std::to_string(count)});
    report.table({"reason", "cells"}, rows);
  }
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
