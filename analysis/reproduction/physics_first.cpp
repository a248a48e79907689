#include <fmt/core.h>

#include "analysis/identification/budget.h"
#include "analysis/reproduction/recorded.h"

namespace swarmcert::reproduction {

namespace {

/// A model's name and its residuals on the test flights.
using Row = std::pair<std::string, std::vector<ResidualBlock>>;

/// The ladder as a table and in JSON, each row with how much the error falls from the row before.
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

}  // namespace

void physics_first(const Setting& setting, Finding& finding) {
  Recorded recorded = recorded_flights(setting, false);
  const identification::Budget budget =
      identification::error_budget(recorded.fit, recorded.select, "", setting.jobs,
                                   [&](int done, int total) { setting.progress(done, total, "passes"); });
  std::vector<Row> rows;
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
  std::string physics;
  for (const auto& [vehicle, model] : budget.fitted) physics += vehicle + "\n" + stability::to_toml(model);
  const Learned learned =
      train_recorded(setting, recorded, recorded_options(setting), "remainder", "remainder of " + physics);
  judge("+ deep set on the remainder", with_network(recorded.test, learned.folder + "/network.toml"));

  add_rows(rows, finding);
  finding.json["remainder_bound"] = learned.bound;
  finding.notes.push_back(
      fmt::format("Physics first is judged with its own labels (accelerometer filter in the model), the deep "
                  "set alone with the authors': compare rows within a table. Largest joint bound of the deep "
                  "set on the remainder: {:.1f} gf per unit.",
                  learned.bound));
}

}  // namespace swarmcert::reproduction
