#include "analysis/commands/spacing/spacing_report.h"

#include <fmt/core.h>

#include <cmath>

#include "analysis/cli/command_line.h"
#include "analysis/report/report.h"

namespace swarmcert::analysis {
namespace {

std::string gap(double x) { return std::isfinite(x) ? fmt::format("{:.3f} m", x) : "none in range"; }

}  // namespace

std::string write_spacing_report(const stability::SpacingQuestion& question, const stability::Spacing& found,
                                 const Table& rows, const files::Node& result, const std::string& folder,
                                 bool overwrite) {
  Report report("How close vehicles may fly");
  report.made_by(command_to_copy());
  report.result(result);
  report.paragraph(
      fmt::format("Below {} vehicle(s), the vertical error is to stay within {:.6g} m without feed-forward; "
                  "predicted forces times {:.6g}. Least height gap to stay below: {}; to cross below: {}.",
                  question.neighbours, question.max_error_m, question.guard, gap(found.least_gap_to_stay_m),
                  gap(found.least_gap_to_cross_m)));
  std::string shape = "# height_gap_m keep_out_radius_m left_m\n", speed = "# height_gap_m least_speed_m_s\n";
  int passable = 0;
  for (const stability::SpacingRow& row : found.shape) {
    const bool is_known = std::isfinite(row.keep_out_radius_m);
    shape += fmt::format("{:.6g} {} {}\n", row.height_gap_m,
                         is_known ? fmt::format("{:.6g}", row.keep_out_radius_m) : "NaN",
                         is_known ? fmt::format("{:.6g}", -row.keep_out_radius_m) : "NaN");
    const bool may_cross = std::isfinite(row.least_speed_m_s);
    passable += may_cross ? 1 : 0;
    speed += fmt::format("{:.6g} {}\n", row.height_gap_m,
                         may_cross ? fmt::format("{:.6g}", row.least_speed_m_s) : "NaN");
  }
  report.figure(
      "keep_out", shape,
      "set xlabel 'horizontal distance from below the upper vehicle [m]'\n"
      "set ylabel 'height gap [m]'\nset yrange [*:0] reverse\nset style fill solid 0.5 noborder\n"
      "plot 'keep_out.dat' using 2:1:3 with filledcurves notitle, "
      "'' using 2:1 with linespoints linetype 1 title 'keep out', "
      "'' using 3:1 with linespoints linetype 1 notitle, "
      "'-' using 1:2 with points linetype 2 pointsize 2 title 'upper vehicle'\n0 0\ne\n",
      "Keep-out shape below the upper vehicle, which is at the top in the middle: outside of it any "
      "motion keeps the error within the limit.");
  if (passable > 1) {
    report.figure(
        "speed", speed,
        "set xlabel 'height gap [m]'\nset ylabel 'least crossing speed [m/s]'\nset yrange [0:*]\n"
        "plot 'speed.dat' using 1:2 with linespoints notitle\n",
        "Least speed of a straight pass below; 0 if the vehicle may stay, no point if no speed suffices.");
  }
  report.heading("Rows");
  report.table(rows);
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
