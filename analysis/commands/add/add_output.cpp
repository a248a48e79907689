#include "analysis/commands/add/add_output.h"

#include <fmt/core.h>

#include "analysis/commands/shared/effect_output.h"
#include "analysis/identification/balance/balance_ladder.h"

namespace swarmcert::analysis {
namespace {

using identification::Ladder;
using stability::LadderRow;

files::Json names_of(const residuals::Inputs& inputs, const std::vector<int>& which) {
  files::Json names = files::Json::array();
  for (const int i : which) names.push_back(inputs.found.flights[static_cast<std::size_t>(i)].name);
  return names;
}

files::Json json_of(const LadderRow& row) {
  return {{"effect", row.effect},
          {"fit_rmse", row.fit_rmse_N},
          {"select_rmse", row.select_rmse_N},
          {"test_rmse", row.test_rmse_N > 0 ? files::Json(row.test_rmse_N) : nullptr},
          {"over_noise_floor", row.noise_floor_N > 0 && row.test_rmse_N > 0
                                   ? files::Json(row.test_rmse_N / row.noise_floor_N)
                                   : nullptr},
          {"test_looks", row.test_looks},
          {"accepted", row.accepted},
          {"reason", row.note}};
}

}  // namespace

files::Json ladder_json(const std::vector<LadderRow>& rows) {
  files::Json json = files::Json::array();
  for (const LadderRow& row : rows) json.push_back(json_of(row));
  return json;
}

void add_ladder(const Ladder& ladder, const residuals::Inputs& inputs, files::Json& result) {
  result["ladder"] = ladder_json(ladder.rows);
  result["earlier"] = ladder_json(ladder.earlier);
  result["test_looks"] = ladder.test_looks;
  result["split"] = {{"by_flight", ladder.split.by_flight},
                     {"fit", names_of(inputs, ladder.split.fit)},
                     {"select", names_of(inputs, ladder.split.select)},
                     {"test", names_of(inputs, ladder.split.test)}};
  result["effects"] = effects_json(ladder.model.effects);
}

void print_ladder(const std::vector<LadderRow>& rows) {
  fmt::print("  {:<18}{:>10}{:>10}{:>10}{:>14}\n", "", "fit", "select", "test", "test / floor");
  for (const LadderRow& row : rows) {
    fmt::print("  {:<18}{:>10.5f}{:>10.5f}{:>10}{:>14}{}\n",
               (row.effect == "nominal" ? "" : "+ ") + row.effect, row.fit_rmse_N, row.select_rmse_N,
               row.test_rmse_N > 0 ? fmt::format("{:.5f}", row.test_rmse_N) : "-",
               row.noise_floor_N > 0 && row.test_rmse_N > 0
                   ? fmt::format("{:.2f}", row.test_rmse_N / row.noise_floor_N)
                   : "-",
               row.note.empty() ? "" : (row.accepted ? "  kept although " : "  refused: ") + row.note);
  }
}

std::string what_rows_measure(const std::vector<stability::LadderRow>& rows) {
  const bool is_balance = !rows.empty() && identification::is_of_torques(rows.back().effect);
  return is_balance ? "force by which each rotor is off balance" : "force residual";
}

void print_ladder(const Ladder& ladder) {
  if (!ladder.earlier.empty()) {
    fmt::print("The model's ladder so far, on the flights of then:\n");
    print_ladder(ladder.earlier);
  }
  fmt::print("RMSE of the {}, in newton; flights for fit / select / test: {} / {} / {}{}\n",
             what_rows_measure(ladder.rows), ladder.split.fit.size(), ladder.split.select.size(),
             ladder.split.test.size(),
             ladder.split.by_flight ? "" : " (too few to split: all for everything)");
  print_ladder(ladder.rows);
  fmt::print("Test flights looked at: {} time{}\n", ladder.test_looks, ladder.test_looks == 1 ? "" : "s");
  for (const stability::EffectSpec& effect : ladder.model.effects) {
    print_values(effect.name, effect.name + (effect.vehicle.empty() ? "" : " of " + effect.vehicle) + " ",
                 effect.parameters, effect.fit.interval);
    if (is_sensor_error(effect.name)) fmt::print("{}\n", sensor_words(effect.name));
  }
}

}  // namespace swarmcert::analysis
