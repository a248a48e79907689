#include "analysis/commands/tune/tune_report.h"

#include <fmt/core.h>

#include <cmath>
#include <limits>

#include "analysis/cli/command_line.h"
#include "analysis/report/report.h"

namespace swarmcert::analysis {

std::string write_tune_report(const std::string& verdict, const std::vector<TunedQuantity>& quantities,
                              const files::Node& result, const std::string& folder, bool overwrite) {
  Report report("Tuned gains");
  report.made_by(command_to_copy());
  report.result(result);
  report.paragraph(verdict);
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<Bar> bars;
  std::vector<std::vector<std::string>> rows;
  for (const TunedQuantity& quantity : quantities) {
    const double percent = 100 * quantity.tuned / quantity.shipped;
    const bool is_finite = std::isfinite(percent);
    rows.push_back({quantity.name, fmt::format("{:.6g}", quantity.shipped),
                    fmt::format("{:.6g}", quantity.tuned),
                    is_finite ? fmt::format("{:+.1f} %", percent - 100) : "-", quantity.unit});
    if (is_finite) bars.push_back({quantity.name, percent, kNone, kNone});
  }
  report.bars("tuned", bars, "tuned, of the value under the gains given [%]",
              "Each quantity under the tuned gains, relative to the gains given (100 %).");
  if (!rows.empty()) report.table({"", "given", "tuned", "change", "unit"}, rows);
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
