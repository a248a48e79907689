#include "analysis/commands/inspect/inspect_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>

#include "analysis/cli/command_line.h"
#include "analysis/commands/inspect/inspect_output.h"
#include "analysis/logs/statistics_of_series.h"
#include "analysis/report/report.h"

namespace swarmcert::analysis {
namespace {

constexpr std::size_t kMostLogs = 40;

/// The common parent folder of all logs, with a trailing slash; empty for a single log or if there is none.
std::string common_folder(const std::vector<const LogFile*>& logs) {
  if (logs.size() < 2) return "";
  std::string common = logs[0]->file;
  for (const LogFile* const log : logs) {
    const auto end = std::mismatch(common.begin(), common.end(), log->file.begin(), log->file.end()).first;
    common.erase(end, common.end());
  }
  return common.substr(0, common.rfind('/') == std::string::npos ? 0 : common.rfind('/') + 1);
}

/// Returns `path` relative to `folder`; for the folder itself its last component. Long paths would fill narrow screens.
std::string within(const std::string& folder, const std::string& path) {
  if (folder.empty()) return path;
  if (path.compare(0, folder.size(), folder) == 0) return path.substr(folder.size());
  const bool is_folder = path + "/" == folder && path.find('/') != std::string::npos;
  return is_folder ? path.substr(path.rfind('/') + 1) : path;
}

/// A table whose first column holds paths.
void add_table_of_paths(Report& report, const std::string& title, Table paths, const std::string& folder) {
  report.heading(title);
  for (std::vector<std::string>& row : paths.rows) row[0] = within(folder, row[0]);
  report.table(paths);
}

void add_curve(Report& report, const std::string& curve, std::size_t number) {
  if (curve.empty()) return;
  const std::string name = fmt::format("log_{}", number);
  const std::string file = "'" + name + ".dat'";
  report.figure(
      name, curve,
      "set xlabel 'time on the log [s]'\nset ylabel 'height [m]'\nset y2label 'thrust / common [-]'\n"
      "set ytics nomirror\nset y2tics\nset y2range [0:2]\nplot " +
          file + " using 1:2 with lines title 'height', " + file +
          " using 1:3 axes x1y2 with lines title 'thrust', " + file +
          " using 1:($4 > 0 ? 0.02 : NaN) axes x1y2 with lines lw 4 title 'in the air'\n",
      "Height, thrust over its 75 % quantile in the log, and the times in the air.", 300);
}

}  // namespace

std::string curve_of(const logs::Log& log) {
  constexpr std::size_t kMostLines = 1500;
  const std::size_t n = log.samples.size();
  if (n == 0) return "";
  const std::vector<char> air = logs::airborne(log);
  std::vector<double> thrust;
  for (const logs::Sample& s : log.samples)
    thrust.push_back(log.signals.thrust == logs::ThrustSource::kDuty
                         ? s.duty[0] + s.duty[1] + s.duty[2] + s.duty[3]
                         : s.given_thrust);
  const double common = logs::quantile_of(thrust, 0.75);
  std::string lines;
  const std::size_t step = std::max<std::size_t>(1, (n + kMostLines - 1) / kMostLines);
  bool gap = false;
  for (std::size_t i = 0; i < n; ++i) {
    gap = gap || (i > 0 && log.samples[i].restarts);
    if (i % step != 0) continue;
    const logs::Sample& s = log.samples[i];
    const bool has_thrust = log.signals.thrust != logs::ThrustSource::kNone && common > 0;
    lines += fmt::format("{}{:.3f} {} {} {}\n", gap ? "\n" : "", 1e-6 * s.time_us,
                         log.signals.position ? fmt::format("{:.4f}", s.position_m[2]) : "NaN",
                         has_thrust ? fmt::format("{:.4f}", thrust[i] / common) : "NaN", int{air[i]});
    gap = false;
  }
  return lines;
}

std::string write_inspect_report(const InspectResult& result, const std::vector<std::string>& curves,
                                 const files::Node& described, const std::string& folder, bool overwrite) {
  Report report("Flight logs");
  report.made_by(command_to_copy());
  report.result(described);
  const std::vector<const LogFile*> logs = logs_of(result);
  const std::string common = common_folder(logs);
  if (!common.empty()) report.paragraph("Logs in " + common);
  if (!result.collections.empty())
    add_table_of_paths(report, "What can be judged", collection_table(result.collections), common);
  if (logs.size() > 1) add_table_of_paths(report, "Logs", log_list(logs), common);
  for (std::size_t i = 0; i < logs.size() && i < kMostLogs; ++i) {
    report.heading(within(common, logs[i]->file));
    for (std::string sentence : sentences_on(*logs[i])) {
      sentence[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence[0])));
      report.paragraph(sentence + ".");
    }
    add_curve(report, curves[i], i + 1);
    for (const Table& one : tables_on(files::record_of(*logs[i]))) report.table(one);
  }
  if (logs.size() > kMostLogs)
    report.paragraph(fmt::format("{} more logs are in the table and in the JSON.", logs.size() - kMostLogs));
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
