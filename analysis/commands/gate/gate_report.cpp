#include "analysis/commands/gate/gate_report.h"

#include <fmt/ranges.h>

#include <cmath>
#include <limits>

#include "analysis/cli/command_line.h"
#include "analysis/gate/text.h"
#include "analysis/report/report.h"
#include "nn/base/file_io.h"

namespace swarmcert::analysis {
namespace {

/// The share of its limit that a check uses, in percent, such that more than 100 fails whether the limit is an upper
/// or a lower one. NaN if the ratio is meaningless.
double used_percent(const gate::Check& check) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (!check.value || !check.limit || !(*check.value > 0) || !(*check.limit > 0)) return kNone;
  return 100 * (check.more_is_worse ? *check.value / *check.limit : *check.limit / *check.value);
}

void add_checks(Report& report, const gate::GateResult& result) {
  std::vector<Bar> bars;
  std::vector<std::vector<std::string>> rows;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  for (const gate::Check& check : result.checks) {
    const double used = used_percent(check);
    if (std::isfinite(used)) bars.push_back({check.name, used, kNone, kNone});
    rows.push_back({check.name, gate::name(check.verdict), gate::number(check.value),
                    check.limit ? (check.more_is_worse ? "≤ " : "≥ ") + gate::number(check.limit) : "-",
                    gate::number(check.baseline), check.unit, fmt::format("{}", check.line)});
  }
  if (!bars.empty())
    report.bars("limits", bars, "used of the limit [%]",
                "Share of its limit that every check with a number uses: at 100 % the limit is reached.");
  report.heading("Checks");
  report.table({"check", "verdict", "value", "limit", "baseline", "unit", "policy line"}, rows);
  for (const gate::Check& check : result.checks) {
    if (check.verdict == gate::Verdict::kPass) continue;
    report.paragraph(fmt::format("{}: {}. {}{}", check.name, gate::name(check.verdict), check.reason,
                                 check.witness.empty() ? "" : ". Witness: " + check.witness));
  }
}

}  // namespace

std::string write_gate_report(const gate::GateResult& result, const files::Node& record,
                              const std::string& folder, bool overwrite) {
  Report report("May this release ship?");
  report.made_by(command_to_copy());
  report.result(record);
  const std::string not_run = fmt::format("{}", fmt::join(result.not_run, ", "));
  report.paragraph(fmt::format("Verdict: {}. {} checks passed, {} failed, {} inconclusive.{}",
                               gate::name(result.verdict()), result.count(gate::Verdict::kPass),
                               result.count(gate::Verdict::kFail), result.count(gate::Verdict::kInconclusive),
                               not_run.empty() ? "" : " The policy does not ask for: " + not_run + "."));
  add_checks(report, result);
  report.heading("Files that the release rests on");
  std::vector<std::vector<std::string>> rows;
  for (const gate::EvidenceFile& file : result.files)
    rows.push_back({file.role, file.path, files::sha256_of_file(file.path).substr(0, 16)});
  report.table({"role", "file", "SHA-256, first 16 digits"}, rows);
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
