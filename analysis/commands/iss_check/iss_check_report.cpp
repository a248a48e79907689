#include "analysis/commands/iss_check/iss_check_report.h"

#include <fmt/core.h>

#include <map>

#include "analysis/cli/command_line.h"
#include "analysis/report/report.h"
#include "analysis/report/report_text.h"

namespace swarmcert::analysis {

Table iss_kinds_table(const files::Node& result) {
  return table(*result.find("kinds"), {{"disturbance"},
                                       {"runs"},
                                       {"violations"},
                                       {"worst_ratio", "", "{:.6f}"},
                                       {"worst_transient_ratio", "over transient", "{:.6f}"},
                                       {"left_hypotheses", "left a hypothesis"},
                                       {"failed", "could not be integrated"}});
}

std::string write_iss_check_report(const stability::IssCheck& check, const files::Node& result,
                                   const std::string& folder, bool overwrite) {
  Report report("The tracking theorem's ball under disturbances");
  report.made_by(command_to_copy());
  report.result(result);
  report.paragraph(check.theorem_applies ? "The theorem's hypotheses hold for these gains."
                                         : "The theorem does not apply:");
  for (const std::string& why : check.why_not) report.paragraph(why + ".");
  report.paragraph(fmt::format(
      "Ball: {:.6g} m for a learning error that changes by at most {:.4g} N/s{}. {} of {} runs "
      "violate it{}. The absence of a violation is not a proof.",
      check.ball_m, check.rate_N_s,
      check.has_ball ? "" : " (these gains do not have the theorem's form; this is the analogous number)",
      check.violations, check.runs.size(), check.cancelled ? "; the check was interrupted" : ""));
  for (const std::string& why : check.why_inconclusive()) report.paragraph("Inconclusive: " + why + ".");
  const files::Node& kinds = *result.find("kinds");
  std::map<std::string, int> row_of;
  for (const files::Node& kind : kinds.members)
    row_of.emplace(cell(*kind.find("disturbance")), static_cast<int>(row_of.size()));
  std::string data = "# row ratio transient_ratio disturbance\n";
  for (const stability::IssRun& run : check.runs) {
    data += fmt::format("{} {} {:.8g} {}\n", row_of[run.kind],
                        run.ratio > 0 ? fmt::format("{:.8g}", run.ratio) : "NaN", run.transient_ratio,
                        plot_field(run.kind));
  }
  report.figure(
      "ratios", data,
      fmt::format("set xlabel 'largest error over its bound [-]'\nset yrange [{}.5:-0.5]\n"
                  "set xrange [0:*]\nset arrow from 1,graph 0 to 1,graph 1 nohead linetype 2\n"
                  "plot 'ratios.dat' using 2:($1-0.12):ytic(4) with points title 'over the ball', "
                  "'' using 3:($1+0.12) with points linetype 3 title 'over the transient bound', "
                  "NaN with lines linetype 2 title 'the bound'\n",
                  kinds.members.size() - 1),
      "Largest error of every run over the ball (runs from rest) and over the transient bound, by kind "
      "of disturbance. Right of 1 lies a violation.",
      140 + 50 * static_cast<int>(kinds.members.size()));
  report.table(iss_kinds_table(result));
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
