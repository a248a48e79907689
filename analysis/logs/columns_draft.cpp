#include "analysis/logs/columns_draft.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

#include "analysis/logs/angles.h"
#include "analysis/logs/collector.h"
#include "analysis/logs/column_guess.h"
#include "analysis/logs/formats/formats.h"
#include "analysis/logs/interpretation.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

struct UnitGuess {
  const char* name;
  double per_si;  ///< stored value of one SI unit
};

struct SignalWords {
  int signal;
  const char* name;
  std::vector<const char*> parts;
  std::vector<UnitGuess> units;
  const char* frame;  ///< nullptr: none
};

const std::vector<SignalWords>& signal_words() {
  static const std::vector<const char*> axes = {"_x", "_y", "_z"}, four = {"_1", "_2", "_3", "_4"};
  static const std::vector<UnitGuess> length = {{"m", 1}, {"cm", 100}, {"mm", 1000}};
  static const std::vector<UnitGuess> speed = {{"m/s", 1}, {"cm/s", 100}, {"mm/s", 1000}};
  static const std::vector<SignalWords> all = {
      {kPosition, "position", axes, length, "world"},
      {kVelocity, "velocity", axes, speed, "world"},
      {kForceBody,
       "specific_force",
       axes,
       {{"m/s^2", 1}, {"mm/s^2", 1000}, {"g", 1 / kGravity_m_s2}, {"mg", 1000 / kGravity_m_s2}},
       "body"},
      {kForceWorld,
       "specific_force",
       axes,
       {{"m/s^2", 1}, {"mm/s^2", 1000}, {"g", 1 / kGravity_m_s2}},
       "world"},
      {kAttitude, "attitude", {"_x", "_y", "_z", "_w"}, {{"1", 1}}, nullptr},
      {kEuler,
       "roll",
       {""},
       {{"rad", 1}, {"deg", 1 / kDegree_rad}, {"-rad", -1}, {"-deg", -1 / kDegree_rad}},
       nullptr},
      {kEuler + 1,
       "pitch",
       {""},
       {{"rad", 1}, {"deg", 1 / kDegree_rad}, {"-rad", -1}, {"-deg", -1 / kDegree_rad}},
       nullptr},
      {kEuler + 2,
       "yaw",
       {""},
       {{"rad", 1}, {"deg", 1 / kDegree_rad}, {"-rad", -1}, {"-deg", -1 / kDegree_rad}},
       nullptr},
      {kRates, "rate", axes, {{"rad/s", 1}, {"mrad/s", 1000}, {"deg/s", 1 / kDegree_rad}}, "body"},
      {kDuty, "duty", four, {{"1", 1}, {"%", 100}, {"PWM", 65536}}, nullptr},
      {kRequested, "requested", four, {{"1", 1}, {"%", 100}, {"PWM", 65536}}, nullptr},
      {kBattery, "battery", {""}, {{"V", 1}, {"mV", 1000}}, nullptr},
      {kTargetPosition, "target_position", axes, length, "world"},
      {kTargetVelocity, "target_velocity", axes, speed, "world"},
      {kMotorForce, "motor_force", four, {{"N", 1}, {"gf", 1000 / kGravity_m_s2}}, nullptr},
      {kThrust, "thrust_command", {""}, {{"N", 1}, {"gf", 1000 / kGravity_m_s2}}, nullptr},
      {kTorque, "torque_command", axes, {{"Nm", 1}}, nullptr}};
  return all;
}

/// Returns the interpreted signal of one sample; NaN if Log does not keep it.
double interpreted(const Log& log, std::size_t i, int signal) {
  const Sample& s = log.samples[i];
  const auto part = [&](int first) { return static_cast<std::size_t>(signal - first); };
  const auto R = s.attitude.rotation();
  if (signal < kVelocity) return s.position_m[part(kPosition)];
  if (signal < kForceWorld) return s.velocity_m_s[part(kVelocity)];
  if (signal < kForceBody) return s.specific_force_m_s2[part(kForceWorld)];
  if (signal < kAccelerationWorld) {
    const std::size_t k = part(kForceBody);
    return R[0][k] * s.specific_force_m_s2[0] + R[1][k] * s.specific_force_m_s2[1] +
           R[2][k] * s.specific_force_m_s2[2];
  }
  if (signal >= kAttitude && signal < kPackedAttitude) return s.attitude.xyzw()[part(kAttitude)];
  if (signal >= kRates && signal < kDuty) return s.rates_rad_s[part(kRates)];
  if (signal == kEuler) return std::atan2(R[2][1], R[2][2]);
  if (signal == kEuler + 1) return -std::asin(std::min(std::max(R[2][0], -1.0), 1.0));
  if (signal == kEuler + 2) return std::atan2(R[1][0], R[0][0]);
  return std::nan("");
}

/// Returns the unit whose size is closest to the slope of the stored over the interpreted numbers.
const UnitGuess& unit_of(const SignalWords& words, double slope) {
  const UnitGuess* best = &words.units[0];
  double nearest = INFINITY;
  for (const UnitGuess& unit : words.units) {
    const double distance = std::abs(std::log(slope / unit.per_si));  // NaN if the signs differ
    if (distance < nearest) {
      nearest = distance;
      best = &unit;
    }
  }
  return *best;
}

/// Fallback if Log keeps no copy of the signal: the unit implied by the name's factor, corrected by the size of the
/// values.
double slope_by_name(const Carried& carried, const std::vector<double>& stored) {
  const double largest = std::max(quantile_of(stored, 1), -quantile_of(stored, 0));
  if (carried.signal == kDuty || carried.signal == kRequested)
    return largest > 101 ? 65536 : largest > 1.5 ? 100 : 1;
  if (carried.signal == kBattery) return median(stored) > 500 ? 1000 : 1;
  return carried.divide / carried.multiply;
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

/// Collects every column of a table as numbers, whatever it means.
class TableSink : public RecordSink {
 public:
  explicit TableSink(RawTopic& topic) : topic_(topic) {}
  void begin(const std::vector<std::string>& names) override {
    for (const std::string& name : names) topic_.columns.push_back({name, "", {}});
  }
  void record(const std::vector<double>& values) override {
    for (std::size_t c = 0; c < values.size(); ++c) topic_.columns[c].values.push_back(values[c]);
  }
  bool needs(std::size_t) const override { return false; }

 private:
  RawTopic& topic_;
};

/// A CSV file as a log, with the findings about its clock.
struct DraftTable {
  RawLog raw;
  std::size_t clock = 0;
  bool clock_is_guessed = false;
};

/// Reads a table.
/// @throws files::InputError if no column can be a clock.
DraftTable read_table(const std::string& path) {
  DraftTable table;
  table.raw.path = path;
  table.raw.format = "csv";
  std::ifstream in = open_log(path);
  RawTopic all;
  TableSink sink(all);
  LogHealth health;
  read_csv(in, path, sink, health);
  if (clock_by_name(all) >= 0 || time_column(all, known_columns()).columns[0] >= 0) {
    std::ifstream again = open_log(path);
    Collector collector(table.raw, known_columns());
    read_csv(again, path, collector, table.raw.health);
    collector.end();
    table.clock = collector.time_index();
    return table;
  }
  const int clock = guess_clock(all);
  if (clock < 0) {
    throw files::InputError({path, "", "time", "", "no column looks like a clock, by name or values",
                             "a clock rises with every record by nearly the same step: log it"});
  }
  table.clock = static_cast<std::size_t>(clock);
  table.clock_is_guessed = true;
  const std::vector<double>& times = all.columns[table.clock].values;
  const double unit_s = seconds_per_unit(times);
  for (const double time : times) all.time_s.push_back(time * unit_s);
  table.raw.topics.push_back(std::move(all));
  return table;
}

/// Interprets the log as far as the names allow; otherwise returns an empty log.
Log interpreted_where_possible(const RawLog& raw) {
  try {
    return interpret(raw, known_columns());
  } catch (const files::InputError&) {
    return {};
  }
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

/// Adds guesses from values for what the names leave open, then what only the user can know.
void add_guesses(const RawTopic& topic, Writer& writer) {
  std::vector<char> taken;
  for (const RawColumn& column : topic.columns)
    taken.push_back(static_cast<char>(writer.used.count(column.name)));
  const std::vector<std::string> known(writer.signals.begin(), writer.signals.end());
  for (const ColumnGuess& guess : guess_columns(topic, taken, known))
    writer.line(guess.signal, topic.columns[guess.column].name, guess.unit, guess.frame,
                "GUESSED from values: " + guess.evidence);
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
  const Log log = interpreted_where_possible(table.raw);
  Writer writer;
  writer.text = "# Proposed by 'swarmcert inspect --columns-draft' for " + path +
                ".\n# Check every line: units, frames and signs decide what the residuals mean.\n";
  for (const std::string& words : log.interpretation) writer.text += "# seen: " + words + "\n";
  writer.text += "schema = \"swarmcert/columns/1\"\n";
  const RawColumn& clock = topic.columns[table.clock];
  writer.line(
      "time", clock.name, time_unit(topic, clock), nullptr,
      table.clock_is_guessed ? "GUESSED from values: rises by nearly the same step with every record" : "");
  for (const SignalWords& words : signal_words()) {
    for (const Carried& carried : recognition.groups) {
      const int offset = words.signal - carried.signal;
      // Within a group of angles, roll, pitch and yaw have their own names.
      const bool is_angle = carried.signal == kEuler && offset >= 0 && offset < 3;
      if (offset != 0 && !is_angle) continue;
      for (std::size_t k = 0; k < words.parts.size(); ++k) {
        const std::size_t at = k + static_cast<std::size_t>(offset);
        if (at >= carried.size() || carried.columns[at] < 0) continue;
        const RawTopic& carrier = table.raw.topics[carried.topic];
        const RawColumn& column = carrier.columns[static_cast<std::size_t>(carried.columns[at])];
        // Some stored records may have been dropped, so samples are matched by their times.
        std::vector<double> stored, taken;
        std::size_t record = 0;
        for (std::size_t i = 0; i < log.samples.size(); ++i) {
          const double time_s = 1e-6 * log.samples[i].time_us + log.epoch_s;
          while (record + 1 < carrier.time_s.size() && carrier.time_s[record] < time_s - 1e-6) ++record;
          stored.push_back(column.values[record]);
          taken.push_back(interpreted(log, i, words.signal + static_cast<int>(k)));
        }
        if (log.samples.empty()) stored = column.values;
        const Line line = line_through(taken, stored);
        const bool compared = line.count > 10 && std::abs(line.correlation) > 0.5;
        if (words.signal == kForceBody && !compared) continue;  // frame and gravity are undecided
        const UnitGuess& unit = unit_of(words, compared ? line.slope : slope_by_name(carried, stored));
        const std::string evidence =
            compared ? fmt::format("{:.4g} per SI unit, correlation {:.3f}", line.slope, line.correlation)
                     : "by its name";
        writer.line(words.name + std::string(words.parts[k]), column.name, unit.name, words.frame, evidence);
      }
    }
  }
  add_guesses(topic, writer);
  return writer.text;
}

}  // namespace swarmcert::logs
