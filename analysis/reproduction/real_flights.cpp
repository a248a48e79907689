#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "analysis/identification/budget.h"
#include "analysis/learning/trained_network.h"
#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/learn.h"
#include "analysis/reproduction/residual_blocks.h"
#include "nn/files/file_io.h"
#include "nn/files/input_error.h"

namespace swarmcert::reproduction {
namespace {

namespace fs = std::filesystem;
using Blocks = std::vector<ResidualBlock>;

/// gf per unit of input. Joint bounds of the published networks: 417.6 for the large pair, 373.7 for the small one, with
/// gamma 3 in every layer, which ours keep as well.
constexpr double kMaxLipschitz = 373;

/// The published flights by use. No fit sees a flight of `test`.
struct Recorded {
  residuals::Inputs fit, select, test;
  learning::LearningFlights flights() const { return {&fit, &select, &test}; }
};

bool is_fitted(const residuals::FlightFiles& flight) {
  return flight.scenario.rfind("23_", 0) == 0 || flight.run % 3 == 0;
}

template <typename Keep>
residuals::Inputs some_flights(const residuals::Inputs& all, const Keep& keep) {
  residuals::Inputs some = all;
  auto& flights = some.found.flights;
  flights.erase(std::remove_if(flights.begin(), flights.end(), [&](const auto& f) { return !keep(f); }),
                flights.end());
  return some;
}

/// The small size takes the flights of one or two small vehicles.
bool is_small(const residuals::FlightFiles& flight) {
  return flight.scenario == "21_randomwalk_s" || flight.scenario == "21_randomwalk_ss" ||
         flight.scenario == "21_swap_ss";
}

Recorded recorded_flights(const Setting& setting, bool published_signals) {
  const auto read = [&](const std::string& folder) {
    residuals::InputArguments arguments;
    arguments.flights = {(fs::path(setting.recorded) / "flights" / folder).string()};
    arguments.fleet = setting.fleet;
    arguments.rules.published_signals = published_signals;
    const residuals::Inputs inputs = residuals::read_inputs(arguments);
    return some_flights(inputs, [&](const auto& flight) { return setting.full || is_small(flight); });
  };
  const residuals::Inputs development = read("development");
  return {some_flights(development, is_fitted),
          some_flights(development, [](const auto& flight) { return !is_fitted(flight); }),
          read("visible_test")};
}

/// `inputs` whose models all have the deep set as one more effect.
residuals::Inputs with_network(residuals::Inputs inputs, const std::string& network) {
  stability::EffectSpec spec;
  spec.name = "deep_set";
  spec.network = fs::absolute(network).string();
  for (stability::Model& model : inputs.models) model.effects.push_back(spec);
  for (auto& [vehicle, model] : inputs.vehicle_models) model.effects.push_back(spec);
  return inputs;
}

/// network.toml of the published weights, which stay where they are.
std::string published_network(const Setting& setting) {
  const fs::path weights = fs::absolute(fs::path(setting.recorded) / "weights/zip_f32");
  std::string text =
      "schema = \"swarmcert/network/1\"\noutput = { quantity = \"force_z\", unit = \"gf\" }\n"
      "gamma = { value = 3.0, scope = \"layer\", mode = \"clip\" }\n";
  for (const char* const part :
       {"phi.small phi_S", "phi.large phi_L", "phi.ground phi_G", "rho.small rho_S", "rho.large rho_L"}) {
    const std::string words = part;
    const std::size_t space = words.find(' ');
    text += fmt::format("[{}]\nweights = {}\n", words.substr(0, space),
                        files::Json((weights / (words.substr(space + 1) + ".pth")).string()).dump());
  }
  const std::string path = (fs::path(setting.work) / "published/network.toml").string();
  fs::create_directories(fs::path(path).parent_path());
  files::write_file(path, text, true);
  return path;
}

std::string key_of(const Setting& setting, const Recorded& recorded, const std::string& what) {
  std::string key = what + (setting.full ? " full" : " small");
  for (const residuals::Inputs* inputs : {&recorded.fit, &recorded.select, &recorded.test}) {
    for (const residuals::FlightFiles& flight : inputs->found.flights) {
      for (const auto& [vehicle, path] : flight.logs) key += files::sha256(files::read_file(path));
    }
    key += ";";
  }
  return key;
}

LearnOptions learn_options(const Setting& setting, int full_epochs) {
  LearnOptions options;
  options.sizes.features = 20;
  options.gamma.value = 3;
  options.max_lipschitz = kMaxLipschitz;
  options.turns = true;
  options.rate = 2e-3;
  options.batch = 1024;
  options.epochs = setting.full ? full_epochs : 3;
  options.seed = setting.seed;
  return options;
}

Learned train(const Setting& setting, const Recorded& recorded, const LearnOptions& options,
              const std::string& name, const std::string& key) {
  const std::string folder = (fs::path(setting.work) / name).string();
  const Learned learned = learn(setting, options, folder, key, [&] {
    return learning::load_learning_data(
        recorded.flights(), options.sizes, learning::SplitBy::kFlights, setting.jobs,
        [&](int done, int total) { setting.progress(done, total, "flights"); });
  });
  return learned;
}

std::string gf(double value) { return fmt::format("{:.2f}", value); }
std::string gf(const residuals::Interval& interval) {
  return fmt::format("{:.2f} .. {:.2f}", interval.lower, interval.upper);
}

/// Mean over groups, and the largest ratio of one group.
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

/// The deep set alone, with the authors' own labels: thrust behind their lag, acceleration as logged, their masses.
void deep_set_alone(const Setting& setting, Finding& finding) {
  const Recorded recorded = recorded_flights(setting, true);
  const Learned learned = train(setting, recorded, learn_options(setting, 8), "deep-set",
                                key_of(setting, recorded, "deep set alone"));
  finding.json["recorded_sha256"] = files::sha256(key_of(setting, recorded, ""));
  const std::string network = published_network(setting);
  const Blocks ours_blocks =
      residual_blocks(with_network(recorded.test, learned.folder + "/network.toml"), setting.jobs);
  const Blocks theirs_blocks = residual_blocks(with_network(recorded.test, network), setting.jobs);
  finding.json["compositions"] = finding.json["scenarios"] = files::Json::array();
  const Beside compositions = beside(by_composition(ours_blocks), by_composition(theirs_blocks),
                                     "Vertical residual on test flights, RMS, by neighbours 2 vehicle",
                                     finding, finding.json["compositions"]);
  const Beside scenarios = beside(by_scenario(ours_blocks), by_scenario(theirs_blocks),
                                  "The same by scenario", finding, finding.json["scenarios"]);
  finding.json["mean_rms_gf"] = {{"ours", compositions.mean_ours_gf},
                                 {"published", compositions.mean_theirs_gf}};
  finding.json["largest_ratio"] = {{"compositions", compositions.largest_ratio},
                                   {"scenarios", scenarios.largest_ratio}};
  finding.json["published_networks_saw_test_flights"] = true;
  lipschitz::CertifyOptions certify;
  certify.jobs = setting.jobs;
  certify.lower.rounds = 0;
  if (!setting.full) certify.method = lipschitz::UpperMethod::kProduct;
  const learning::Certified theirs = learning::write_certificate(
      files::load_network({network, "", "", ""}), (fs::path(setting.work) / "published").string(), certify);
  add_bounds(learned, theirs, finding);
  finding.json["gamma_proved"] = learned.keeps_gamma;
  finding.json["epochs"] = learned.epochs;
  finding.notes.push_back(
      "The published networks had seen these test flights when they were trained; ours had not.");
  finding.notes.push_back(
      fmt::format("Mean over compositions: ours {:.3f} gf, published {:.3f} gf. Largest ratio {:.3f} ({}); "
                  "by scenario {:.3f} "
                  "({}).",
                  compositions.mean_ours_gf, compositions.mean_theirs_gf, compositions.largest_ratio,
                  compositions.where, scenarios.largest_ratio, scenarios.where));
}

/// Physics first: lag, offsets, ground, jet and the rest are fitted, and a deep set learns the remainder.
void physics_first(const Setting& setting, Finding& finding) {
  Recorded recorded = recorded_flights(setting, false);
  const identification::Budget budget =
      identification::error_budget(recorded.fit, recorded.select, "", setting.jobs,
                                   [&](int done, int total) { setting.progress(done, total, "passes"); });
  std::vector<std::pair<std::string, Blocks>> rows;
  const auto judge = [&](const std::string& name, const residuals::Inputs& inputs) {
    rows.emplace_back(name, residual_blocks(inputs, setting.jobs));
  };
  for (residuals::Inputs* inputs : {&recorded.fit, &recorded.select, &recorded.test}) {
    for (stability::Model& model : inputs->models) {
      model.effects.clear();
      const auto mass = budget.masses_kg.find(model.kind);
      if (mass != budget.masses_kg.end()) model.mass_kg = mass->second;
    }
  }
  judge("nominal", recorded.test);
  for (const identification::BudgetRow& row : budget.rows) {
    if (row.models.empty()) continue;
    recorded.test.vehicle_models = row.models;
    judge("+ " + row.name, recorded.test);
  }
  for (residuals::Inputs* inputs : {&recorded.fit, &recorded.select, &recorded.test})
    inputs->vehicle_models = budget.fitted;
  const Learned learned = train(setting, recorded, learn_options(setting, 8), "remainder",
                                key_of(setting, recorded, "remainder"));
  judge("+ deep set on the remainder", with_network(recorded.test, learned.folder + "/network.toml"));

  Table table = {"Physics first: vertical residual on test flights",
                 {"model", "RMS [gf]", "90 %", "falls by [gf]", "90 %"},
                 {}};
  finding.json["physics_first"] = files::Json::array();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const residuals::Interval of_row = interval_of(rows[k].second);
    const double rms = rms_gf(rows[k].second);
    files::Json row = {
        {"model", rows[k].first}, {"rms_gf", rms}, {"interval_gf", {of_row.lower, of_row.upper}}};
    std::vector<std::string> cells = {rows[k].first, gf(rms), gf(of_row), "", ""};
    if (k > 0) {
      const Estimate fall = change(rows[k - 1].second, rows[k].second);
      row["falls_by_gf"] = fall.value_gf;
      row["falls_by_interval_gf"] = {fall.interval.lower, fall.interval.upper};
      cells[3] = gf(fall.value_gf);
      cells[4] = gf(fall.interval);
    }
    row["compositions"] = files::Json::object();
    for (const auto& [name, value] : by_composition(rows[k].second)) row["compositions"][name] = value;
    finding.json["physics_first"].push_back(std::move(row));
    table.rows.push_back(std::move(cells));
  }
  finding.json["remainder_bound"] = learned.bound;
  finding.tables.push_back(std::move(table));
  finding.notes.push_back(
      fmt::format("Physics first is judged with its own labels (accelerometer filter in the model), the deep "
                  "set alone with the "
                  "authors': compare rows within a table. Largest joint bound of the deep set on the "
                  "remainder: {:.1f} gf per unit.",
                  learned.bound));
}

}  // namespace

Finding real_flights(const Setting& setting) {
  if (!fs::exists(fs::path(setting.recorded) / "flights")) {
    throw files::InputError({setting.recorded, "", "--recorded", "",
                             "no folder with flights and weights of the published data",
                             "see the README on where to get it, and name its folder"});
  }
  Finding finding;
  finding.json["train"] = "development: runs with index mod 3 = 0 of campaign 21, and campaign 23";
  finding.json["select"] = "development: runs with index mod 3 = 1 of campaign 21";
  finding.json["test"] = "visible_test";
  if (setting.computes(0)) deep_set_alone(setting, finding);
  if (setting.computes(1)) physics_first(setting, finding);
  finding.complete = setting.shards == 1;
  return finding;
}

}  // namespace swarmcert::reproduction
