#include "analysis/commands/add/add_report.h"

#include <fmt/core.h>

#include <algorithm>

#include "analysis/cli/command_line.h"
#include "analysis/commands/add/add_output.h"
#include "analysis/commands/shared/effect_output.h"
#include "analysis/commands/shared/time_plots.h"
#include "analysis/identification/candidates.h"
#include "analysis/report/report.h"
#include "analysis/report/report_text.h"

namespace swarmcert::analysis {
void add_ladder_figure(Report& report, const std::vector<stability::LadderRow>& rows, const std::string& name,
                       const residuals::ForceUnit& force) {
  struct Series {
    double stability::LadderRow::*rmse_N;
    const char* title;
    const char* style;
  };
  const Series all[] = {{&stability::LadderRow::fit_rmse_N, "flights to fit", "linecolor rgb '#999999'"},
                        {&stability::LadderRow::select_rmse_N, "flights to select", "linetype 6"},
                        {&stability::LadderRow::test_rmse_N, "test flights", "linetype 1"}};
  std::string data = "# step fit select test\n", plots;
  for (const stability::LadderRow& row : rows) {
    if (!row.accepted || row.measure) continue;
    data += plot_field((row.effect == "nominal" ? "" : "+ ") + row.effect);
    for (const Series& series : all)
      data +=
          row.*series.rmse_N > 0 ? fmt::format(" {:.8g}", force.per_newton() * (row.*series.rmse_N)) : " NaN";
    data += "\n";
  }
  // gnuplot refuses a histogram without a number, as where nothing was held out.
  for (int k = 0; k < 3; ++k) {
    const auto has_number = [&](const auto& row) {
      return row.accepted && !row.measure && row.*all[k].rmse_N > 0;
    };
    if (std::any_of(rows.begin(), rows.end(), has_number))
      plots += fmt::format("{} '{}.dat' using {}:xtic(1) title '{}' {}", plots.empty() ? "plot" : ",", name,
                           k + 2, all[k].title, all[k].style);
  }
  report.figure(
      name, data,
      fmt::format("set style data histograms\nset style fill solid 0.9 noborder\nset boxwidth 0.9\n"
                  "set ylabel 'RMSE of the {} [{}]'\nset yrange [0:*]\n"
                  "set xtics rotate by (exists('narrow') ? -90 : -30)\n{}\n",
                  what_rows_measure(rows), force.name, plots),
      "Error ladder: how the error of the force falls from the nominal model on, effect by effect, on the "
      "fitted, the selecting and the test flights.");
  report.table(ladder_table(rows, force));
}

std::string write_ladder_report(const std::vector<LadderOfModel>& ladders, const BeforeAfter* change,
                                const residuals::ForceUnit& unit, const files::Json& result,
                                const std::string& folder, bool overwrite) {
  Report report("Error ladder");
  report.made_by(command_to_copy());
  report.result(result);
  std::size_t number = 0;
  for (const LadderOfModel& ladder : ladders) {
    report.heading(ladder.title);
    if (ladder.rows.empty()) {
      report.paragraph("No ladder is kept.");
    } else {
      add_ladder_figure(report, ladder.rows, fmt::format("ladder_{}", ++number), unit);
    }
    std::vector<std::vector<std::string>> rows;
    for (const stability::EffectSpec& effect : ladder.effects) {
      for (const auto& [name, value] : effect.parameters) {
        const std::string interval = interval_words(effect.name, name, effect.fit.interval);
        rows.push_back({effect.name, effect.vehicle, name,
                        fmt::format("{:.6g}", shown_beyond_file(effect.name, name) + value),
                        interval.empty() ? "-" : interval});
      }
    }
    if (!rows.empty()) report.table({"effect", "vehicle", "parameter", "value", "90 %"}, rows);
  }
  if (change != nullptr) {
    report.heading("Before and after");
    report.paragraph(
        "All flights, including those of the fit; the ladder states the error on the test flights.");
    add_before_and_after(report, change->before, change->after, change->pictures.room, unit);
    report.heading("What was added");
    add_effect_curves(report, change->pictures.effects, unit);
    report.heading("Worst moments");
    add_moments(report, change->before, unit);
    add_flown(report, change->flights, change->before, unit);
  }
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
