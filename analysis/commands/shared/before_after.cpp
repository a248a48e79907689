#include "analysis/commands/shared/before_after.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/commands/shared/time_plots.h"
#include "analysis/report/report_drawing.h"
#include "analysis/report/report_text.h"
#include "analysis/report/table.h"

namespace swarmcert::analysis {
namespace {

using identification::EffectCurve;
using identification::RoomMap;

/// Lengths of the axes of the map.
struct MapSize {
  double x, y;
};

/// gnuplot commands for two maps of NAME.dat with a common colour scale, columns 3 (before) and 4 (after). On narrow
/// screens the maps are stacked, in a drawing of twice the height.
std::string two_maps(const std::string& name, const std::string& x, const std::string& y, const MapSize& size,
                     char along, const residuals::ForceUnit& unit) {
  const std::string file = "'" + name + ".dat'";
  return "stats " + file + " using 3 nooutput\nlow = STATS_min; high = STATS_max\nstats " + file +
         " using 4 nooutput\nlow = STATS_min < low ? STATS_min : low\n"
         "high = STATS_max > high ? STATS_max : high\nm = -low > high ? -low : high\n"
         "set cbrange [-(m > 0 ? m : 1):(m > 0 ? m : 1)]\nset palette @signed_colours\nset key off\n"
         "set xlabel '" +
         x + "'\nset ylabel '" + y +
         fmt::format("'\nset xtics {:g}\nset ytics {:g}\nset cblabel 'mean residual along {} [{}]'\n",
                     tick_step(size.x), tick_step(size.y), along, unit.name) +
         "if (exists('narrow')) { set terminal svg size 400,680 dynamic noenhanced font 'sans-serif,13'; "
         "set multiplot layout 2,1 } else { set multiplot layout 1,2 }\n"
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
  report.figure(
      "room", data,
      two_maps("room", "x [m]", "y [m]", {RoomMap::kCells * map.step_m[0], RoomMap::kCells * map.step_m[1]},
               "xyz"[map.axis], unit),
      fmt::format(
          "Mean residual along {} over the position in the room, before and after, with a common colour "
          "scale; cells of fewer than 20 records are empty.",
          "xyz"[map.axis]));
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
      two_maps("neighbours", "lateral distance [m]", "height of the neighbour above [m]",
               {Map::kLateral * Map::kLateralStep_m, Map::kHeights * Map::kHeightStep_m}, 'z', unit),
      "Mean vertical residual over the position of the laterally nearest neighbour, before and "
      "after, with a common colour scale.");
}

/// The mean of the residual over the ranges of one variable, before and after.
struct VariableCurve {
  int variable;
  std::string data;
  int points = 0;
  double lowest = INFINITY, highest = -INFINITY;  ///< before
};

VariableCurve variable_curve(const residuals::Comparison& before, const residuals::Comparison& after,
                             int variable, int axis, const residuals::ForceUnit& unit) {
  const auto mean_of = [&](const residuals::Comparison& comparison, int region) {
    for (const residuals::RegionErrors& candidate : comparison.regions) {
      const residuals::Axes& bias = candidate.statistics.bias;
      if (candidate.variable == variable && candidate.region == region)
        return (axis == 0 ? bias.x : axis == 1 ? bias.y : bias.z) * unit.per_newton();
    }
    return static_cast<double>(NAN);
  };
  VariableCurve curve{variable, "# value before after\n"};
  for (int region = 0; region < residuals::num_regions(variable); ++region) {
    const double was = mean_of(before, region), is = mean_of(after, region);
    if (std::isnan(was) || std::isnan(is)) continue;
    ++curve.points;
    curve.lowest = std::min(curve.lowest, was);
    curve.highest = std::max(curve.highest, was);
    curve.data += fmt::format("{:.6g} {:.6g} {:.6g}\n", residuals::region_middle(variable, region), was, is);
  }
  return curve;
}

void add_variable(Report& report, const VariableCurve& curve, int axis, const residuals::ForceUnit& unit) {
  const std::string label = residuals::variable_name(curve.variable),
                    name = fmt::format("over_{}", curve.variable);
  const std::string over = label + " " + kVariableUnits[curve.variable], along(1, "xyz"[axis]);
  report.figure(name, curve.data,
                "set xlabel '" + over + "'\nset ylabel 'mean residual along " + along + " [" + unit.name +
                    "]'\nplot '" + name +
                    ".dat' using 1:2 with linespoints title 'before', '' using 1:3 with linespoints title "
                    "'after', 0 linecolor 'gray' notitle\n",
                "Mean residual along " + along + " over " + label + ", before and after.");
}

}  // namespace

void add_before_and_after(Report& report, const residuals::Comparison& before,
                          const residuals::Comparison& after, const RoomMap& room,
                          const residuals::ForceUnit& unit) {
  add_neighbours(report, before.neighbours, after.neighbours, unit);
  add_room(report, room, unit);
  constexpr std::size_t kMostVariables = 3;
  std::vector<VariableCurve> curves;
  for (int variable = 0; variable < kPlottedVariables; ++variable) {
    curves.push_back(variable_curve(before, after, variable, room.axis, unit));
    if (curves.back().points < 2) curves.pop_back();
  }
  std::stable_sort(curves.begin(), curves.end(), [](const VariableCurve& a, const VariableCurve& b) {
    const bool of_a = residuals::is_reaction(a.variable), of_b = residuals::is_reaction(b.variable);
    return of_a != of_b ? of_b : a.highest - a.lowest > b.highest - b.lowest;
  });
  for (std::size_t k = 0; k < std::min(kMostVariables, curves.size()); ++k)
    add_variable(report, curves[k], room.axis, unit);
}

void add_effect_curves(Report& report, const std::vector<EffectCurve>& effects,
                       const residuals::ForceUnit& unit) {
  std::size_t number = 0;
  for (const EffectCurve& curve : effects) {
    const auto [per_unit, unit_name] = shown_unit(curve.unit, {unit.name, unit.size_N});
    std::string data = "# variable predicted measured standard_error records\n";
    for (const EffectCurve::Point& point : curve.points) {
      data += fmt::format("{:.6g} {:.6g} {:.6g} {:.6g} {}\n", point.at * per_unit,
                          point.predicted_N * unit.per_newton(), point.measured_N * unit.per_newton(),
                          point.error_N * unit.per_newton(), point.records);
    }
    const double length = (curve.points.back().at - curve.points.front().at) * per_unit;
    const std::string name = fmt::format("effect_{}", ++number);
    report.figure(
        name, data,
        fmt::format(
            "set xlabel {0}\nset ylabel {1}\nif (exists('narrow')) {{ set xtics {3:g} }}\n"
            "plot 0 linecolor 'gray' dashtype 1 notitle, '{2}.dat' using 1:2 with lines linetype 1 "
            "title 'the fitted effect', '' using 1:3:(1.645*$4) with yerrorbars linetype 2 dashtype 1 "
            "title 'measured, 90 %'\n",
            plot_string(curve.variable + (unit_name.empty() ? "" : " [" + unit_name + "]")),
            plot_string(fmt::format("force along {} [{}]", curve.axis, unit.name)), name,
            2 * tick_step(length)),
        fmt::format("Effect {}: its force over {}, which explains {:.0f} % of how it varies, and what is "
                    "measured of it: the residual of the model with every other effect.",
                    curve.effect, curve.variable, 100 * curve.share));
  }
}

}  // namespace swarmcert::analysis
