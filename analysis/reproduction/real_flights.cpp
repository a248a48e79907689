#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <tuple>

#include "analysis/learning/trained_network.h"
#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/nearest_labels.h"
#include "analysis/reproduction/recorded.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"

namespace swarmcert::reproduction {
namespace {

namespace fs = std::filesystem;
using TestBlocks = std::vector<ResidualBlock>;

/// Errors of one group of flights.
struct BesideRow {
  std::string name;
  double ours_gf = 0, theirs_gf = 0;
};

/// Our networks beside the published ones: groups, means over them, and the largest ratio in one group.
struct Beside {
  std::vector<BesideRow> rows;
  double mean_ours_gf = 0, mean_theirs_gf = 0, largest_ratio = 0;
  std::string where;
};

void describe_beside_row(files::Record& record, const BesideRow& row) {
  record.field("name", row.name, "");
  record.field("rms_gf", row.ours_gf, "", "gf", "estimate");
  record.field("published_rms_gf", row.theirs_gf, "Of the published networks.", "gf", "estimate");
}

Beside beside(const std::map<std::string, double>& ours, const std::map<std::string, double>& theirs) {
  Beside result;
  const auto n = static_cast<double>(ours.size());
  for (const auto& [name, rms] : ours) {
    const double other = theirs.at(name);
    result.rows.push_back({name, rms, other});
    result.mean_ours_gf += rms / n;
    result.mean_theirs_gf += other / n;
    if (rms / other > result.largest_ratio) {
      result.largest_ratio = rms / other;
      result.where = name;
    }
  }
  return result;
}

void show_beside(const std::string& title, const Beside& compared, Finding& finding) {
  Table table = {title, {{"", "ours [gf]", "published [gf]", "ratio"}, {}}};
  std::vector<BesideRow> rows = compared.rows;
  rows.push_back({"mean", compared.mean_ours_gf, compared.mean_theirs_gf});
  for (const BesideRow& row : rows)
    table.cells.rows.push_back({row.name, fmt::format("{:.2f}", row.ours_gf),
                                fmt::format("{:.2f}", row.theirs_gf),
                                fmt::format("{:.3f}", row.ours_gf / row.theirs_gf)});
  finding.tables.push_back(std::move(table));
}

/// One vehicle in one flight, with our networks, the published ones, and the labels of the nearest records.
struct TrackRow {
  TrackError ours, theirs;
  std::optional<NearestLabels> nearest;
  double lost() const { return ours.squares_gf2() - theirs.squares_gf2(); }
};

void describe(files::Record& record, const TrackRow& row) {
  const auto nearest = [&row](double NearestLabels::*value) {
    return row.nearest ? std::optional(*row.nearest.*value) : std::nullopt;
  };
  record.field("flight", row.ours.flight, "");
  record.field("vehicle", row.ours.vehicle, "");
  record.field("mean_gf", row.ours.mean_gf, "Of the residual.", "gf");
  record.field("spread_gf", row.ours.spread_gf, "About this mean.", "gf");
  record.field("published_mean_gf", row.theirs.mean_gf, "Of the published networks.", "gf");
  record.field("published_spread_gf", row.theirs.spread_gf, "Likewise.", "gf");
  record.field("nearest_mean_gf", nearest(&NearestLabels::mean_gf),
               "Of the labels minus those of the nearest records that were fitted; null: none are near.",
               "gf");
  record.field("nearest_rms_gf", nearest(&NearestLabels::rms_gf), "Likewise.", "gf");
}

/// The deep set alone, with the authors' own labels: lagged thrust, acceleration as logged, and their masses.
struct DeepSetAlone {
  Learned learned;
  std::string recorded_sha256;
  Beside compositions, scenarios, spreads;
  std::vector<TrackRow> tracks;
  Beside having_seen;  ///< by scenario, of networks fitted to the test flights as well
  double having_seen_bound = 0;
  /// Function, bound of ours, published bound.
  std::vector<std::tuple<std::string, double, double>> bounds;
};

void describe_means(files::Record& record, double ours, double published) {
  record.field("ours", ours, "", "gf", "estimate");
  record.field("published", published, "", "gf", "estimate");
}

void describe_having_seen(files::Record& record, const DeepSetAlone& alone) {
  record.field("mean_rms_gf", alone.having_seen.mean_ours_gf, "Over scenarios.", "gf");
  record.field("published_mean_rms_gf", alone.having_seen.mean_theirs_gf, "Likewise.", "gf");
  record.field("largest_ratio", alone.having_seen.largest_ratio, "Ours over published.");
  record.list("scenarios", alone.having_seen.rows, "", describe_beside_row);
  record.field("bound", alone.having_seen_bound, "Largest joint Lipschitz bound.", "gf/unit",
               "proved upper bound");
}

void describe(files::Record& record, const DeepSetAlone& alone) {
  record.list("networks", alone.learned.scores, "The networks that competed.",
              [](files::Record& r, const auto& score) {
                r.field("seed", score.first, "");
                r.field("select_gf", score.second, "Error on the selecting flights.", "gf");
              });
  record.field("kept_seed", alone.learned.kept_seed, "Of the network that the selecting flights prefer.");
  record.field("recorded_sha256", alone.recorded_sha256, "Sum of the recorded data.");
  record.list("compositions", alone.compositions.rows, "Errors by kinds of neighbours and vehicle.",
              describe_beside_row);
  record.list("scenarios", alone.scenarios.rows, "The same by scenario.", describe_beside_row);
  record.object("mean_rms_gf", "Mean over compositions.", [&](files::Record& r) {
    describe_means(r, alone.compositions.mean_ours_gf, alone.compositions.mean_theirs_gf);
  });
  record.object("mean_rms_over_scenarios_gf", "Mean over scenarios.", [&](files::Record& r) {
    describe_means(r, alone.scenarios.mean_ours_gf, alone.scenarios.mean_theirs_gf);
  });
  record.object("largest_ratio", "Largest error over that of the published networks.", [&](files::Record& r) {
    r.field("compositions", alone.compositions.largest_ratio, "");
    r.field("scenarios", alone.scenarios.largest_ratio, "");
  });
  record.list("scenario_spreads", alone.spreads.rows,
              "By scenario, without the mean of each vehicle's flight.", describe_beside_row);
  record.field("flights", alone.tracks, "Errors flight by flight.");
  record.object("having_seen_test_flights",
                "Errors of a network that has seen the test flights, for comparison.",
                [&](files::Record& r) { describe_having_seen(r, alone); });
  record.field("published_networks_saw_test_flights", true,
               "Whether the published networks were trained on the flights that test here.");
  record.list("bounds", alone.bounds, "Lipschitz bounds.", [](files::Record& r, const auto& bound) {
    r.field("function", std::get<0>(bound), "set:PHI:RHO.");
    r.field("upper", std::get<1>(bound), "", "gf/unit", "proved upper bound");
    r.field("published_upper", std::get<2>(bound), "", "gf/unit", "proved upper bound");
  });
  record.field("gamma_proved", alone.learned.keeps_gamma, "Whether every layer keeps gamma.", "", "proved");
  record.field("epochs", alone.learned.epochs, "Of the kept network.");
}

struct RealFlightsResult {
  std::optional<DeepSetAlone> alone;
  std::optional<PhysicsFirst> physics;
};

void describe(files::Record& record, const RealFlightsResult& result) {
  record.field("train", "development: runs with index mod 3 = 0 of campaign 21, and campaign 23",
               "Flights of the fit.");
  record.field("select", "development: runs with index mod 3 = 1 of campaign 21", "Flights that select.");
  record.field("test", "visible_test", "Flights that test.");
  record.may_fields(result.alone.has_value(),
                    [&](files::Record& r) { describe(r, result.alone.value_or(DeepSetAlone{})); });
  record.may_fields(result.physics.has_value(),
                    [&](files::Record& r) { describe(r, result.physics.value_or(PhysicsFirst{})); });
}

std::vector<TrackRow> track_rows(const learning::LearningData& data, const std::vector<TrackError>& ours,
                                 const std::vector<TrackError>& theirs) {
  const auto nearest = nearest_labels(data);
  std::vector<TrackRow> rows;
  for (std::size_t k = 0; k < ours.size(); ++k) {
    const auto found = nearest.find({ours[k].flight, ours[k].vehicle});
    rows.push_back({ours[k], theirs[k], std::nullopt});
    if (found != nearest.end()) rows.back().nearest = found->second;
  }
  return rows;
}

/// Lists where our networks lose most to the published networks, and how much of the loss is the mean of one flight.
void show_losses(std::vector<TrackRow> rows, Finding& finding) {
  constexpr std::size_t kShown = 8;
  std::stable_sort(rows.begin(), rows.end(),
                   [](const TrackRow& a, const TrackRow& b) { return a.lost() > b.lost(); });
  const auto wins =
      std::find_if(rows.begin(), rows.end(), [](const TrackRow& row) { return row.lost() <= 0; });
  rows.erase(wins, rows.end());
  rows.resize(std::min(rows.size(), kShown));
  finding.add("Where most is lost to the published networks: mean and spread of the residual",
              analysis::table(files::record_of(rows), {{"flight"},
                                                       {"vehicle"},
                                                       {"mean_gf", "ours", "{:+.2f}"},
                                                       {"spread_gf", "and", "{:.2f}"},
                                                       {"published_mean_gf", "published", "{:+.2f}"},
                                                       {"published_spread_gf", "and", "{:.2f}"},
                                                       {"nearest_mean_gf", "nearest records", "{:+.2f}"}}));
  finding.notes.push_back(
      "Nearest records: mean of this flight's labels minus those of the fitted and selecting flights at the "
      "nearest relative states, for vehicles alone or with one neighbour. No function of the relative states "
      "can learn this difference from them.");
}

/// The benefit of having seen the test flights: the same networks, fitted to every flight as the published ones were.
void add_having_seen(const Setting& setting, const Recorded& recorded, const TestBlocks& theirs_blocks,
                     DeepSetAlone& alone) {
  Recorded all = recorded;
  for (const residuals::Inputs* some : {&recorded.select, &recorded.test}) {
    const auto& flights = some->found.flights;
    all.fit.found.flights.insert(all.fit.found.flights.end(), flights.begin(), flights.end());
  }
  all.select = recorded.test;
  const Learned learned = train_recorded(setting, all, recorded_options(setting), "deep-set-seen",
                                         "deep set that saw the test flights");
  const TestBlocks blocks =
      residual_blocks(with_network(recorded.test, learned.folder + "/network.toml"), setting.jobs);
  alone.having_seen = beside(by_scenario(blocks), by_scenario(theirs_blocks));
  alone.having_seen_bound = learned.bound;
}

/// At the full size several networks compete on the selecting flights, along with one fitted to their outputs.
LearnOptions taught_options(const Setting& setting) {
  LearnOptions options = recorded_options(setting);
  options.teachers = setting.full ? 8 : 0;
  return options;
}

DeepSetAlone deep_set_alone(const Setting& setting) {
  const Recorded recorded = recorded_flights(setting, true);
  DeepSetAlone alone;
  alone.learned = train_recorded(setting, recorded, taught_options(setting), "deep-set", "deep set alone");
  alone.recorded_sha256 = files::sha256(recorded_key(setting, recorded));
  const TestBlocks ours_blocks =
      residual_blocks(with_network(recorded.test, alone.learned.folder + "/network.toml"), setting.jobs);
  const TestBlocks theirs_blocks =
      residual_blocks(with_network(recorded.test, published_network(setting)), setting.jobs);
  alone.compositions = beside(by_composition(ours_blocks), by_composition(theirs_blocks));
  alone.scenarios = beside(by_scenario(ours_blocks), by_scenario(theirs_blocks));
  const std::vector<TrackError> ours = by_track(ours_blocks), published = by_track(theirs_blocks);
  alone.spreads = beside(spread_by_scenario(ours), spread_by_scenario(published));
  alone.tracks = track_rows(load_recorded(setting, recorded, recorded_options(setting)), ours, published);
  add_having_seen(setting, recorded, theirs_blocks, alone);
  for (const auto& [function, upper] : alone.learned.set_bounds)
    for (const auto& [other, published_upper] : certified_published(setting).set_bounds)
      if (function == other) alone.bounds.emplace_back(function, upper, published_upper);
  return alone;
}

void show_alone(const DeepSetAlone& alone, Finding& finding) {
  const auto& [learned, sum, compositions, scenarios, spreads, tracks, seen, seen_bound, bounds] = alone;
  if (learned.scores.size() > 1) {
    std::vector<std::string> scores;
    for (const auto& [seed, score_gf] : learned.scores)
      scores.push_back(fmt::format("{:.3f} (seed {})", score_gf, seed));
    finding.notes.push_back(
        fmt::format("Errors on the selecting flights, in gf, of {} networks and of one fitted to their "
                    "outputs: {}. The least error decided: seed {}.",
                    scores.size() - 1, fmt::join(scores, ", "), learned.kept_seed));
  }
  show_beside("Vertical residual on test flights, RMS, by neighbours 2 vehicle", compositions, finding);
  show_beside("The same by scenario", scenarios, finding);
  show_beside("The same by scenario, without the mean of each vehicle's flight", spreads, finding);
  show_losses(tracks, finding);
  show_beside("The same by scenario, ours fitted to the test flights as well", seen, finding);
  finding.notes.push_back(fmt::format(
      "On an equal footing, ours fitted to the test flights as the published networks were: {:.3f} gf in "
      "the mean over scenarios against {:.3f} gf, largest ratio {:.3f} ({}), largest joint bound {:.1f}.",
      seen.mean_ours_gf, seen.mean_theirs_gf, seen.largest_ratio, seen.where, seen_bound));
  finding.show("Lipschitz bounds, proved", "bounds",
               {{"function"}, {"upper", "ours", "{:.1f}"}, {"published_upper", "published", "{:.1f}"}});
  finding.notes.push_back(
      "The published networks had seen these test flights when they were trained; ours had not.");
  finding.notes.push_back(fmt::format(
      "Mean over compositions: ours {:.3f} gf, published {:.3f} gf; over scenarios {:.3f} and {:.3f} gf. "
      "Largest ratio {:.3f} ({}); by scenario {:.3f} ({}), without the means of single flights {:.3f} ({}).",
      compositions.mean_ours_gf, compositions.mean_theirs_gf, scenarios.mean_ours_gf,
      scenarios.mean_theirs_gf, compositions.largest_ratio, compositions.where, scenarios.largest_ratio,
      scenarios.where, spreads.largest_ratio, spreads.where));
}

Finding run_real_flights(const Setting& setting) {
  if (setting.recorded.empty() || !fs::exists(fs::path(setting.recorded) / "flights")) {
    throw files::InputError({setting.recorded, "", "--recorded", "",
                             "no folder with flights and weights of the published data",
                             "see the README on where to get it, and name its folder"});
  }
  RealFlightsResult result;
  if (setting.shard.has(0)) result.alone = deep_set_alone(setting);
  if (setting.shard.has(1)) result.physics = physics_first(setting);
  Finding finding;
  finding.fields = files::record_of(result);
  if (result.alone) show_alone(*result.alone, finding);
  if (result.physics) show_physics(*result.physics, finding);
  add_inputs(recorded_flights(setting, true), finding);
  return finding;
}

}  // namespace

Experiment real_flights() {
  return experiment<RealFlightsResult>("real-flights",
                                       "the published flights: beside the published networks; physics first",
                                       run_real_flights);
}

}  // namespace swarmcert::reproduction
