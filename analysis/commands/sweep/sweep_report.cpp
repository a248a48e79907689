#include "analysis/commands/sweep/sweep_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "analysis/cli/counted.h"
#include "analysis/report/report.h"
#include "analysis/report/report_text.h"

namespace swarmcert::analysis {
namespace {

using stability::Cell;
using stability::MergedSweep;

/// A quantity of a merged file that this version does not know has no unit.
const stability::Quantity& quantity_of(const std::string& name) {
  static const stability::Quantity unknown = {"", "", -1, ""};
  for (const stability::Quantity& quantity : stability::grid_quantities()) {
    if (quantity.name == name) return quantity;
  }
  return unknown;
}
const std::string& unit_of(const std::string& quantity) { return quantity_of(quantity).unit; }
const std::string& meaning(const std::string& quantity) { return quantity_of(quantity).meaning; }
int better(const std::string& quantity) { return quantity_of(quantity).better; }

std::string where(const MergedSweep& sweep, const Cell& cell) {
  const std::vector<double> at = sweep.grid.at(cell.index);
  std::string text;
  for (std::size_t i = 0; i < at.size(); ++i)
    text += fmt::format("{}{} {:.6g}", i > 0 ? ", " : "", sweep.grid.axes[i].name, at[i]);
  return text;
}

/// The number of infeasible cells by reason, without the values of each cell.
std::map<std::string, int> reasons(const MergedSweep& sweep) {
  std::map<std::string, int> result;
  for (const Cell& cell : sweep.cells)
    if (!cell.infeasible.empty()) ++result[cell.infeasible.substr(0, cell.infeasible.find(": "))];
  return result;
}

/// Axes that have more than one value.
std::vector<std::size_t> varying(const MergedSweep& sweep) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < sweep.grid.axes.size(); ++i) {
    if (sweep.grid.axes[i].values.size() > 1) result.push_back(i);
  }
  return result;
}

bool is_geometric(const std::vector<double>& values) {
  if (values.size() < 3 || !(values.front() > 0)) return false;
  const double ratio = values[1] / values[0];
  return std::abs(values[2] / values[1] - ratio) < 1e-9 * ratio &&
         std::abs(values[2] - 2 * values[1] + values[0]) > 1e-9 * values[1];
}

/// Returns the edges of the cells along an axis: halfway between its values, one more than there are values.
std::vector<double> edges_of(const std::vector<double>& values) {
  const bool is_log = is_geometric(values);
  const auto at = [&](double v) { return is_log ? std::log(v) : v; };
  std::vector<double> edges;
  for (std::size_t i = 0; i <= values.size(); ++i) {
    const std::size_t right = std::clamp<std::size_t>(i, 1, values.size() - 1);
    const double low = at(values[right - 1]), high = at(values[right]);
    const double edge = (low + high) / 2 + (i == 0 ? low - high : i == values.size() ? high - low : 0);
    edges.push_back(is_log ? std::exp(edge) : edge);
  }
  return edges;
}

/// The plane of the first one or two varying axes, with the other axes at their first value.
struct Plane {
  std::vector<std::size_t> axes;
  std::string data;  ///< values of the axes, edges of the cell, value, whether on the front
  const Cell* best = nullptr;
};

Plane plane_of(const MergedSweep& sweep, std::size_t quantity) {
  Plane plane;
  plane.axes = varying(sweep);
  if (plane.axes.size() > 2) plane.axes.resize(2);
  const stability::Grid& grid = sweep.grid;
  const int sign = better(sweep.grid.compute[quantity]);
  std::vector<std::vector<double>> edges;
  for (const std::size_t axis : plane.axes) edges.push_back(edges_of(sweep.grid.axes[axis].values));
  for (const Cell& cell : sweep.cells) {
    const std::vector<double> at = grid.at(cell.index);
    bool is_shown = cell.infeasible.empty() && std::isfinite(cell.values[quantity]);
    for (std::size_t i = 0; i < at.size(); ++i) {
      const bool is_of_plane = std::count(plane.axes.begin(), plane.axes.end(), i) > 0;
      is_shown = is_shown && (is_of_plane || at[i] == sweep.grid.axes[i].values.front());
    }
    if (!is_shown) continue;
    std::string place, box;
    for (std::size_t k = 0; k < plane.axes.size(); ++k) {
      const std::vector<double>& values = sweep.grid.axes[plane.axes[k]].values;
      const double value = at[plane.axes[k]];
      const auto index =
          static_cast<std::size_t>(std::find(values.begin(), values.end(), value) - values.begin());
      place += fmt::format("{:.10g} ", value);
      box += fmt::format("{:.10g} {:.10g} ", edges[k][index], edges[k][index + 1]);
    }
    const bool is_on_front = std::count(sweep.front.begin(), sweep.front.end(), cell.index) > 0;
    plane.data += fmt::format("{}{}{:.10g} {}\n", place, box, cell.values[quantity], is_on_front ? 1 : 0);
    if (plane.best == nullptr || sign * cell.values[quantity] > sign * plane.best->values[quantity])
      plane.best = &cell;
  }
  return plane;
}

/// Returns the least and the largest value of the feasible cells.
std::pair<double, double> range_of(const MergedSweep& sweep, std::size_t quantity) {
  double least = INFINITY, most = -INFINITY;
  for (const Cell& cell : sweep.cells) {
    if (!cell.infeasible.empty() || !std::isfinite(cell.values[quantity])) continue;
    least = std::min(least, cell.values[quantity]);
    most = std::max(most, cell.values[quantity]);
  }
  return {least, most};
}

/// A logarithmic axis of gnuplot with marks at 1, 2, 5, 10, ... or, over more than three decades, at powers of ten.
std::string log_axis(const std::string& axis, double from, double to) {
  std::string marks;
  for (double decade = std::pow(10, std::floor(std::log10(from))); decade <= to; decade *= 10) {
    for (const double mark : {decade, 2 * decade, 5 * decade}) {
      const bool is_shown = mark >= from && mark <= to && (mark == decade || to < 1000 * from);
      if (is_shown) marks += fmt::format("{}{:.6g}", marks.empty() ? "" : ", ", mark);
    }
  }
  return fmt::format("set logscale {0}\nset {0}tics ({1})\n", axis, marks);
}

/// Returns the name of a parameter with its unit.
std::string axis_label(const std::string& name) {
  static const std::map<std::string, std::string> units = {
      {"Kp", "1/s^2"}, {"Kd", "1/s"}, {"Ki", "1/s^3"}, {"Lambda", "1/s"}, {"K", "kg/s"}};
  const auto unit = units.find(name);  // the other names state theirs
  return unit == units.end() ? name : name + " [" + unit->second + "]";
}

/// Draws every feasible cell in the colour of its value, over grey for the infeasible ones, with the Pareto front as
/// circles and the best cell as a star.
std::string heat_map(const MergedSweep& sweep, const Plane& plane, std::size_t quantity,
                     const std::string& file) {
  const char* const names[] = {"x", "y"};
  std::string script =
      "set object 1 rectangle from graph 0,0 to graph 1,1 behind fillcolor rgb '#dddddd' "
      "fillstyle solid noborder\nset style fill solid noborder\nunset grid\nset tics out\n";
  const std::vector<double> best_at = sweep.grid.at(plane.best->index);
  std::string place;
  for (std::size_t k = 0; k < 2; ++k) {
    const std::vector<double>& values = sweep.grid.axes[plane.axes[k]].values;
    const std::vector<double> edges = edges_of(values);
    const double at = best_at[plane.axes[k]];
    script += fmt::format("set {}range [{:.10g}:{:.10g}]\n", names[k], edges.front(), edges.back());
    place += fmt::format("{}{:.10g}", k > 0 ? "," : "", at);
  }
  const auto [least, most] = range_of(sweep, quantity);
  if (least > 0 && most > 10 * least) script += log_axis("cb", least, most);
  script += "set label 1 '' at " + place +
            " front point pointtype 3 pointsize 1.5 linewidth 2 linecolor rgb 'white'\n";
  return script + "plot '" + file +
         ".dat' using 1:2:3:4:5:6:7 with boxxyerror fillcolor palette, '' using ($8 > 0 ? $1 : NaN):2 "
         "with points pointtype 6 pointsize 0.4 linecolor rgb 'white'\n";
}

void add_plane(Report& report, const MergedSweep& sweep, std::size_t quantity) {
  if (varying(sweep).empty()) return;
  const Plane plane = plane_of(sweep, quantity);
  if (plane.best == nullptr) return;
  const std::string& name = sweep.grid.compute[quantity];
  const std::string file = "sweep_" + name;
  const std::string label = name + " [" + unit_of(name) + "]";
  const bool is_map = plane.axes.size() > 1;
  std::string script = "set key off\nset title " + plot_string(meaning(name)) + "\nset xlabel " +
                       plot_string(axis_label(sweep.grid.axes[plane.axes[0]].name)) + "\nset " +
                       (is_map ? "cb" : "y") + "label " + plot_string(label) + "\n";
  for (std::size_t k = 0; k < plane.axes.size(); ++k) {
    const std::vector<double>& values = sweep.grid.axes[plane.axes[k]].values;
    if (is_geometric(values)) script += log_axis(k == 0 ? "x" : "y", values.front(), values.back());
  }
  if (is_map) {
    script += "set ylabel " + plot_string(axis_label(sweep.grid.axes[plane.axes[1]].name)) +
              "\nif (exists('narrow')) { set lmargin at screen 0.22 }\n" +
              heat_map(sweep, plane, quantity, file);
  } else {
    script += "plot '" + file + ".dat' using 1:4 with lines linewidth 2\n";
  }
  std::string best;
  const std::vector<double> at = sweep.grid.at(plane.best->index);
  for (std::size_t axis = 0; axis < at.size(); ++axis)
    best += fmt::format("{} {} {:.4g}", axis > 0 ? "," : "", sweep.grid.axes[axis].name, at[axis]);
  report.figure(file, plane.data, script,
                fmt::format("{}. The best cell has {:.3g} {} at{}.{}{}", label, plane.best->values[quantity],
                            unit_of(name), best,
                            is_map ? " Star: that cell; circles: the Pareto front; grey: infeasible." : "",
                            varying(sweep).size() > 2 ? " Further axes at their first value." : ""));
}

void add_front(Report& report, const MergedSweep& sweep) {
  if (sweep.front.empty()) return;
  report.heading("Pareto front");
  std::vector<std::string> header;
  for (const stability::GridAxis& axis : sweep.grid.axes) header.push_back(axis.name);
  for (const std::string& name : sweep.grid.pareto) header.push_back(name + " [" + unit_of(name) + "]");
  std::vector<std::vector<std::string>> rows;
  std::string data;
  const stability::Grid& grid = sweep.grid;
  for (const long index : sweep.front) {
    const Cell& cell = sweep.cells[static_cast<std::size_t>(index)];
    std::vector<std::string> row;
    for (const double value : grid.at(index)) row.push_back(fmt::format("{:.6g}", value));
    for (const std::string& name : sweep.grid.pareto) {
      const auto column =
          std::find(sweep.grid.compute.begin(), sweep.grid.compute.end(), name) - sweep.grid.compute.begin();
      const double value = cell.values[static_cast<std::size_t>(column)];
      row.push_back(fmt::format("{:.6g}", value));
      data += fmt::format("{:.10g} ", value);
    }
    data += "\n";
    if (rows.size() < 200) rows.push_back(std::move(row));
  }
  if (sweep.grid.pareto.size() >= 2) {
    report.figure(
        "pareto", data,
        "set xlabel " + plot_string(sweep.grid.pareto[0] + " [" + unit_of(sweep.grid.pareto[0]) + "]") +
            "\nset ylabel " + plot_string(sweep.grid.pareto[1] + " [" + unit_of(sweep.grid.pareto[1]) + "]") +
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
  for (std::size_t q = 0; q < sweep.grid.compute.size(); ++q) {
    const Cell* best = nullptr;
    const int sign = better(sweep.grid.compute[q]);
    for (const Cell& cell : sweep.cells) {
      if (!cell.infeasible.empty() || !std::isfinite(cell.values[q])) continue;
      if (best == nullptr || sign * cell.values[q] > sign * best->values[q]) best = &cell;
    }
    if (best == nullptr) continue;
    fmt::print("  best {:<21} {:.6g} {} at {}\n", sweep.grid.compute[q], best->values[q],
               unit_of(sweep.grid.compute[q]), where(sweep, *best));
  }
  if (!sweep.front.empty()) fmt::print("  Pareto front: {}\n", counted(sweep.front.size(), "cell"));
}

std::string write_sweep_report(const MergedSweep& sweep, const std::string& folder, bool overwrite) {
  Report report("Sweep of " + sweep.grid.path);
  report.result(sweep_json(sweep));
  // The page is the same whether the cells come from one run or from merged shards.
  report.made_by(shell_line({"swarmcert", "sweep", sweep.grid.path, "-o", "OUTPUT"}));
  for (std::size_t q = 0; q < sweep.grid.compute.size(); ++q) add_plane(report, sweep, q);
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
