#include "analysis/commands/inspect/inspect_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "analysis/cli/command_line.h"
#include "analysis/logs/flight_story.h"
#include "analysis/logs/statistics_of_series.h"
#include "analysis/report/report.h"

namespace swarmcert::analysis {
namespace {

using files::Json;
using Rows = std::vector<std::vector<std::string>>;

constexpr std::size_t kMostLogs = 40, kMostEvents = 60;

std::string text_of(const Json& value) {
  if (value.is_null()) return "-";
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::string number_of(const Json& value, const char* format) {
  return value.is_number() ? fmt::format(fmt::runtime(format), value.get<double>()) : "-";
}

std::string words_of(const Json& list) {
  std::string words;
  for (const Json& word : list) words += (words.empty() ? "" : " ") + text_of(word);
  return words.empty() ? "none" : words;
}

/// The common parent folder of all logs, with a trailing slash; empty for a single log or if there is none.
std::string common_folder(const std::vector<InspectedLog>& logs) {
  if (logs.size() < 2) return "";
  std::string common = logs[0].path;
  for (const InspectedLog& log : logs) {
    const auto end = std::mismatch(common.begin(), common.end(), log.path.begin(), log.path.end()).first;
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

void add_collections(Report& report, const std::vector<CollectionRow>& rows, const std::string& folder) {
  if (rows.empty()) return;
  report.heading("What can be judged");
  Rows table;
  for (const CollectionRow& row : rows) {
    std::string left_out;
    for (const auto& [why, count] : row.left_out)
      left_out += fmt::format("{}{} {}", left_out.empty() ? "" : "; ", count, why);
    table.push_back({within(folder, row.name), std::to_string(row.logs), std::to_string(row.opened),
                     std::to_string(row.force[0]), std::to_string(row.force[1]), std::to_string(row.force[2]),
                     std::to_string(row.torque), fmt::format("{:.1f}", row.seconds),
                     fmt::format("{:.2f}", row.run_s), left_out});
  }
  report.table({"folder", "logs", "opened", "force x", "y", "z", "torque", "in the air [s]", "run time [s]",
                "left out"},
               table);
}

void add_log_list(Report& report, const std::vector<InspectedLog>& logs, const std::string& folder) {
  if (logs.size() < 2) return;
  report.heading("Logs");
  Rows table;
  for (const InspectedLog& log : logs) {
    const Json& d = log.described;
    table.push_back({within(folder, log.path), text_of(d["format"]), number_of(d["in_the_air_s"], "{:.1f}"),
                     words_of(d["judged"]["force"]), text_of(d["judged_torque"]), text_of(d["no_flight"])});
  }
  report.table({"log", "format", "in the air [s]", "force", "torque", "no flight"}, table);
}

void add_story(Report& report, const Json& d) {
  Rows table;
  for (const Json& phase : d["phases"])
    table.push_back({text_of(phase["phase"]), number_of(phase["start_s"], "{:.2f}"),
                     number_of(phase["end_s"], "{:.2f}")});
  report.table({"phase", "from [s]", "to [s]"}, table);
  table.clear();
  for (const Json& event : d["events"]) {
    if (table.size() == kMostEvents) break;
    table.push_back({text_of(event["event"]), number_of(event["time_s"], "{:.2f}"),
                     number_of(event["duration_s"], "{:.3f}"), text_of(event["what"])});
  }
  if (table.empty()) report.paragraph("No event.");
  if (!table.empty()) report.table({"event", "at [s]", "for [s]", "what"}, table);
  if (d["events"].size() > kMostEvents)
    report.paragraph(fmt::format("{} more events are in the JSON.", d["events"].size() - kMostEvents));
}

void add_signals(Report& report, const Json& d) {
  Rows table;
  for (const Json& signal : d["signals"])
    table.push_back({text_of(signal["name"]), text_of(signal["source"]), text_of(signal["from"]),
                     text_of(signal["unit"]), number_of(signal["rate_hz"], "{:.1f}"),
                     number_of(signal["noise"], "{:.2g}"), number_of(signal["odds_bits"], "{:.0f}"),
                     text_of(signal["runner_up"])});
  report.table({"signal", "source", "from", "unit", "rate [Hz]", "noise", "odds [bits]", "against"}, table);
  for (const Json& words : d["interpretation"]) report.paragraph("Seen in the data: " + text_of(words) + ".");
}

void add_judgement(Report& report, const Json& d) {
  report.paragraph("Can be judged: force " + words_of(d["judged"]["force"]) + "; torque " +
                   words_of(d["judged"]["torque"]) + " (" + text_of(d["judged_torque"]) + ").");
  Rows table;
  for (const Json& missing : d["missing"])
    table.push_back({text_of(missing["for"]), text_of(missing["signal"]), text_of(missing["log_this"])});
  if (!table.empty()) report.table({"to judge", "the log lacks", "log next time"}, table);
}

void add_curve(Report& report, const InspectedLog& log, std::size_t number) {
  if (log.curve.empty()) return;
  const std::string name = fmt::format("log_{}", number);
  const std::string file = "'" + name + ".dat'";
  report.figure(
      name, log.curve,
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

std::string write_inspect_report(const std::vector<InspectedLog>& logs,
                                 const std::vector<CollectionRow>& rows, const files::Json& result,
                                 const std::string& folder, bool overwrite) {
  Report report("Flight logs");
  report.made_by(command_to_copy());
  report.result(result);
  const std::string common = common_folder(logs);
  if (!common.empty()) report.paragraph("Logs in " + common);
  add_collections(report, rows, common);
  add_log_list(report, logs, common);
  for (std::size_t i = 0; i < logs.size() && i < kMostLogs; ++i) {
    const Json& d = logs[i].described;
    report.heading(within(common, logs[i].path));
    report.paragraph(
        fmt::format("{}, {} records from {:.2f} to {:.2f} s, {:.1f} s in the air.{}", text_of(d["format"]),
                    text_of(d["records"]), d["t0_s"].get<double>(), d["t1_s"].get<double>(),
                    d["in_the_air_s"].get<double>(),
                    d["no_flight"].is_null() ? "" : " No flight: " + text_of(d["no_flight"]) + "."));
    for (const std::string& damage : logs[i].damage) report.paragraph("Damage and gaps: " + damage + ".");
    for (const Json& doubt : d["plausibility"])
      report.paragraph("Implausible: " + text_of(doubt["words"]) + ".");
    add_curve(report, logs[i], i + 1);
    add_judgement(report, d);
    add_story(report, d);
    add_signals(report, d);
  }
  if (logs.size() > kMostLogs)
    report.paragraph(fmt::format("{} more logs are in the table and in the JSON.", logs.size() - kMostLogs));
  return report.write(folder, overwrite);
}

}  // namespace swarmcert::analysis
