#include <fmt/core.h>

#include <cmath>

#include "analysis/identification/budget.h"
#include "analysis/reproduction/recorded.h"
#include "nn/base/json_number.h"

namespace swarmcert::reproduction {

namespace {

/// Name of a model and its residuals on the test flights.
using Row = std::pair<std::string, std::vector<ResidualBlock>>;

/// The ladder as a table and in JSON, each row with the error reduction relative to the previous row.
void add_rows(const std::vector<Row>& rows, Finding& finding) {
  Table table = {"Physics first: vertical residual on test flights",
                 {"model", "RMS [gf]", "90 %", "falls by [gf]", "90 %"},
                 {}};
  finding.json["physics_first"] = files::Json::array();
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const Interval of_row = interval_of(rows[k].second);
    const double rms = rms_gf(rows[k].second);
    files::Json row = {{"model", rows[k].first}, {"rms_gf", rms}, {"interval_gf", of_row}};
    std::vector<std::string> cells = {rows[k].first, gf(rms), gf(of_row), "", ""};
    if (k > 0) {
      const Estimate fall = change(rows[k - 1].second, rows[k].second);
      row["falls_by_gf"] = fall.value_gf;
      row["falls_by_interval_gf"] = fall.interval;
      cells[3] = gf(fall.value_gf);
      cells[4] = gf(fall.interval);
    }
    row["compositions"] = files::Json::object();
    for (const auto& [name, value] : by_composition(rows[k].second)) row["compositions"][name] = value;
    finding.json["physics_first"].push_back(std::move(row));
    table.rows.push_back(std::move(cells));
  }
  finding.tables.push_back(std::move(table));
}

/// All flights except the test flights; every network of the folds leaves out some of them.
Recorded development_flights(const Setting& setting) {
  Recorded recorded = recorded_flights(setting, false);
  auto& fit = recorded.fit.found.flights;
  auto& select = recorded.select.found.flights;
  fit.insert(fit.end(), select.begin(), select.end());
  select.clear();
  return recorded;
}

/// Removes the effects from the models and sets the masses preferred by the fit.
void make_nominal(const identification::Budget& budget, residuals::Inputs& inputs) {
  for (stability::Model& model : inputs.models) {
    model.effects.clear();
    const auto mass = budget.masses_kg.find(model.kind);
    if (mass != budget.masses_kg.end()) model.mass_kg = mass->second;
  }
}

/// Compares physics, physics with the network, and the published networks on the test flights.
void add_beside_published(const Row& physics, const Row& ours, const identification::BudgetRow& published,
                          Finding& finding) {
  Table table = {
      "Physics, then network: vertical residual on test flights, RMS [gf], by neighbours 2 vehicle",
      {"", "physics", "and network", "published network", "ratio"},
      {}};
  files::Json& rows = finding.json["physics_then_network"]["compositions"] = files::Json::array();
  const std::map<std::string, double> with = by_composition(ours.second);
  for (const auto& [name, alone] : by_composition(physics.second)) {
    const double rms = with.at(name);
    const auto found = published.of.find(name);
    const double other = found == published.of.end() ? NAN : found->second.rmse.z / stability::kGramForce_N;
    rows.push_back({{"name", name},
                    {"physics_rms_gf", alone},
                    {"rms_gf", rms},
                    {"published_rms_gf", files::finite(other)}});
    table.rows.push_back({name, gf(alone), gf(rms), gf(other), fmt::format("{:.3f}", rms / other)});
  }
  finding.tables.push_back(std::move(table));
}

/// Adds the decisions made by flights unseen by the networks of the folds, the bounds, and the flights that were left
/// out.
void add_decisions(const Learned& learned, double published_bound, const residuals::Inputs& test,
                   Finding& finding) {
  files::Json& json = finding.json["physics_then_network"];
  json["output_scales"] = learned.support.scales;
  json["silent"] = json["left_out"] = files::Json::array();
  json["bound"] = learned.bound;
  json["published_bound"] = published_bound;
  std::string silent, left_out;
  for (const auto& [composition, errors] : learned.support.silent) {
    json["silent"].push_back(
        {{"vehicles", composition}, {"rms_gf", errors.network}, {"physics_rms_gf", errors.nothing}});
    silent += fmt::format("{}{} ({:.2f} gf with it, {:.2f} without)", silent.empty() ? "" : ", ", composition,
                          errors.network, errors.nothing);
  }
  for (const residuals::FlightFiles& flight : test.found.flights) {
    json["left_out"].push_back(flight.name);
    left_out += (left_out.empty() ? "" : ", ") + flight.name;
  }
  finding.notes.push_back("Compositions that the development flights leave without a network: " +
                          (silent.empty() ? "none" : silent) + ".");
  finding.notes.push_back(fmt::format(
      "Largest joint Lipschitz bound, proved: {:.1f} gf per unit of input, of the published networks {:.1f}.",
      learned.bound, published_bound));
  finding.notes.push_back("Left out of physics, networks and decisions, and judged here: " + left_out +
                          ". The published networks had seen these flights when they were trained.");
}

}  // namespace

void physics_first(const Setting& setting, Finding& finding) {
  Recorded recorded = development_flights(setting);
  const identification::Budget budget = identification::error_budget(
      recorded.fit, recorded.test, published_network(setting), setting.jobs,
      [&](int done, int total) { setting.progress(done, total, "passes over the flights: physics"); });
  std::vector<Row> rows;
  const auto judge = [&](const std::string& name, const residuals::Inputs& inputs) {
    rows.emplace_back(name, residual_blocks(inputs, setting.jobs));
  };
  for (residuals::Inputs* inputs : {&recorded.fit, &recorded.select, &recorded.test})
    make_nominal(budget, *inputs);
  judge("nominal", recorded.test);
  for (const identification::BudgetRow& row : budget.rows) {
    if (row.models.empty()) continue;
    recorded.test.vehicle_models = row.models;
    judge("+ " + row.name, recorded.test);
  }
  for (residuals::Inputs* inputs : {&recorded.fit, &recorded.select, &recorded.test})
    inputs->vehicle_models = budget.fitted;
  std::string physics;
  for (const auto& [vehicle, model] : budget.fitted) physics += vehicle + "\n" + stability::to_toml(model);
  const Learned learned =
      train_recorded(setting, recorded, folds_options(setting), "remainder", "remainder of " + physics);
  judge("+ deep set on the remainder", with_network(recorded.test, learned.folder + "/network.toml"));

  add_rows(rows, finding);
  add_beside_published(rows[rows.size() - 2], rows.back(), budget.rows.back(), finding);
  add_decisions(learned, certified_published(setting).largest(), recorded.test, finding);
  finding.json["remainder_bound"] = learned.bound;
  finding.notes.push_back(
      "Physics first is judged with its own labels (accelerometer filter in the model), the deep set alone "
      "with the "
      "authors': compare rows within a table.");
}

}  // namespace swarmcert::reproduction
