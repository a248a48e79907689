#include "analysis/commands/add/add_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/commands/shared/clock_output.h"
#include "analysis/commands/shared/effect_output.h"
#include "analysis/commands/shared/label_output.h"
#include "analysis/identification/balance/balance_ladder.h"

namespace swarmcert::analysis {
namespace {

using identification::Ladder;
using stability::LadderRow;

std::vector<std::string> names_of(const std::vector<std::string>& flights, const std::vector<int>& which) {
  std::vector<std::string> names;
  for (const int i : which) names.push_back(flights[static_cast<std::size_t>(i)]);
  return names;
}

std::optional<double> if_known(bool is_known, double value) {
  return is_known ? std::optional(value) : std::nullopt;
}

/// Number of decimals with which the largest error has four digits, so that the rows line up.
int decimals_of(const std::vector<LadderRow>& rows, double per_newton) {
  double largest = 0;
  for (const LadderRow& row : rows)
    largest = std::max({largest, row.fit_rmse_N, row.select_rmse_N, row.test_rmse_N});
  const double digits = std::floor(std::log10(std::max(largest * per_newton, 1e-6)));
  return static_cast<int>(std::min(std::max(3 - digits, 0.0), 9.0));
}

/// "imbalance of the rotors 12 -> 3 mN on the select flights, 12.2 -> 3.1 mN on the test flights"
std::string measure_words(const stability::LadderMeasure& measure, const residuals::ForceUnit& unit) {
  const auto [factor, name] = shown_unit(measure.unit, {unit.name, unit.size_N});
  const auto words = [&, factor = factor, name = name](const std::array<double, 2>& of, const char* where) {
    return fmt::format("{:.4g} -> {:.4g} {} on the {} flights", factor * of[0], factor * of[1], name, where);
  };
  return measure.quantity + " " + words(measure.select, "select") +
         (measure.test[0] > 0 ? ", " + words(measure.test, "test") : "");
}

}  // namespace

void describe_measure(files::Record& record, const stability::LadderMeasure& measure) {
  const auto pair = [&](const char* name, const std::array<double, 2>& of, const char* meaning) {
    record.field(name, std::vector<double>(of.begin(), of.end()), meaning, "", "estimate");
  };
  record.field("quantity", measure.quantity, "");
  record.field("unit", measure.unit, "");
  pair("select", measure.select, "Before the step and after it, on the flights that decide.");
  pair("test", measure.test, "On flights that decide nothing; zeros: nothing is tested.");
}

void describe_ladder_row(files::Record& record, const LadderRow& row) {
  const bool is_tested = row.test_rmse_N > 0;
  record.field("effect", row.effect, "What was added; nominal: the given model.");
  record.field("fit_rmse", row.fit_rmse_N, "RMS of the residual vector on the flights to fit.", "N",
               "estimate");
  record.field("select_rmse", row.select_rmse_N, "On the flights that decide what is accepted.", "N",
               "estimate");
  record.field("test_rmse", if_known(is_tested, row.test_rmse_N),
               "On flights that decide nothing; null: none.", "N", "estimate");
  record.field("over_noise_floor",
               if_known(is_tested && row.noise_floor_N > 0, row.test_rmse_N / row.noise_floor_N),
               "test_rmse over what no model can explain.", "", "estimate");
  const stability::LadderMeasure measure = row.measure.value_or(stability::LadderMeasure{});
  record.may_object(row.measure.has_value(), "measure",
                    "What decided, if it is not the residual of the force.",
                    [&](files::Record& r) { describe_measure(r, measure); });
  record.field("test_looks", row.test_looks, "How often the test flights had been looked at.");
  record.field("accepted", row.accepted, "");
  record.field("reason", row.note, "Why it was refused, or kept nevertheless.");
}

void describe_climb(files::Record& record, const Ladder& ladder) {
  record.list("earlier", ladder.earlier, "Steps that the given model already has, on the flights of then.",
              describe_ladder_row);
  record.field("test_looks", ladder.test_looks,
               "How often the test flights were looked at, this time included.");
  const identification::Split& split = ladder.split;
  record.object("split", "The use of each flight.", [&](files::Record& r) {
    r.field("by_flight", split.by == identification::Split::By::kFlights,
            "false: fewer than three flights; parts of them, with names that state their time, or all for "
            "everything.");
    r.field("fit", names_of(ladder.flights, split.fit), "");
    r.field("select", names_of(ladder.flights, split.select), "");
    r.field("test", names_of(ladder.flights, split.test), "");
  });
  record.field("stopped", ladder.stopped, "Why `auto` tried nothing further.");
}

void describe(files::Record& record, const AddResult& result) {
  const auto describe_own = [](files::Record& r, const LadderOfModel& own) {
    r.list("ladder", own.rows, "One row per step; errors in newton.", describe_ladder_row);
    r.list("effects", own.effects, "Effects of the written model.", describe_effect);
  };
  record.may_fields(result.own.has_value(),
                    [&](files::Record& r) { describe_own(r, result.own.value_or(LadderOfModel{})); });
  record.may_fields(result.climbed.has_value(), [&](files::Record& r) {
    const Climbed climbed = result.climbed.value_or(Climbed{});
    describe_climb(r, climbed.ladder);
    r.list("clock_offsets", climbed.clocks, "Clocks that differ, from how vehicles disturb each other.",
           describe_clock);
    r.list("mislabelled", climbed.labels, "Set points, paths, sensors, names or kinds of other vehicles.",
           describe_label);
    r.field("written", climbed.ladder.any_accepted, "Whether a model was written.");
    r.field("problems", climbed.ladder.problems, "Logs and records that could not be used.");
    const std::string& reason = climbed.ladder.too_poor;
    r.may("reason", reason.empty() ? std::nullopt : std::optional(reason), "Why there is no answer.");
  });
  record.may_fields(result.shown.has_value(), [&](files::Record& r) {
    r.list("ladders", result.shown.value_or(std::vector<LadderOfModel>{}), "add show: of each model file.",
           [&](files::Record& one, const LadderOfModel& shown) {
             one.field("model", shown.title, "Its file.");
             describe_own(one, shown);
           });
  });
}

Table ladder_table(const std::vector<LadderRow>& rows, const residuals::ForceUnit& unit) {
  const std::string of = std::string(" [") + unit.name + "]";
  Table table = {{"", "fit" + of, "select" + of, "test" + of, "test / noise", "note"}, {}};
  const int decimals = decimals_of(rows, unit.per_newton());
  const auto error = [&](double rmse_N) {
    return rmse_N > 0 ? fmt::format("{:.{}f}", unit.per_newton() * rmse_N, decimals) : "-";
  };
  for (const LadderRow& row : rows) {
    const bool has_ratio = row.noise_floor_N > 0 && row.test_rmse_N > 0;
    const std::string note = row.note.empty() ? row.measure ? measure_words(*row.measure, unit) : ""
                                              : (row.accepted ? "kept although " : "refused: ") + row.note;
    table.rows.push_back({(row.effect == "nominal" ? "" : "+ ") + row.effect, error(row.fit_rmse_N),
                          error(row.select_rmse_N), error(row.test_rmse_N),
                          has_ratio ? fmt::format("{:.2f}", row.test_rmse_N / row.noise_floor_N) : "-",
                          note});
  }
  const bool has_notes =
      std::any_of(table.rows.begin(), table.rows.end(), [](const auto& row) { return !row.back().empty(); });
  if (!has_notes) table.header.pop_back();
  for (auto& row : table.rows)
    if (!has_notes) row.pop_back();
  return table;
}

std::string what_rows_measure(const std::vector<stability::LadderRow>& rows) {
  const bool is_balance = !rows.empty() && identification::is_of_torques(rows.back().effect);
  return is_balance ? "force by which each rotor is off balance" : "force residual";
}

void print_ladder(const Ladder& ladder, const residuals::ForceUnit& unit) {
  if (!ladder.earlier.empty()) {
    fmt::print("The model's ladder so far, on the flights of then:\n");
    fmt::print("{}", to_text(ladder_table(ladder.earlier, unit)));
  }
  static constexpr const char* kSplitWords[] = {"", ", which are parts of flights",
                                                " (too little to split: all for everything)"};
  fmt::print("RMSE of the {}; flights for fit / select / test: {} / {} / {}{}\n",
             what_rows_measure(ladder.rows), ladder.split.fit.size(), ladder.split.select.size(),
             ladder.split.test.size(), kSplitWords[static_cast<std::size_t>(ladder.split.by)]);
  fmt::print("{}", to_text(ladder_table(ladder.rows, unit)));
  fmt::print("Test flights looked at: {} time{}\n", ladder.test_looks, ladder.test_looks == 1 ? "" : "s");
  if (!ladder.stopped.empty()) fmt::print("It stopped there: {}\n", ladder.stopped);
  for (const stability::EffectSpec& effect : ladder.model.effects) {
    print_values(effect.name, effect.name + (effect.vehicle.empty() ? "" : " of " + effect.vehicle) + " ",
                 effect.parameters, effect.fit.interval);
    if (is_sensor_error(effect.name)) fmt::print("{}\n", sensor_words(effect.name));
  }
}

}  // namespace swarmcert::analysis
