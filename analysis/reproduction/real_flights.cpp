#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

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

/// Mean over groups, and the largest ratio in one group.
struct Beside {
  double mean_ours_gf = 0, mean_theirs_gf = 0, largest_ratio = 0;
  std::string where;
};

Beside beside(const std::map<std::string, double>& ours, const std::map<std::string, double>& theirs,
              const std::string& title, Finding& finding, files::Json& json) {
  Beside result;
  Table table = {title, {"", "ours [gf]", "published [gf]", "ratio"}, {}};
  for (const auto& [name, rms] : ours) {
    const double other = theirs.at(name);
    table.rows.push_back({name, gf(rms), gf(other), fmt::format("{:.3f}", rms / other)});
    json.push_back({{"name", name}, {"rms_gf", rms}, {"published_rms_gf", other}});
    result.mean_ours_gf += rms / static_cast<double>(ours.size());
    result.mean_theirs_gf += other / static_cast<double>(ours.size());
    if (rms / other > result.largest_ratio) {
      result.largest_ratio = rms / other;
      result.where = name;
    }
  }
  table.rows.push_back({"mean", gf(result.mean_ours_gf), gf(result.mean_theirs_gf),
                        fmt::format("{:.3f}", result.mean_ours_gf / result.mean_theirs_gf)});
  finding.tables.push_back(std::move(table));
  return result;
}

/// Lists where our networks lose most to the published networks, and how much of the loss is the mean of one flight.
void add_flights(const learning::LearningData& data, const std::vector<TrackError>& ours,
                 const std::vector<TrackError>& theirs, Finding& finding) {
  constexpr std::size_t kShown = 8;
  const auto nearest = nearest_labels(data);
  const auto lost = [&](std::size_t k) { return ours[k].squares_gf2() - theirs[k].squares_gf2(); };
  finding.json["flights"] = files::Json::array();
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < ours.size(); ++k) {
    order.push_back(k);
    files::Json row = {{"flight", ours[k].flight},
                       {"vehicle", ours[k].vehicle},
                       {"mean_gf", ours[k].mean_gf},
                       {"spread_gf", ours[k].spread_gf},
                       {"published_mean_gf", theirs[k].mean_gf},
                       {"published_spread_gf", theirs[k].spread_gf}};
    const auto found = nearest.find({ours[k].flight, ours[k].vehicle});
    row["nearest_mean_gf"] = found == nearest.end() ? files::Json() : files::Json(found->second.mean_gf);
    row["nearest_rms_gf"] = found == nearest.end() ? files::Json() : files::Json(found->second.rms_gf);
    finding.json["flights"].push_back(std::move(row));
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return lost(a) > lost(b); });
  Table table = {"Where most is lost to the published networks: mean and spread of the residual [gf]",
                 {"flight", "vehicle", "ours", "published", "nearest records"},
                 {}};
  for (std::size_t i = 0; i < std::min(kShown, order.size()) && lost(order[i]) > 0; ++i) {
    const TrackError &own = ours[order[i]], &other = theirs[order[i]];
    const auto found = nearest.find({own.flight, own.vehicle});
    table.rows.push_back({own.flight, own.vehicle,
                          fmt::format("{:+.2f} and {:.2f}", own.mean_gf, own.spread_gf),
                          fmt::format("{:+.2f} and {:.2f}", other.mean_gf, other.spread_gf),
                          found == nearest.end() ? "-" : fmt::format("{:+.2f}", found->second.mean_gf)});
  }
  finding.tables.push_back(std::move(table));
  finding.notes.push_back(
      "Nearest records: mean of this flight's labels minus those of the fitted and selecting flights at the "
      "nearest relative states, for vehicles alone or with one neighbour. No function of the relative states "
      "can learn this difference from them.");
}

void add_bounds(const Learned& ours, const learning::Certified& theirs, Finding& finding) {
  Table table = {"Joint Lipschitz bounds, proved [gf per m or m/s]", {"function", "ours", "published"}, {}};
  finding.json["bounds"] = files::Json::array();
  for (const auto& [function, upper] : ours.set_bounds) {
    for (const auto& [other, published] : theirs.set_bounds) {
      if (function != other) continue;
      table.rows.push_back({function, fmt::format("{:.1f}", upper), fmt::format("{:.1f}", published)});
      finding.json["bounds"].push_back(
          {{"function", function}, {"upper", upper}, {"published_upper", published}});
    }
  }
  finding.tables.push_back(std::move(table));
}

/// The benefit of having seen the test flights: the same networks, fitted to every flight as the published ones were.
void add_having_seen(const Setting& setting, const Recorded& recorded, const TestBlocks& theirs_blocks,
                     Finding& finding) {
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
  files::Json scenarios = files::Json::array();
  const Beside compared =
      beside(by_scenario(blocks), by_scenario(theirs_blocks),
             "The same by scenario, ours fitted to the test flights as well", finding, scenarios);
  finding.json["having_seen_test_flights"] = {{"mean_rms_gf", compared.mean_ours_gf},
                                              {"published_mean_rms_gf", compared.mean_theirs_gf},
                                              {"largest_ratio", compared.largest_ratio},
                                              {"scenarios", std::move(scenarios)},
                                              {"bound", learned.bound}};
  finding.notes.push_back(fmt::format(
      "On an equal footing, ours fitted to the test flights as the published networks were: {:.3f} gf in "
      "the mean over scenarios against {:.3f} gf, largest ratio {:.3f} ({}), largest joint bound {:.1f}.",
      compared.mean_ours_gf, compared.mean_theirs_gf, compared.largest_ratio, compared.where, learned.bound));
}

/// At the full size several networks compete on the selecting flights, along with one fitted to their outputs.
LearnOptions taught_options(const Setting& setting) {
  LearnOptions options = recorded_options(setting);
  options.teachers = setting.full ? 8 : 0;
  return options;
}

/// Adds the trained networks, their errors on the selecting flights, and which one was kept.
void add_candidates(const Learned& learned, Finding& finding) {
  finding.json["networks"] = files::Json::array();
  std::string select_gf;
  for (const auto& [seed, score_gf] : learned.scores) {
    finding.json["networks"].push_back({{"seed", seed}, {"select_gf", score_gf}});
    select_gf += fmt::format("{}{:.3f} (seed {})", select_gf.empty() ? "" : ", ", score_gf, seed);
  }
  finding.json["kept_seed"] = learned.kept_seed;
  if (learned.scores.size() > 1) {
    finding.notes.push_back(
        fmt::format("Errors on the selecting flights, in gf, of {} networks and of one fitted to their "
                    "outputs: {}. The least error decided: seed {}.",
                    learned.scores.size() - 1, select_gf, learned.kept_seed));
  }
}

/// The deep set alone, with the authors' own labels: lagged thrust, acceleration as logged, and their masses.
void deep_set_alone(const Setting& setting, Finding& finding) {
  const Recorded recorded = recorded_flights(setting, true);
  const Learned learned =
      train_recorded(setting, recorded, taught_options(setting), "deep-set", "deep set alone");
  add_candidates(learned, finding);
  finding.json["recorded_sha256"] = files::sha256(recorded_key(setting, recorded));
  const std::string network = published_network(setting);
  const TestBlocks ours_blocks =
      residual_blocks(with_network(recorded.test, learned.folder + "/network.toml"), setting.jobs);
  const TestBlocks theirs_blocks = residual_blocks(with_network(recorded.test, network), setting.jobs);
  finding.json["compositions"] = finding.json["scenarios"] = files::Json::array();
  const Beside compositions = beside(by_composition(ours_blocks), by_composition(theirs_blocks),
                                     "Vertical residual on test flights, RMS, by neighbours 2 vehicle",
                                     finding, finding.json["compositions"]);
  const Beside scenarios = beside(by_scenario(ours_blocks), by_scenario(theirs_blocks),
                                  "The same by scenario", finding, finding.json["scenarios"]);
  finding.json["mean_rms_gf"] = {{"ours", compositions.mean_ours_gf},
                                 {"published", compositions.mean_theirs_gf}};
  finding.json["mean_rms_over_scenarios_gf"] = {{"ours", scenarios.mean_ours_gf},
                                                {"published", scenarios.mean_theirs_gf}};
  finding.json["largest_ratio"] = {{"compositions", compositions.largest_ratio},
                                   {"scenarios", scenarios.largest_ratio}};
  const std::vector<TrackError> ours = by_track(ours_blocks), published = by_track(theirs_blocks);
  finding.json["scenario_spreads"] = files::Json::array();
  const Beside spreads = beside(spread_by_scenario(ours), spread_by_scenario(published),
                                "The same by scenario, without the mean of each vehicle's flight", finding,
                                finding.json["scenario_spreads"]);
  add_flights(load_recorded(setting, recorded, recorded_options(setting)), ours, published, finding);
  add_having_seen(setting, recorded, theirs_blocks, finding);
  finding.json["published_networks_saw_test_flights"] = true;
  const learning::Certified theirs = certified_published(setting);
  add_bounds(learned, theirs, finding);
  finding.json["gamma_proved"] = learned.keeps_gamma;
  finding.json["epochs"] = learned.epochs;
  finding.notes.push_back(
      "The published networks had seen these test flights when they were trained; ours had not.");
  finding.notes.push_back(fmt::format(
      "Mean over compositions: ours {:.3f} gf, published {:.3f} gf; over scenarios {:.3f} and {:.3f} gf. "
      "Largest ratio {:.3f} ({}); by scenario {:.3f} ({}), without the means of single flights {:.3f} ({}).",
      compositions.mean_ours_gf, compositions.mean_theirs_gf, scenarios.mean_ours_gf,
      scenarios.mean_theirs_gf, compositions.largest_ratio, compositions.where, scenarios.largest_ratio,
      scenarios.where, spreads.largest_ratio, spreads.where));
}

}  // namespace

Finding real_flights(const Setting& setting) {
  if (setting.recorded.empty() || !fs::exists(fs::path(setting.recorded) / "flights")) {
    throw files::InputError({setting.recorded, "", "--recorded", "",
                             "no folder with flights and weights of the published data",
                             "see the README on where to get it, and name its folder"});
  }
  Finding finding;
  finding.json["train"] = "development: runs with index mod 3 = 0 of campaign 21, and campaign 23";
  finding.json["select"] = "development: runs with index mod 3 = 1 of campaign 21";
  finding.json["test"] = "visible_test";
  if (setting.shard.has(0)) deep_set_alone(setting, finding);
  if (setting.shard.has(1)) physics_first(setting, finding);
  add_inputs(recorded_flights(setting, true), finding);
  return finding;
}

}  // namespace swarmcert::reproduction
