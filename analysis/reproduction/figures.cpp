#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/stages.h"

namespace swarmcert::reproduction {
namespace {

/// The figures use one truth, the one with parameters from flights only.
Stages stages_of(const Setting& setting) { return {setting, truths(setting).front(), 0}; }

std::uint64_t flight_seed(const Setting& setting) { return seed_of(setting.seed, "figures"); }

std::string curve_name(int trained_with) {
  return trained_with == 0 ? "baseline" : fmt::format("trained with {}", trained_with);
}

/// Rows "time value..." of every vehicle, one gnuplot index each.
template <typename Row>
std::string series(const Flown& flown, const Row& row) {
  std::string text;
  for (const auto& moments : flown.vehicles) {
    for (const Moment& now : moments) text += row(now);
    text += "\n\n";
  }
  return text;
}

/// Rows "time position height height_d". Vehicles cross each other's paths, so the position is measured along each
/// vehicle's own path.
std::string paths(const Flown& flown) {
  std::string text;
  for (const auto& moments : flown.vehicles) {
    const Eigen::Vector2f way = moments.front().p_d_m.head<2>().normalized();
    for (const Moment& now : moments)
      text += fmt::format("{:.3f} {:.4f} {:.4f} {:.4f}\n", now.time_s, way.dot(now.p_m.head<2>()),
                          now.p_m.z(), now.p_d_m.z());
    text += "\n\n";
  }
  return text;
}

float height_error_m(const Moment& now) { return now.p_m.z() - now.p_d_m.z(); }

}  // namespace

Finding figure_intro(const Setting& setting) {
  Finding finding;
  Stages stages = stages_of(setting);
  finding.json["truth"] = stages.truth().name;
  finding.json["controllers"] = files::Json::array();
  Table table = {"Two vehicles swap sides, six times", {"controller", "largest |z - z_d| [m]"}, {}};
  for (const int trained_with : {0, 2}) {
    std::optional<files::Network> network;
    if (trained_with > 0) network = stages.learned(stage_of(trained_with)).network;
    const Flown flown = fly(setting, stages.truth(), {"swap", 2, 0, flight_seed(setting)},
                            network ? &*network : nullptr, false);
    const double largest_m = largest_error_m(flown, 2);
    table.rows.push_back({curve_name(trained_with), fmt::format("{:.3f}", largest_m)});
    finding.json["controllers"].push_back({{"trained_with", trained_with}, {"max_z_m", largest_m}});
    const std::string name = trained_with == 0 ? "intro_baseline" : "intro_network";
    finding.figures.push_back(
        {name, paths(flown),
         "set grid\nset xlabel 'along the own path [m]'\nset ylabel 'z [m]'\nset yrange [0.4:1]\nset key "
         "outside\nplot for [i=0:1] '" +
             name +
             ".dat' index i using 2:3 with lines lw 2 title sprintf('vehicle %d', i + 1), for [i=0:1] '" +
             name + ".dat' index i using 2:4 with lines dt 2 lc 'gray' notitle\n",
         fmt::format("Paths of two vehicles, {}; dashed: as commanded.", curve_name(trained_with))});
  }
  finding.tables.push_back(std::move(table));
  return finding;
}

Finding figure_swaps(const Setting& setting) {
  Finding finding;
  Stages stages = stages_of(setting);
  finding.json["truth"] = stages.truth().name;
  finding.json["controllers"] = files::Json::array();
  Table table = {"Three vehicles, two swaps: largest |z - z_d| [m]",
                 {"controller", "vehicle 1 (lowest)", "vehicle 2", "vehicle 3"},
                 {}};
  for (const int trained_with : {0, 2, 3, 4}) {
    std::optional<files::Network> network;
    if (trained_with > 0) network = stages.learned(stage_of(trained_with)).network;
    const Flown flown = fly(setting, stages.truth(), {"swap", 3, 9, flight_seed(setting)},
                            network ? &*network : nullptr, false);
    std::vector<std::string> row = {curve_name(trained_with)};
    files::Json errors = files::Json::array();
    for (const auto& moments : flown.vehicles) {
      float largest = 0;
      for (const Moment& now : moments) largest = std::max(largest, std::abs(height_error_m(now)));
      row.push_back(fmt::format("{:.3f}", largest));
      errors.push_back(static_cast<double>(largest));
    }
    table.rows.push_back(std::move(row));
    finding.json["controllers"].push_back({{"trained_with", trained_with}, {"max_z_m", std::move(errors)}});
    const std::string name = fmt::format("swaps_{}", trained_with);
    finding.figures.push_back(
        {name,
         series(flown,
                [](const Moment& now) {
                  return fmt::format("{:.3f} {:.5f}\n", now.time_s, height_error_m(now));
                }),
         "set grid\nset xlabel 'time [s]'\nset ylabel 'z - z_d [m]'\nset yrange [-0.2:0.2]\nset key "
         "outside\nplot for [i=0:2] '" +
             name + ".dat' index i with lines lw 2 title sprintf('vehicle %d', i + 1)\n",
         fmt::format("Height errors of three vehicles, {}; aligned at 3.0 s and 7.5 s.",
                     curve_name(trained_with))});
  }
  finding.tables.push_back(std::move(table));
  return finding;
}

namespace {

struct Placement {
  const char* name;
  const char* words;
  bool from_text;               ///< whether the positions come from the paper's text; otherwise they are ours
  std::vector<Relative> stars;  ///< positions and velocities of the neighbours
};

const std::vector<Placement>& placements() {
  static const std::vector<Placement> all = {
      {"a", "one neighbour, hovering", false, {{0, 0, 0, 0, 0, 0}}},
      {"b",
       "one neighbour, moving along y at 0.8 m/s (speed from the text, direction ours)",
       false,
       {{0, 0, 0, 0, 0.8, 0}}},
      {"c", "two neighbours at y = -0.06 and 0.06", true, {{0, -0.06, 0, 0, 0, 0}, {0, 0.06, 0, 0, 0, 0}}},
      {"d", "two neighbours, one 0.25 above the other", false, {{0, 0, 0, 0, 0, 0}, {0, 0, -0.25, 0, 0, 0}}},
      {"e",
       "three neighbours at y = -0.12, 0, 0.12",
       false,
       {{0, -0.12, 0, 0, 0, 0}, {0, 0, 0, 0, 0, 0}, {0, 0.12, 0, 0, 0, 0}}},
      {"f",
       "three neighbours, 0.2 above one another",
       false,
       {{0, 0, 0.2, 0, 0, 0}, {0, 0, 0, 0, 0, 0}, {0, 0, -0.2, 0, 0, 0}}},
  };
  return all;
}

/// Force on a vehicle at rest at (0, y, z).
double force_gf(Interaction& function, const Placement& placement, double y, double z) {
  std::vector<Relative> neighbours = placement.stars;
  for (Relative& star : neighbours) {
    star[1] -= y;
    star[2] -= z;
  }
  return function.force_z_gf(neighbours);
}

/// Forces on a grid of positions in gnuplot's format, and their distance from the truth.
struct HeatMap {
  std::string data;
  double least_gf = INFINITY, most_gf = -INFINITY, rms_gf = 0;
};

HeatMap heat_map(Interaction& learned, Interaction& truth, const Placement& placement) {
  constexpr int kSteps = 61;
  HeatMap map;
  double squares = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const double y = -0.5 + i / (kSteps - 1.0), z = -0.8 + 1.2 * j / (kSteps - 1.0);
      const double force = force_gf(learned, placement, y, z), actual = force_gf(truth, placement, y, z);
      map.least_gf = std::min(map.least_gf, force);
      map.most_gf = std::max(map.most_gf, force);
      squares += (force - actual) * (force - actual) / (kSteps * kSteps);
      map.data += fmt::format("{:.4f} {:.4f} {:.4f} {:.4f}\n", y, z, force, actual);
    }
    map.data += "\n";
  }
  map.data += "\n";
  for (const Relative& star : placement.stars) map.data += fmt::format("{} {}\n", star[1], star[2]);
  map.rms_gf = std::sqrt(squares);
  return map;
}

/// The map of the network next to that of the truth.
std::string heat_map_script(const std::string& name) {
  const auto plot = [&name](const char* title, int column) {
    return fmt::format(
        "set title '{0}'\nplot '{1}.dat' index 0 using 1:2:{2} with image notitle, '{1}.dat' index 1 with "
        "points pt 3 lc 'blue' ps 2 notitle\n",
        title, name, column);
  };
  return "set multiplot layout 1,2\nset xrange [-0.5:0.5]\nset yrange [-0.8:0.4]\nset xlabel 'y [m]'\nset "
         "ylabel 'z [m]'\nset cblabel 'f_{a,z} [gf]'\nset palette defined (0 '#2166ac', 0.7 '#f7f7f7', 1 "
         "'#b2182b')\nset cbrange [-14:6]\n" +
         plot("network", 3) + plot("truth", 4) + "unset multiplot\n";
}

}  // namespace

Finding figure_heatmap(const Setting& setting) {
  Finding finding;
  Stages stages = stages_of(setting);
  finding.json["truth"] = stages.truth().name;
  finding.json["trained_with"] = 3;
  finding.json["maps"] = files::Json::array();
  Interaction learned(stages.learned(stage_of(3)).network), truth(stages.truth());
  Table table = {"Force along z over places (0, y, z), network trained with 3",
                 {"map", "places", "least [gf]", "largest [gf]", "RMS from the truth [gf]"},
                 {}};
  for (const Placement& placement : placements()) {
    HeatMap map = heat_map(learned, truth, placement);
    table.rows.push_back({placement.name,
                          std::string(placement.words) + (placement.from_text ? "" : " (ours)"),
                          fmt::format("{:.1f}", map.least_gf), fmt::format("{:.1f}", map.most_gf),
                          fmt::format("{:.2f}", map.rms_gf)});
    finding.json["maps"].push_back({{"map", placement.name},
                                    {"words", placement.words},
                                    {"places_from_the_text", placement.from_text},
                                    {"least_gf", map.least_gf},
                                    {"most_gf", map.most_gf},
                                    {"rms_from_truth_gf", map.rms_gf}});
    const std::string name = fmt::format("heatmap_{}", placement.name);
    finding.figures.push_back(
        {name, std::move(map.data), heat_map_script(name),
         fmt::format("({}) {}; {}.", placement.name, placement.words,
                     placement.from_text ? "places from the paper's text" : "places chosen by us")});
  }
  finding.tables.push_back(std::move(table));
  const double probe = force_gf(learned, placements()[2], -0.3, -0.5),
               actual = force_gf(truth, placements()[2], -0.3, -0.5);
  finding.json["probe"] = {{"map", "c"},          {"y_m", -0.3},        {"z_m", -0.5},
                           {"network_gf", probe}, {"truth_gf", actual}, {"paper_gf", 4}};
  finding.notes.push_back(
      fmt::format("At (0, -0.3, -0.5) in map c the network predicts {:.2f} gf and the truth is {:.2f} gf; "
                  "the paper's network predicted 4 gf.{}",
                  probe, actual, setting.updraft ? "" : " This truth has no updraft; --updraft adds one."));
  return finding;
}

Finding figure_validation(const Setting& setting) {
  Finding finding;
  Stages stages = stages_of(setting);
  finding.json["truth"] = stages.truth().name;
  finding.json["trained_with"] = 3;
  finding.json["vehicles"] = files::Json::array();
  const files::Network network = stages.learned(stage_of(3)).network;
  const Flown flown = fly(setting, stages.truth(), {"swap", 4, 9, flight_seed(setting)}, &network, false);
  Table table = {"Swap of four vehicles, network trained with three",
                 {"vehicle", "RMS force [gf]", "RMS error [gf]", "correlation"},
                 {}};
  for (std::size_t i = 0; i < flown.vehicles.size(); ++i) {
    double f2 = 0, e2 = 0, f = 0, g = 0, g2 = 0, fg = 0;
    const auto n = static_cast<double>(flown.vehicles[i].size());
    for (const Moment& now : flown.vehicles[i]) {
      const double a = static_cast<double>(now.interaction_gf), b = static_cast<double>(now.prediction_gf);
      f += a / n;
      g += b / n;
      f2 += a * a / n;
      g2 += b * b / n;
      fg += a * b / n;
      e2 += (a - b) * (a - b) / n;
    }
    const double spread = std::sqrt((f2 - f * f) * (g2 - g * g));
    // The topmost vehicle feels no force, so there is no correlation.
    const bool varies = f2 - f * f > 1e-6;
    table.rows.push_back({std::to_string(i + 1), fmt::format("{:.2f}", std::sqrt(f2)),
                          fmt::format("{:.2f}", std::sqrt(e2)),
                          varies ? fmt::format("{:.3f}", (fg - f * g) / spread) : "-"});
    finding.json["vehicles"].push_back(
        {{"vehicle", i + 1},
         {"rms_force_gf", std::sqrt(f2)},
         {"rms_error_gf", std::sqrt(e2)},
         {"correlation", varies ? files::Json((fg - f * g) / spread) : files::Json()}});
  }
  finding.tables.push_back(std::move(table));
  finding.figures.push_back(
      {"validation",
       series(flown,
              [](const Moment& now) {
                return fmt::format("{:.3f} {:.4f} {:.4f}\n", now.time_s, now.interaction_gf,
                                   now.prediction_gf);
              }),
       "set multiplot layout 2,2\nset grid\nset yrange [-20:5]\nset ytics 5\nset ylabel 'f_{a,z} [gf]'\nset "
       "key inside bottom right\ndo for [i=0:3] { if (i == 1) { unset key }; if (i == 2) { set xlabel 'time "
       "[s]' }; set title sprintf('vehicle %d', i + 1); plot 'validation.dat' index i using 1:2 with lines "
       "lw 2 lc 'black' title 'truth', '' index i using 1:3 with lines lw 2 lc 'red' title 'prediction' "
       "}\nunset multiplot\n",
       "Force and prediction as flown in a swap of four; the network saw three at most."});
  return finding;
}

}  // namespace swarmcert::reproduction
