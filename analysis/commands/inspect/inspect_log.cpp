#include "analysis/commands/inspect/inspect_log.h"

#include <fmt/core.h>

#include <cmath>

#include "analysis/commands/shared/plausibility_output.h"
#include "analysis/logs/flight_story.h"
#include "analysis/logs/read_log.h"
#include "nn/base/json_number.h"

namespace swarmcert::analysis {
namespace {

const char* name(logs::SignalInfo::Source source) {
  const char* const kWords[] = {"measured", "derived", "missing"};
  return kWords[static_cast<int>(source)];
}

using files::finite;

files::Json force_axes(const logs::Log& log) {
  files::Json axes = files::Json::array();
  const char* const kAxes[] = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    if (log.signals.force_axes[k]) axes.push_back(kAxes[k]);
  }
  return axes;
}

files::Json torque_axes(const logs::Log& log) {
  return log.signals.torque == logs::TorqueUse::kNone ? files::Json::array() : files::Json({"x", "y", "z"});
}

const char* torque_use(logs::TorqueUse use) {
  const char* const kWords[] = {"none", "mean in slow flight", "dynamic"};
  return kWords[static_cast<int>(use)];
}

std::string joined(const files::Json& axes) {
  std::string text;
  for (const files::Json& axis : axes) text += (text.empty() ? "" : " ") + axis.get<std::string>();
  return text.empty() ? "none" : text;
}

files::Json health_of(const logs::LogHealth& health) {
  return {{"sound", logs::is_sound(health)},          {"blocks", health.blocks},
          {"damaged_blocks", health.damaged_blocks},  {"skipped_bytes", health.skipped_bytes},
          {"damaged_lines", health.damaged_lines},    {"not_finite", health.not_finite},
          {"clock_jumps", health.clock_jumps},        {"gaps", health.gaps},
          {"longest_gap_s", health.longest_gap_s},    {"truncated", health.truncated},
          {"checksum_failed", health.checksum_failed}};
}

const char* name(logs::Completeness completeness) {
  const char* const kWords[] = {"complete", "cut", "damaged"};
  return kWords[static_cast<int>(completeness)];
}

/// "damaged, 3.1 % lost; repaired: 12 unsorted rows"
std::string completeness_in_words(const logs::Log& log) {
  std::string words = name(logs::completeness_of(log.health));
  const double lost = logs::lost_share(log);
  if (lost > 0) words += fmt::format(", {:.2g} % lost", 100 * lost);
  const logs::Repaired& repaired = log.health.repaired;
  std::string list;
  for (const auto& [count, what] : {std::pair(repaired.unsorted_rows, "unsorted rows"),
                                    std::pair(repaired.repeated_rows, "repeated rows"),
                                    std::pair(repaired.unwrapped_clocks, "wraps of the clock"),
                                    std::pair(repaired.merged_blocks, "log blocks of other rates")})
    if (count > 0) list += fmt::format("{}{} {}", list.empty() ? "; repaired: " : ", ", count, what);
  return words + list;
}

double start_s(const logs::Log& log) { return log.samples.empty() ? 0 : log.samples.front().time_us * 1e-6; }
double end_s(const logs::Log& log) { return log.samples.empty() ? 0 : log.samples.back().time_us * 1e-6; }

}  // namespace

files::Json describe_log(const logs::Log& log) {
  const logs::FlightStory story = logs::tell(log);
  files::Json json = {{"kind", "log"},
                      {"format", log.format},
                      {"channels", log.channels},
                      {"records", log.health.records},
                      {"t0_s", start_s(log)},
                      {"t1_s", end_s(log)},
                      {"epoch_s", log.epoch_s},
                      {"in_the_air_s", story.air_s}};
  json["no_flight"] = story.no_flight.empty() ? files::Json(nullptr) : files::Json(story.no_flight);
  json["signals"] = files::Json::array();
  for (const logs::SignalInfo& signal : log.sources) {
    const bool missing = signal.source == logs::SignalInfo::Source::kMissing;
    json["signals"].push_back(
        {{"name", signal.name},
         {"source", name(signal.source)},
         {"from", missing ? files::Json(nullptr) : files::Json(signal.from)},
         {"unit", signal.unit},
         {"rate_hz", missing ? files::Json(nullptr) : files::Json(signal.rate_hz)},
         {"noise", finite(signal.noise)},
         {"odds_bits", finite(signal.odds_bits)},
         {"runner_up", signal.runner_up.empty() ? files::Json(nullptr) : files::Json(signal.runner_up)}});
  }
  json["judged"] = {{"force", force_axes(log)}, {"torque", torque_axes(log)}};
  json["judged_torque"] = torque_use(log.signals.torque);
  json["hover_command"] = finite(log.hover_command);
  json["missing"] = files::Json::array();
  for (const logs::MissingSignal& missing : story.missing)
    json["missing"].push_back(
        {{"signal", missing.signal}, {"for", missing.needed_for}, {"log_this", missing.log_this}});
  json["phases"] = files::Json::array();
  for (const logs::Phase& phase : story.phases)
    json["phases"].push_back({{"phase", phase.name}, {"start_s", phase.start_s}, {"end_s", phase.end_s}});
  json["events"] = files::Json::array();
  for (const logs::LogEvent& event : story.events)
    json["events"].push_back({{"event", event.kind},
                              {"time_s", event.time_s},
                              {"duration_s", event.duration_s},
                              {"what", event.what}});
  json["delays"] = files::Json::array();
  for (const logs::SignalDelay& delay : log.delays)
    json["delays"].push_back({{"signal", delay.signal},
                              {"against", delay.against},
                              {"delay_s", delay.delay_s},
                              {"correlation", delay.correlation}});
  if (story.battery_first_V > 0)
    json["battery"] = {{"first_V", story.battery_first_V},
                       {"last_V", story.battery_last_V},
                       {"least_V", story.battery_least_V}};
  json["interpretation"] = log.interpretation;
  json["completeness"] = name(logs::completeness_of(log.health));
  json["lost_share"] = finite(logs::lost_share(log));
  const logs::Repaired& repaired = log.health.repaired;
  json["repaired"] = {{"unsorted_rows", repaired.unsorted_rows},
                      {"repeated_rows", repaired.repeated_rows},
                      {"unwrapped_clocks", repaired.unwrapped_clocks},
                      {"merged_blocks", repaired.merged_blocks}};
  json["health"] = health_of(log.health);
  json["plausibility"] = files::to_json(files::record_of(logs::doubts_of(log)));
  return json;
}

LogOutcome outcome_of(const std::string& path, const logs::Log& log, const files::Json& described) {
  LogOutcome outcome;
  outcome.path = path;
  outcome.opened = true;
  outcome.seconds = described["in_the_air_s"].get<double>();
  const files::Json& no_flight = described["no_flight"];
  if (!no_flight.is_null()) outcome.left_out_why = "no flight: " + no_flight.get<std::string>();
  for (const files::Json& doubt : described["plausibility"]) {
    if (outcome.left_out_why.empty() && doubt["refused"].get<bool>())
      outcome.left_out_why = "implausible: " + doubt["signal"].get<std::string>();
  }
  if (outcome.left_out_why.empty() && !log.signals.force && log.signals.torque == logs::TorqueUse::kNone)
    outcome.left_out_why = "lacks " + log.signals.force_lacks;
  if (!outcome.left_out_why.empty()) return outcome;
  for (std::size_t k = 0; k < 3; ++k) outcome.force[k] = log.signals.force_axes[k];
  outcome.torque = log.signals.torque != logs::TorqueUse::kNone;
  return outcome;
}

void print_log(const logs::Log& log) {
  const logs::FlightStory story = logs::tell(log);
  fmt::print("{}: flight log ({}), {} records from {:.3f} to {:.3f} s, {:.1f} s in the air\n", log.path,
             log.format, log.health.records, start_s(log), end_s(log), story.air_s);
  if (!story.no_flight.empty()) fmt::print("  no flight: {}\n", story.no_flight);
  fmt::print("  {}\n", completeness_in_words(log));
  for (const std::string& finding : logs::findings(log.health)) fmt::print("  {}\n", finding);
  for (const logs::Doubt& doubt : logs::doubts_of(log)) fmt::print("  implausible: {}\n", doubt.words);
  for (const logs::SignalInfo& signal : log.sources) {
    if (signal.source == logs::SignalInfo::Source::kMissing) {
      fmt::print("  {:<18} missing\n", signal.name);
      continue;
    }
    fmt::print("  {:<18} {:<9}{:>7.1f} Hz  {}{}{}\n", signal.name, name(signal.source), signal.rate_hz,
               signal.from, signal.unit.empty() || signal.unit == "1" ? "" : " [" + signal.unit + "]",
               std::isfinite(signal.noise) ? fmt::format(", noise {:.2g}", signal.noise) : "");
    if (std::isfinite(signal.odds_bits))
      fmt::print("  {:<18} odds 2^{:.0f} against {}\n", "", signal.odds_bits, signal.runner_up);
  }
  for (const std::string& words : log.interpretation) fmt::print("  seen: {}\n", words);
  for (const logs::SignalDelay& delay : log.delays)
    fmt::print("  {} is {:.0f} ms {} {}\n", delay.signal, 1000 * std::abs(delay.delay_s),
               delay.delay_s < 0 ? "ahead of" : "behind", delay.against);
  fmt::print("  can be judged: force {}; torque {} ({})\n", joined(force_axes(log)), joined(torque_axes(log)),
             torque_use(log.signals.torque));
  for (const logs::MissingSignal& missing : story.missing)
    fmt::print("  missing for {}: {} ({})\n", missing.needed_for, missing.signal, missing.log_this);
  for (const logs::Phase& phase : story.phases)
    fmt::print("  {:>8.2f} .. {:>8.2f} s  {}\n", phase.start_s, phase.end_s, phase.name);
  for (const logs::LogEvent& event : story.events)
    fmt::print("  {:>8.2f} s  {}: {}{}\n", event.time_s, event.kind, event.what,
               event.duration_s > 0 ? fmt::format(", {:.3f} s", event.duration_s) : "");
  if (story.battery_first_V > 0)
    fmt::print("  battery in the air {:.2f} to {:.2f} V, least {:.2f} V\n", story.battery_first_V,
               story.battery_last_V, story.battery_least_V);
}

void print_log_row(const std::string& path, const files::Json& described) {
  const files::Json& no_flight = described["no_flight"];
  fmt::print("{:<60} {:<14} {:>7} records {:>6.1f} s in the air, force {:<6} torque {:<6}{}\n", path,
             described["format"].get<std::string>(), described["records"].get<std::size_t>(),
             described["in_the_air_s"].get<double>(), joined(described["judged"]["force"]),
             joined(described["judged"]["torque"]),
             no_flight.is_null() ? "" : "  no flight: " + no_flight.get<std::string>());
}

}  // namespace swarmcert::analysis
