#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/table_flights.h"
#include "nn/base/json_number.h"

namespace swarmcert::reproduction {
namespace {

namespace fs = std::filesystem;

std::string controller_name(int controller) {
  return controller == 0 ? "Baseline" : fmt::format("Trained w/ {} CF", controller);
}

std::string metres(double value) { return std::isfinite(value) ? fmt::format("{:.3f}", value) : "lost"; }

/// Compares the largest height errors with the paper's: a table, and column["max_z"].
Spreads add_heights(const Truth& truth, const files::Json& flights, files::Json& column, Finding& finding) {
  const Spreads spreads = height_spreads(flights);
  Table table = {
      fmt::format("Maximum z-error [m], truth \"{}\": worst of all seeds (median) | paper", truth.name),
      {"controller", "2 CF swap", "3 CF swap", "4 CF swap", "5 CF swap"},
      {}};
  column["max_z"] = files::Json::array();
  for (std::size_t c = 0; c < 4; ++c) {
    std::vector<std::string> row = {controller_name(kControllers[c])};
    for (std::size_t v = 0; v < 4; ++v) {
      const Spread& spread = spreads[c][v];
      const double paper = kPaper_m[c][v];
      row.push_back(fmt::format("{} ({}) | {}", metres(spread.most_m), metres(spread.median_m),
                                std::isnan(paper) ? "N.A." : fmt::format("{:.3f}", paper)));
      column["max_z"].push_back({{"trained_with", kControllers[c]},
                                 {"vehicles", kLeastVehicles + static_cast<int>(v)},
                                 {"worst_m", files::finite(spread.most_m)},
                                 {"median_m", files::finite(spread.median_m)},
                                 {"least_m", files::finite(spread.least_m)},
                                 {"paper_m", files::finite(paper)}});
    }
    table.rows.push_back(std::move(row));
  }
  finding.tables.push_back(std::move(table));
  return spreads;
}

/// Errors along x and y: a table, and column["xy"].
void add_sideways(const Truth& truth, const files::Json& flights, files::Json& column, Finding& finding) {
  Table sideways = {fmt::format("Errors along x and y [m], truth \"{}\": median, 95 %, largest", truth.name),
                    {"controller", "2 CF swap", "3 CF swap", "4 CF swap", "5 CF swap"},
                    {}};
  column["xy"] = files::Json::array();
  for (const char axis : {'x', 'y'}) {
    for (const int controller : kControllers) {
      std::vector<std::string> row = {fmt::format("{} {}", controller_name(controller), axis)};
      for (int vehicles = kLeastVehicles; vehicles <= kMostVehicles; ++vehicles) {
        const auto of = [&](const char* what) {
          return spread_of(flights, controller, vehicles, fmt::format("{}_{}_m", what, axis).c_str());
        };
        const double p50 = of("p50").median_m, p95 = of("p95").median_m, most = of("max").most_m;
        row.push_back(fmt::format("{}, {}, {}", metres(p50), metres(p95), metres(most)));
        column["xy"].push_back({{"trained_with", controller},
                                {"vehicles", vehicles},
                                {"axis", std::string(1, axis)},
                                {"p50_m", p50},
                                {"p95_m", p95},
                                {"max_m", files::finite(most)}});
      }
      sideways.rows.push_back(std::move(row));
    }
  }
  finding.tables.push_back(std::move(sideways));
}

/// Factors by which networks reduce the worst error, for each training seed: the minimum over the swarms for networks
/// trained with three or four vehicles. The networks of all seeds are compared with the same baseline; the minimum
/// over all seeds therefore involves a worst case over more flights than the baseline has.
std::map<int, double> improvement_by_seed(const files::Json& flights, const Spreads& spreads) {
  std::map<int, double> factor_of_seed;
  for (const files::Json& flight : flights) {
    const int controller = flight.at("trained_with").get<int>();
    if (controller < 3) continue;
    const Spread& baseline = spreads[0][flight.at("vehicles").get<int>() - kLeastVehicles];
    const double most_m = flight.at("max_z_m").is_number() ? flight.at("max_z_m").get<double>() : INFINITY;
    double& least = factor_of_seed.try_emplace(flight.at("training_seed").get<int>(), INFINITY).first->second;
    least = std::min(least, baseline.most_m / most_m);
  }
  return factor_of_seed;
}

/// Summarises the tables in a sentence, with its numbers in `column`.
void add_improvement(const Truth& truth, const files::Json& flights, const Spreads& spreads,
                     files::Json& column, Finding& finding) {
  double farthest = 0;
  for (std::size_t v = 0; v < 4; ++v)
    farthest = std::max(farthest, std::abs(spreads[0][v].most_m / kPaper_m[0][v] - 1));
  double least_factor = INFINITY;  // networks trained with three or four vehicles, over all swarms
  for (std::size_t c = 2; c < 4; ++c) {
    for (std::size_t v = 0; v < 4; ++v)
      least_factor = std::min(least_factor, spreads[0][v].most_m / spreads[c][v].most_m);
  }
  std::vector<std::string> factors;
  column["least_improvement_by_training_seed"] = files::Json::array();
  for (const auto& [seed, factor] : improvement_by_seed(flights, spreads)) {
    column["least_improvement_by_training_seed"].push_back(files::finite(factor));
    factors.push_back(fmt::format("{:.2f}", factor));
  }
  const double two_at_four = spreads[0][2].most_m / spreads[1][2].most_m;
  const double three_at_five = spreads[0][3].most_m / spreads[2][3].most_m;
  column["baseline_farthest_from_paper"] = farthest;
  column["least_improvement_trained_with_3_or_4"] = files::finite(least_factor);
  column["improvement_trained_with_2_at_4"] = files::finite(two_at_four);
  column["improvement_trained_with_3_at_5"] = files::finite(three_at_five);
  finding.notes.push_back(fmt::format(
      "Truth \"{}\": baseline within {:.0f} % of the paper; networks trained with three or four divide the "
      "worst error by at least {:.2f} (training seeds: {}; paper: 1.5 to 3.9); trained with two, at four "
      "vehicles: by {:.2f} (paper: 0.71); trained with three, at five: by {:.2f} (paper: 1.97).",
      truth.name, 100 * farthest, least_factor, fmt::join(factors, ", "), two_at_four, three_at_five));
}

void add_truth(const Truth& truth, const files::Json& flights, Finding& finding) {
  files::Json column = {{"truth", truth.name}, {"knobs", truth.knobs}};
  const Spreads spreads = add_heights(truth, flights, column, finding);
  add_sideways(truth, flights, column, finding);
  add_improvement(truth, flights, spreads, column, finding);
  finding.json["columns"].push_back(std::move(column));
  for (const std::string& knob : truth.knobs)
    finding.notes.push_back(fmt::format("Chosen for truth \"{}\": {}.", truth.name, knob));
}

}  // namespace

Finding performance(const Setting& setting) {
  Finding finding;
  finding.notes.push_back(
      fmt::format("Flown {:.1f} m higher than in the published scripts: there the lowest of five flies at "
                  "0.3 m, and an error of the paper's size would end on the floor. The height is our choice.",
                  kHigher_m));
  finding.json["columns"] = files::Json::array();
  finding.json["swaps_per_flight"] = 6;
  const Scale scale = scale_of(setting);
  int unit = 0;
  for (const Truth& truth : truths(setting)) {
    files::Json flights = files::Json::array();
    for (int k = 0; k < scale.training_seeds; ++k, ++unit) {
      const std::string file =
          (fs::path(setting.work) / fmt::format("{}{}-{}/table-{}.json", truth.name,
                                                setting.updraft ? "-updraft" : "", k, setting.seed))
              .string();
      if (!setting.shard.has(unit)) continue;
      Stages stages(setting, truth, k);
      for (const files::Json& flight : table_flights(setting, stages, truth, k, kHigher_m, file))
        flights.push_back(flight);
    }
    if (!setting.shard.is_whole()) continue;
    add_truth(truth, flights, finding);
    finding.json["columns"].back()["flights"] = std::move(flights);
  }
  return finding;
}

}  // namespace swarmcert::reproduction
