#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/table_flights.h"
#include "nn/base/json_number.h"

namespace swarmcert::reproduction {
namespace {

/// Conditions of the flights that the paper does not state.
struct Condition {
  const char* truth;     ///< name; networks are trained on flights of this truth with a full battery
  double norm_exponent;  ///< of the composition of its wakes
  double battery_V;      ///< at take-off of the judged flights
  double higher_m;       ///< above the published heights
};

/// The composition found in recorded flights, that of the table's baselines, and both extremes; each with a full
/// battery, with a nearly empty one, and near the floor.
constexpr std::array<Condition, 12> kConditions = {{{"flights", 1.85, 4.1, kHigher_m},
                                                    {"flights", 1.85, 3.1, kHigher_m},
                                                    {"calibrated", 1.15, 4.1, kHigher_m},
                                                    {"calibrated", 1.15, 3.1, kHigher_m},
                                                    {"flights", 1.85, 4.1, 0},
                                                    {"calibrated", 1.15, 4.1, 0},
                                                    {"sum", 1, 4.1, kHigher_m},
                                                    {"sum", 1, 3.1, kHigher_m},
                                                    {"sum", 1, 4.1, 0},
                                                    {"strongest", 8, 4.1, kHigher_m},
                                                    {"strongest", 8, 3.1, kHigher_m},
                                                    {"strongest", 8, 4.1, 0}}};
constexpr std::size_t kSmallConditions = 4;  ///< flown at small size with the networks of the table

/// The three results under one condition.
struct Claims {
  double two_at_four = 0;        ///< error of the baseline over that of the network trained with two, at four
  double saturated_share = 0;    ///< of control periods, worst vehicle and flight of three to five vehicles
  int falling = 0, columns = 0;  ///< vehicle counts whose errors fall from training with 2 to 3 to 4
  double growth = 0;             ///< error of the baseline at five vehicles over that at two

  bool harms() const { return two_at_four < 1; }
  bool saturates() const { return saturated_share > 0; }
  bool always_falls() const { return falling == columns; }
};

Claims judged(const files::Json& flights) {
  const Spreads errors = height_spreads(flights);
  Claims claims;
  claims.two_at_four = errors[0][2].median_m / errors[1][2].median_m;
  claims.growth = errors[0][3].median_m / errors[0][0].median_m;
  for (const files::Json& flight : flights) {
    if (flight.at("vehicles").get<int>() >= 3)
      claims.saturated_share = std::max(claims.saturated_share, flight.at("saturated_share").get<double>());
  }
  for (std::size_t v = 0; v < 4; ++v, ++claims.columns) {
    const double with_two = errors[1][v].median_m, with_three = errors[2][v].median_m;
    // tab:nnperf omits the network trained with two vehicles at five vehicles.
    const bool from_two = std::isnan(kPaper_m[1][v]) || with_three < with_two;
    claims.falling += from_two && errors[3][v].median_m < with_three ? 1 : 0;
  }
  return claims;
}

/// Index of the first condition with the same truth, which shares its networks: one shard trains them.
int first_of_truth(const Condition& condition) {
  const auto is_same = [&](const Condition& other) { return std::string(other.truth) == condition.truth; };
  return static_cast<int>(std::find_if(kConditions.begin(), kConditions.end(), is_same) -
                          kConditions.begin());
}

/// The flights of one condition with all training seeds; this shard computes its own share of them.
files::Json flights_under(const Setting& setting, const Condition& condition) {
  const Truth trained = with_norm_exponent(setting, condition.truth, condition.norm_exponent);
  Truth flown = trained;
  flown.battery_V = condition.battery_V;
  files::Json flights = files::Json::array();
  for (int k = 0; k < scale_of(setting).training_seeds; ++k) {
    if (!setting.shard.has(first_of_truth(condition) * scale_of(setting).training_seeds + k)) continue;
    const std::string name =
        fmt::format("{}{}-{}/claims-{:g}V-{:g}m-{}.json", condition.truth, setting.updraft ? "-updraft" : "",
                    k, condition.battery_V, condition.higher_m, setting.seed);
    Stages stages(setting, trained, k);
    const std::string file = (std::filesystem::path(setting.work) / name).string();
    for (const files::Json& flight : table_flights(setting, stages, flown, k, condition.higher_m, file))
      flights.push_back(flight);
  }
  return flights;
}

std::string answer(bool appears) { return appears ? "yes" : "no"; }

void add(const Condition& condition, const files::Json& flights, Table& table, Finding& finding) {
  const Claims claims = judged(flights);
  table.rows.push_back({fmt::format("{:g}", condition.norm_exponent),
                        fmt::format("{:g}", condition.battery_V), fmt::format("{:g}", condition.higher_m),
                        fmt::format("{:.2f}", claims.growth),
                        fmt::format("{:.2f} {}", claims.two_at_four, answer(claims.harms())),
                        fmt::format("{:.1f} % {}", 100 * claims.saturated_share, answer(claims.saturates())),
                        fmt::format("{} of {}", claims.falling, claims.columns)});
  finding.json["conditions"].push_back(
      {{"truth", condition.truth},
       {"norm_exponent", condition.norm_exponent},
       {"battery_V", condition.battery_V},
       {"higher_m", condition.higher_m},
       {"baseline_growth", files::finite(claims.growth)},
       {"improvement_trained_with_2_at_4", files::finite(claims.two_at_four)},
       {"saturated_share", claims.saturated_share},
       {"columns_where_errors_fall", claims.falling},
       {"columns", claims.columns},
       {"two_harms_four", claims.harms()},
       {"saturates", claims.saturates()},
       {"more_is_best", claims.always_falls()},
       {"flights", flights}});
}

}  // namespace

Finding claims(const Setting& setting) {
  Finding finding;
  finding.json["conditions"] = files::Json::array();
  Table table = {
      "Results of section V-C under conditions that the paper leaves open (medians over seeds)",
      {"p of wakes", "battery [V]", "higher [m]", "baseline 5 / 2", "2 at 4", "saturated", "falls"},
      {}};
  for (std::size_t k = 0; k < (setting.full ? kConditions.size() : kSmallConditions); ++k) {
    const files::Json flights = flights_under(setting, kConditions[k]);
    if (setting.shard.is_whole()) add(kConditions[k], flights, table, finding);
  }
  table.rows.push_back({"paper", "", "", fmt::format("{:.2f}", kPaper_m[0][3] / kPaper_m[0][0]),
                        fmt::format("{:.2f} yes", kPaper_m[0][2] / kPaper_m[1][2]), "yes", "4 of 4"});
  finding.tables.push_back(std::move(table));
  std::array<int, 3> appear = {0, 0, 0};
  int all = 0;
  for (const files::Json& condition : finding.json["conditions"]) {
    const std::array<bool, 3> here = {condition["two_harms_four"], condition["saturates"],
                                      condition["more_is_best"]};
    for (std::size_t i = 0; i < 3; ++i) appear[i] += here[i] ? 1 : 0;
    all += here[0] && here[1] && here[2] ? 1 : 0;
  }
  finding.json["conditions_with_all"] = all;
  finding.notes.push_back(
      fmt::format("Of {} conditions, {} show that a network trained with two vehicles harms four, {} that "
                  "thrust saturates with "
                  "three or more, {} that errors fall with the vehicles in training for every size of the "
                  "swarm; {} show all three.",
                  finding.json["conditions"].size(), appear[0], appear[1], appear[2], all));
  return finding;
}

}  // namespace swarmcert::reproduction
