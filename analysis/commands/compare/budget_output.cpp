#include "analysis/commands/compare/budget_output.h"

#include <fmt/core.h>

#include <filesystem>
#include <map>
#include <optional>

#include "nn/base/file_io.h"

namespace swarmcert::analysis {
namespace {

using identification::Budget;
using identification::BudgetRow;

const BudgetRow* network_row(const Budget& budget) {
  return budget.rows.back().name == "network" ? &budget.rows.back() : nullptr;
}

/// The row with all effects.
const BudgetRow& last_row(const Budget& budget) {
  return budget.rows[budget.rows.size() - (network_row(budget) != nullptr ? 2 : 1)];
}

double rmse_z(const BudgetRow& row, const std::string& group) {
  const auto found = row.of.find(group);
  return found == row.of.end() ? 0 : found->second.rmse.z;
}

double drop(const Budget& budget, const std::string& group) {
  const double before = rmse_z(budget.rows[0], group);
  return before > 0 ? 1 - rmse_z(last_row(budget), group) / before : 0;
}

}  // namespace

void describe_budget(files::Record& record, const Budget& budget) {
  using Values = std::map<std::string, double>;
  std::map<std::string, std::size_t> records;
  Values drops, rest;
  if (!budget.rows.empty()) {
    const BudgetRow* const network = network_row(budget);
    for (const auto& [group, statistics] : budget.rows[0].of) {
      records[group] = statistics.samples;
      drops[group] = drop(budget, group);
      if (network != nullptr && rmse_z(*network, group) > 0)
        rest[group] = rmse_z(last_row(budget), group) / rmse_z(*network, group);
    }
  }
  record.constant("unit", "N", "");
  record.field("quantity", "root mean square of the vertical force residual", "");
  record.field("fit_flights", budget.fit_flights, "");
  record.field("test_flights", budget.test_flights, "");
  record.field("nominal_mass_kg", budget.masses_kg, "By kind.", "kg");
  record.list("rows", budget.rows, "Each with the effects of the rows above.",
              [](files::Record& r, const BudgetRow& row) {
                Values values;
                for (const auto& [group, statistics] : row.of) values[group] = statistics.rmse.z;
                r.field("name", row.name, "");
                r.field("rmse_z", values, "By composition, kind, and all.", "N");
              });
  record.field("records", records, "By the same groups.");
  record.field("drop", drops, "Share of the first row's error that the last removes.");
  record.may("rest_over_network", rest.empty() ? std::nullopt : std::optional(rest),
             "Error of the last model row over the network's.");
}

void print(const Budget& budget, const residuals::ForceUnit& unit) {
  fmt::print(
      "\nError budget: root mean square of the vertical residual [{}]; fitted to {} flights, judged on "
      "{}\n{:<12}",
      unit.name, budget.fit_flights, budget.test_flights, "");
  for (const auto& [group, statistics] : budget.rows[0].of)
    fmt::print("{:>{}}", group, group.size() > 6 ? group.size() + 2 : 8);
  fmt::print("\n");
  const auto line = [&](const std::string& name, auto value, const char* format) {
    fmt::print("{:<12}", name);
    for (const auto& [group, statistics] : budget.rows[0].of)
      fmt::print("{:>{}}", fmt::format(fmt::runtime(format), value(group)),
                 group.size() > 6 ? group.size() + 2 : 8);
    fmt::print("\n");
  };
  for (const BudgetRow& row : budget.rows) {
    const bool adds = row.name != "nominal" && row.name != "network";
    line((adds ? "+ " : "") + row.name,
         [&](const std::string& group) { return rmse_z(row, group) * unit.per_newton(); }, "{:.2f}");
  }
  line(
      "drop [%]", [&](const std::string& group) { return 100 * drop(budget, group); }, "{:.0f}");
  if (const BudgetRow* const network = network_row(budget)) {
    line(
        "over network",
        [&](const std::string& group) { return rmse_z(last_row(budget), group) / rmse_z(*network, group); },
        "{:.2f}");
  }
  for (const auto& [kind, mass_kg] : budget.masses_kg)
    fmt::print("nominal mass {}: {:.1f} g\n", kind, 1000 * mass_kg);
}

void write_fitted(const Budget& budget, const residuals::Fleet& fleet, const std::string& folder,
                  bool overwrite) {
  std::filesystem::create_directories(folder);
  const std::filesystem::path path(folder);
  std::string text = "schema = \"swarmcert/flights/1\"\n";
  std::map<std::string, std::string> of_kind;  // the vehicle whose model represents its kind
  const auto write_model = [&](const std::string& vehicle, const stability::Model& model) {
    files::write_file((path / (vehicle + ".toml")).string(),
                      stability::to_toml(model, {"Fitted jointly to flights by swarmcert compare --budget."}),
                      overwrite);
    of_kind.emplace(model.kind, vehicle);
  };
  for (const auto& [vehicle, model] : budget.fitted) {
    const auto use = fleet.find(vehicle);
    if (use != fleet.end() && use->second.position_only) continue;
    write_model(vehicle, model);
    text += "\n[vehicle." + vehicle + "]\nmodel = \"" + vehicle + ".toml\"\n";
  }
  for (const auto& [vehicle, use] : fleet) {
    if (!use.position_only) continue;
    const auto own = budget.fitted.find(vehicle);
    if (of_kind.count(use.kind) == 0 && own != budget.fitted.end()) write_model(vehicle, own->second);
    const auto same = of_kind.find(use.kind);
    if (same != of_kind.end())
      text += "\n[vehicle." + vehicle + "]\nmodel = \"" + same->second + ".toml\"\nuse = \"position\"\n";
  }
  files::write_file((path / "flights.toml").string(), text, overwrite);
}

}  // namespace swarmcert::analysis
