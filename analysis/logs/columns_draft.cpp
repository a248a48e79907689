#include "analysis/logs/columns_draft.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

#include "analysis/logs/collector.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/recognition.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

/// Returns what a stored number of column k must be multiplied with. Duties and voltages of any scale show it by their
/// size.
double factor_of(const RawTopic& topic, const Carried& carried, std::size_t k) {
  const std::vector<double>& stored = topic.columns[static_cast<std::size_t>(carried.columns[k])].values;
  if (carried.ask == Ask::kMotors) {
    const double largest = quantile_of(stored, 1);
    return largest > 101 ? 1.0 / 65536 : largest > 1.5 ? 0.01 : 1;
  }
  if (carried.signal == kBattery) return median(stored) > 500 ? 0.001 : 1;
  return (k < carried.sign.size() ? carried.sign[k] : 1) * carried.multiply / carried.divide;
}

const char* frame_of(int signal) {
  const bool is_body =
      (signal >= kForceBody && signal < kAccelerationWorld) || (signal >= kRates && signal < kDuty);
  const bool is_world = signal < kForceBody || (signal >= kTargetPosition && signal < kMotorForce);
  return is_body ? "body" : is_world ? "world" : nullptr;
}

std::string time_unit(const RawTopic& topic, const RawColumn& column) {
  for (std::size_t i = 1; i < topic.time_s.size(); ++i) {
    const double stored = column.values[i] - column.values[0], taken = topic.time_s[i] - topic.time_s[0];
    if (!(stored > 0) || !(taken > 0)) continue;
    const double per_second = stored / taken;
    return per_second > 3e7 ? "ns" : per_second > 3e4 ? "us" : per_second > 30 ? "ms" : "s";
  }
  return "s";
}

/// A CSV file as a log, and its clock.
struct DraftTable {
  RawLog raw;
  std::size_t clock = 0;
};

/// Reads a table.
/// @throws files::InputError if no column can be a clock.
DraftTable read_table(const std::string& path) {
  DraftTable table;
  table.raw.path = path;
  table.raw.format = "csv";
  std::ifstream in = open_log(path);
  Collector collector(table.raw, known_columns());
  read_csv(in, path, collector, table.raw.health);
  collector.end();
  table.clock = collector.time_index();
  return table;
}

/// "0.12 .. 4.5, median 1.1"; "always 3"; "no numbers".
std::string range_in_words(const RawColumn& column) {
  const double low = quantile_of(column.values, 0), high = quantile_of(column.values, 1);
  if (std::isnan(low)) return "no numbers";
  if (low == high) return fmt::format("always {:.6g}", low);
  return fmt::format("{:.4g} .. {:.4g}, median {:.4g}", low, high, median(column.values));
}

struct Writer {
  std::string text;
  std::set<std::string> used, signals;

  void line(const std::string& signal, const std::string& column, const std::string& unit, const char* frame,
            const std::string& evidence) {
    std::string escaped;
    for (const char c : column)
      escaped += (c == '"' || c == '\\') ? std::string("\\") + c : std::string(1, c);
    text += fmt::format("{} = {{ column = \"{}\", unit = \"{}\"{} }}{}\n", signal, escaped, unit,
                        frame == nullptr ? "" : fmt::format(", frame = \"{}\"", frame),
                        evidence.empty() ? "" : "  # " + evidence);
    used.insert(column);
    signals.insert(signal);
  }
};

/// Adds what only the user can know.
void add_missing(const RawTopic& topic, Writer& writer) {
  struct Needed {
    std::vector<const char*> any_of;
    const char* line;
  };
  for (const Needed& needed :
       {Needed{{"position_x", "position_z", "velocity_x", "velocity_z"},
               "position_x = { column = \"?\", unit = \"m\", frame = \"world\" }, and y, z"},
        Needed{{"attitude_w", "roll"},
               "attitude_x = { column = \"?\", unit = \"1\" }, and y, z, w; or roll, pitch, yaw"},
        Needed{{"duty_1", "requested_1", "motor_force_1", "thrust_command"},
               "duty_1 = { column = \"?\", unit = \"PWM\" }, and 2 .. 4; or requested_1 .. 4, "
               "motor_force_1 .. 4, thrust_command"}}) {
    const bool found = std::any_of(needed.any_of.begin(), needed.any_of.end(),
                                   [&](const char* signal) { return writer.signals.count(signal) > 0; });
    if (!found) writer.text += std::string("# FILL IN, if it was logged: ") + needed.line + "\n";
  }
  for (const RawColumn& column : topic.columns) {
    if (writer.used.count(column.name) == 0)
      writer.text += "# not used: " + column.name + " (" + range_in_words(column) + ")\n";
  }
}

}  // namespace

std::string columns_draft(const std::string& path) {
  const DraftTable table = read_table(path);
  const RawTopic& topic = table.raw.topics.front();
  const Recognition recognition = recognise(table.raw, known_columns());
  Writer writer;
  writer.text = "# Proposed by 'swarmcert inspect --columns-draft' for " + path +
                ".\n# Check every line: units, frames and signs decide what the residuals mean.\n";
  for (const auto* const notes : {&recognition.corrected, &recognition.rejected})
    for (const std::string& words : *notes) writer.text += "# seen: " + words + "\n";
  writer.text += "schema = \"swarmcert/columns/1\"\n";
  const RawColumn& clock = topic.columns[table.clock];
  writer.line("time", clock.name, time_unit(topic, clock), nullptr, "");
  for (const Carried& carried : recognition.groups) {
    const RawTopic& carrier = table.raw.topics[carried.topic];
    for (std::size_t k = 0; k < carried.size(); ++k) {
      const int signal = carried.signal + static_cast<int>(k);
      const std::string name = columns_name(signal);
      const std::string unit =
          carried.columns[k] < 0 ? "" : unit_of_factor(signal, factor_of(carrier, carried, k));
      if (name.empty() || unit.empty()) continue;
      writer.line(name, carrier.columns[static_cast<std::size_t>(carried.columns[k])].name, unit,
                  frame_of(signal),
                  std::isfinite(carried.odds_bits)
                      ? fmt::format("odds {:.0f} bits against {}", carried.odds_bits, carried.runner_up)
                      : "by its name");
    }
  }
  add_missing(topic, writer);
  return writer.text;
}

}  // namespace swarmcert::logs
