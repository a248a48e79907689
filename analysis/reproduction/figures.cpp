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

/// The network trained with this many vehicles; nothing for 0, the baseline.
std::optional<files::Network> network_of(Stages& stages, int trained_with) {
  if (trained_with == 0) return std::nullopt;
  return stages.learned(stage_of(trained_with)).network;
}

void describe_truth_name(files::Record& record, const std::string& truth) {
  record.field("truth", truth, "Name of the simulated truth.");
}

/// Largest height errors of a controller: of the swarm, or vehicle by vehicle.
template <class Error>
struct ControllerError {
  int trained_with = 0;
  Error max_z_m{};
};

template <class Error>
struct SwapResult {
  std::string truth;
  std::vector<ControllerError<Error>> controllers;
};
using IntroResult = SwapResult<double>;
using SwapsResult = SwapResult<std::vector<double>>;

template <class Error>
void describe(files::Record& record, const SwapResult<Error>& result) {
  describe_truth_name(record, result.truth);
  record.list("controllers", result.controllers, "Largest height error of each controller.",
              [](files::Record& r, const ControllerError<Error>& row) {
                r.field("trained_with", row.trained_with,
                        "Number of vehicles that the network was trained with; 0: no network.");
                r.field("max_z_m", row.max_z_m, "Largest |z - z_d|; a list: of each vehicle.", "m");
              });
}

Finding run_intro(const Setting& setting) {
  Finding finding;
  Stages stages = stages_of(setting);
  IntroResult result{stages.truth().name, {}};
  for (const int trained_with : {0, 2}) {
    const std::optional<files::Network> network = network_of(stages, trained_with);
    const Flown flown = fly(setting, stages.truth(), {"swap", 2, 0, flight_seed(setting)},
                            network ? &*network : nullptr, false);
    result.controllers.push_back({trained_with, largest_error_m(flown, 2)});
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
  finding.fields = files::record_of(result);
  finding.show("Two vehicles swap sides, six times (trained with 0: baseline)", "controllers",
               {{"trained_with"}, {"max_z_m", "largest |z - z_d|", "{:.3f}"}});
  return finding;
}

Finding run_swaps(const Setting& setting) {
  Finding finding;
  Stages stages = stages_of(setting);
  SwapsResult result{stages.truth().name, {}};
  for (const int trained_with : {0, 2, 3, 4}) {
    const std::optional<files::Network> network = network_of(stages, trained_with);
    const Flown flown = fly(setting, stages.truth(), {"swap", 3, 9, flight_seed(setting)},
                            network ? &*network : nullptr, false);
    result.controllers.push_back({trained_with, {}});
    for (const auto& moments : flown.vehicles) {
      float largest = 0;
      for (const Moment& now : moments) largest = std::max(largest, std::abs(height_error_m(now)));
      result.controllers.back().max_z_m.push_back(static_cast<double>(largest));
    }
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
  finding.fields = files::record_of(result);
  finding.show("Three vehicles, two swaps (trained with 0: baseline)", "controllers",
               {{"trained_with"}, {"max_z_m", "largest |z - z_d|, lowest vehicle first", "{:.3f}"}});
  return finding;
}

struct Placement {
  const char* name = "";
  const char* words = "";
  bool from_text = false;       ///< whether the positions come from the paper's text; otherwise they are ours
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
  Placement placement;
  std::string data;
  double least_gf = INFINITY, most_gf = -INFINITY, rms_gf = 0;
};

HeatMap heat_map(Interaction& learned, Interaction& truth, const Placement& placement) {
  constexpr int kSteps = 61;
  HeatMap map;
  map.placement = placement;
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

void describe_heat_map(files::Record& record, const HeatMap& map) {
  record.field("map", map.placement.name, "");
  record.field("words", map.placement.words, "Where the neighbours are.");
  record.field("places_from_the_text", map.placement.from_text, "false: the places are our choice.");
  record.field("least_gf", map.least_gf, "", "gf");
  record.field("most_gf", map.most_gf, "", "gf");
  record.field("rms_from_truth_gf", map.rms_gf, "", "gf");
}

void describe_trained_with(files::Record& record, const std::string& truth) {
  describe_truth_name(record, truth);
  record.field("trained_with", 3, "Number of vehicles that the network was trained with.");
}

struct HeatMapResult {
  std::string truth;
  std::vector<HeatMap> maps;
  double probe_gf = 0, actual_gf = 0;
};

constexpr double kProbeY_m = -0.3, kProbeZ_m = -0.5;

void describe(files::Record& record, const HeatMapResult& result) {
  describe_trained_with(record, result.truth);
  record.list("maps", result.maps, "Force over places, map by map.", describe_heat_map);
  record.object("probe", "The force at the place that the paper states.", [&](files::Record& probe) {
    probe.field("map", "c", "");
    probe.field("y_m", kProbeY_m, "", "m");
    probe.field("z_m", kProbeZ_m, "", "m");
    probe.field("network_gf", result.probe_gf, "", "gf");
    probe.field("truth_gf", result.actual_gf, "", "gf");
    probe.field("paper_gf", 4, "", "gf");
  });
}

Finding run_heatmap(const Setting& setting) {
  Finding finding;
  Stages stages = stages_of(setting);
  HeatMapResult result;
  result.truth = stages.truth().name;
  Interaction learned(stages.learned(stage_of(3)).network), truth(stages.truth());
  for (const Placement& placement : placements()) {
    result.maps.push_back(heat_map(learned, truth, placement));
    const std::string name = fmt::format("heatmap_{}", placement.name);
    finding.figures.push_back(
        {name, result.maps.back().data, heat_map_script(name),
         fmt::format("({}) {}; {}.", placement.name, placement.words,
                     placement.from_text ? "places from the paper's text" : "places chosen by us")});
  }
  result.probe_gf = force_gf(learned, placements()[2], kProbeY_m, kProbeZ_m);
  result.actual_gf = force_gf(truth, placements()[2], kProbeY_m, kProbeZ_m);
  finding.fields = files::record_of(result);
  finding.show("Force along z over places (0, y, z), network trained with 3", "maps",
               {{"map"},
                {"words", "places"},
                {"places_from_the_text", "from the text"},
                {"least_gf", "least", "{:.1f}"},
                {"most_gf", "largest", "{:.1f}"},
                {"rms_from_truth_gf", "RMS from the truth", "{:.2f}"}});
  finding.notes.push_back(
      fmt::format("At (0, -0.3, -0.5) in map c the network predicts {:.2f} gf and the truth is {:.2f} gf; "
                  "the paper's network predicted 4 gf.{}",
                  result.probe_gf, result.actual_gf,
                  setting.updraft ? "" : " This truth has no updraft; --updraft adds one."));
  return finding;
}

struct PredictedVehicle {
  std::size_t vehicle = 0;
  double rms_force_gf = 0, rms_error_gf = 0;
  std::optional<double> correlation;
};

struct ValidationResult {
  std::string truth;
  std::vector<PredictedVehicle> vehicles;
};

void describe(files::Record& record, const ValidationResult& result) {
  describe_trained_with(record, result.truth);
  record.list("vehicles", result.vehicles, "Force and error of the prediction, vehicle by vehicle.",
              [](files::Record& r, const PredictedVehicle& row) {
                r.field("vehicle", row.vehicle, "From 1, the lowest.");
                r.field("rms_force_gf", row.rms_force_gf, "", "gf");
                r.field("rms_error_gf", row.rms_error_gf, "", "gf");
                r.field("correlation", row.correlation, "null: the vehicle feels no force.");
              });
}

Finding run_validation(const Setting& setting) {
  Stages stages = stages_of(setting);
  ValidationResult result{stages.truth().name, {}};
  const files::Network network = stages.learned(stage_of(3)).network;
  const Flown flown = fly(setting, stages.truth(), {"swap", 4, 9, flight_seed(setting)}, &network, false);
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
    result.vehicles.push_back(
        {i + 1, std::sqrt(f2), std::sqrt(e2), varies ? std::optional((fg - f * g) / spread) : std::nullopt});
  }
  Finding finding;
  finding.fields = files::record_of(result);
  finding.show("Swap of four vehicles, network trained with three", "vehicles",
               {{"vehicle"},
                {"rms_force_gf", "RMS force", "{:.2f}"},
                {"rms_error_gf", "RMS error", "{:.2f}"},
                {"correlation", "", "{:.3f}"}});
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

}  // namespace

Experiment figure_intro() {
  return experiment<IntroResult>("intro", "fig:intro: two vehicles swap, without and with a network",
                                 run_intro);
}

Experiment figure_swaps() {
  return experiment<SwapsResult>("swaps", "fig:swaps: height errors of three vehicles under four controllers",
                                 run_swaps);
}

Experiment figure_heatmap() {
  return experiment<HeatMapResult>("heatmap", "fig:heatmap: predicted force over places", run_heatmap);
}

Experiment figure_validation() {
  return experiment<ValidationResult>("validation", "fig:validation: force and prediction in a swap of four",
                                      run_validation);
}

}  // namespace swarmcert::reproduction
