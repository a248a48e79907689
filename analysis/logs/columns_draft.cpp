#include "analysis/logs/columns_draft.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/logs/column_groups.h"
#include "analysis/logs/dictionary.h"
#include "analysis/logs/read_log.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

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

  void line(const std::string& signal, const std::string& column, const std::string& unit,
            const std::vector<std::string>& frames, const std::string& evidence) {
    std::string escaped;
    for (const char c : column)
      escaped += (c == '"' || c == '\\') ? std::string("\\") + c : std::string(1, c);
    text += fmt::format("{} = {{ column = \"{}\", unit = \"{}\"{} }}{}\n", signal, escaped, unit,
                        frames.empty() ? "" : fmt::format(", frame = \"{}\"", frames[0]),
                        evidence.empty() ? "" : "  # " + evidence);
    used.insert(column);
    signals.insert(signal);
  }
};

/// Adds what only the user can know.
void add_missing(const RawLog& log, Writer& writer) {
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
  for (const RawTopic& topic : log.topics) {
    for (const RawColumn& column : topic.columns) {
      if (writer.used.count(column.name) == 0 && writer.used.count(topic.name + ": " + column.name) == 0)
        writer.text += "# not used: " + column.name + " (" + range_in_words(column) + ")\n";
    }
  }
}

}  // namespace

std::string columns_draft(const std::string& path) {
  std::vector<std::string> notes;
  const SignalMap meaning = meaning_of_columns(path, notes);
  const RawLog raw = read_uninterpreted(path);
  if (!std::all_of(raw.topics.begin(), raw.topics.end(),
                   [&](const RawTopic& topic) { return is_plain_table(raw, topic); }))
    throw files::InputError({path, "", "", raw.format, "states the meaning of its columns itself",
                             "a columns.toml is for tables: CSV and micro-SD logs"});
  Writer writer;
  writer.text = "# Proposed by 'swarmcert inspect --columns-draft' for " + path +
                ".\n# Check every line: units, frames and signs decide what the residuals mean.\n";
  for (const std::string& note : notes) writer.text += "# seen: " + note + "\n";
  writer.text += "schema = \"swarmcert/columns/1\"\n";
  for (const SignalSource& source : meaning)
    if (!source.unit.empty())
      writer.line(columns_name(source.signal), source.column, source.unit,
                  kind_of_signal(source.signal).frames, source.why);
  add_missing(raw, writer);
  return writer.text;
}

}  // namespace swarmcert::logs
