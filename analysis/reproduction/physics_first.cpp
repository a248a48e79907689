#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "analysis/identification/budget.h"
#include "analysis/reproduction/recorded.h"

namespace swarmcert::reproduction {

namespace {

/// Name of a model and its residuals on the test flights.
using Row = std::pair<std::string, std::vector<ResidualBlock>>;

std::vector<PhysicsRow> ladder_of(const std::vector<Row>& rows) {
  std::vector<PhysicsRow> ladder;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto& [name, blocks] = rows[k];
    ladder.push_back({name, rms_gf(blocks), interval_of(blocks), std::nullopt, by_composition(blocks)});
    if (k > 0) ladder.back().fall = change(rows[k - 1].second, blocks);
  }
  return ladder;
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
std::vector<PhysicsComposition> compositions_of(const Row& physics, const Row& ours,
                                                const identification::BudgetRow& published) {
  std::vector<PhysicsComposition> rows;
  const std::map<std::string, double> with = by_composition(ours.second);
  for (const auto& [name, alone] : by_composition(physics.second)) {
    const auto found = published.of.find(name);
    rows.push_back({name, alone, with.at(name),
                    found == published.of.end() ? NAN : found->second.rmse.z / stability::kGramForce_N});
  }
  return rows;
}

void describe_physics_row(files::Record& record, const PhysicsRow& row) {
  record.field("model", row.model, "");
  record.field("rms_gf", row.rms_gf, "", "gf", "estimate");
  record.field("interval_gf", row.interval_gf, "90 %.", "gf", "estimate");
  record.may("falls_by_gf", row.fall ? std::optional(row.fall->value_gf) : std::nullopt,
             "From the row before.", "gf", "estimate");
  record.may("falls_by_interval_gf", row.fall ? std::optional(row.fall->interval) : std::nullopt, "90 %.",
             "gf", "estimate");
  record.field("compositions", row.compositions, "RMS by composition.", "gf");
}

void describe_physics_composition(files::Record& record, const PhysicsComposition& row) {
  record.field("name", row.name, "Kinds of neighbours and vehicle.");
  record.field("physics_rms_gf", row.physics_gf, "Of the fitted effects.", "gf");
  record.field("rms_gf", row.with_network_gf, "With the networks behind them.", "gf");
  record.field("published_rms_gf", row.published_gf, "Of the published networks; null: none.", "gf");
}

}  // namespace

void describe(files::Record& record, const PhysicsFirst& physics) {
  record.list("physics_first", physics.ladder, "Errors where effects are fitted before the network.",
              describe_physics_row);
  record.object(
      "physics_then_network",
      "Fitted effects, then networks of the folds behind them, beside the published networks.",
      [&](files::Record& then) {
        then.list("compositions", physics.compositions,
                  "On the test flights, by kinds of neighbours and vehicle.", describe_physics_composition);
        then.field("output_scales", physics.support.scales,
                   "Factor of each kind's output, chosen on flights that the network had not seen.");
        const std::vector<std::pair<std::string, learning::SupportedErrors>> silent(
            physics.support.silent.begin(), physics.support.silent.end());
        then.list("silent", silent,
                  "Compositions without a network, with the errors on flights that it had not seen.",
                  [](files::Record& r, const auto& one) {
                    r.field("vehicles", one.first, "");
                    r.field("rms_gf", one.second.network, "With the network.", "gf");
                    r.field("physics_rms_gf", one.second.nothing, "Without it.", "gf");
                  });
        then.field("left_out", physics.left_out,
                   "Flights that neither fit nor decide anything: those of compositions.");
        then.field("bound", physics.bound, "Largest joint Lipschitz bound.", "gf/unit", "proved upper bound");
        then.field("published_bound", physics.published_bound, "That of the published networks.", "gf/unit",
                   "proved upper bound");
      });
  record.field("remainder_bound", physics.bound, "Of the network behind the fitted effects.", "gf/unit",
               "proved upper bound");
}

void show_physics(const PhysicsFirst& physics, Finding& finding) {
  finding.show("Physics first: vertical residual on test flights", "physics_first",
               {{"model"},
                {"rms_gf", "RMS", "{:.2f}"},
                {"interval_gf", "90 %", "{:.2f}"},
                {"falls_by_gf?", "falls by", "{:.2f}"},
                {"falls_by_interval_gf?", "90 %", "{:.2f}"}});
  finding.add("Physics, then network: vertical residual on test flights, RMS, by neighbours 2 vehicle",
              analysis::table(*finding.fields.find("physics_then_network.compositions"),
                              {{"name", "vehicles"},
                               {"physics_rms_gf", "physics", "{:.2f}"},
                               {"rms_gf", "and network", "{:.2f}"},
                               {"published_rms_gf", "published network", "{:.2f}"}}));
  std::vector<std::string> silent;
  for (const auto& [composition, errors] : physics.support.silent)
    silent.push_back(
        fmt::format("{} ({:.2f} gf with it, {:.2f} without)", composition, errors.network, errors.nothing));
  finding.notes.push_back(
      fmt::format("Compositions that the development flights leave without a network: {}.",
                  silent.empty() ? "none" : fmt::format("{}", fmt::join(silent, ", "))));
  finding.notes.push_back(fmt::format(
      "Largest joint Lipschitz bound, proved: {:.1f} gf per unit of input, of the published networks {:.1f}.",
      physics.bound, physics.published_bound));
  finding.notes.push_back(
      fmt::format("Left out of physics, networks and decisions, and judged here: {}. The published networks "
                  "had seen these flights when they were trained.",
                  fmt::join(physics.left_out, ", ")));
  finding.notes.push_back(
      "Physics first is judged with its own labels (accelerometer filter in the model), the deep set alone "
      "with the authors': compare rows within a table.");
}

PhysicsFirst physics_first(const Setting& setting) {
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
  std::string fitted;
  for (const auto& [vehicle, model] : budget.fitted) fitted += vehicle + "\n" + stability::to_toml(model);
  const Learned learned =
      train_recorded(setting, recorded, folds_options(setting), "remainder", "remainder of " + fitted);
  judge("+ deep set on the remainder", with_network(recorded.test, learned.folder + "/network.toml"));

  PhysicsFirst physics;
  physics.ladder = ladder_of(rows);
  physics.compositions = compositions_of(rows[rows.size() - 2], rows.back(), budget.rows.back());
  physics.support = learned.support;
  for (const residuals::FlightFiles& flight : recorded.test.found.flights)
    physics.left_out.push_back(flight.name);
  physics.bound = learned.bound;
  physics.published_bound = certified_published(setting).largest();
  return physics;
}

}  // namespace swarmcert::reproduction
