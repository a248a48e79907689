#include "analysis/logs/interpretation.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "analysis/logs/clock.h"
#include "analysis/logs/message_frames.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/input_error.h"

namespace swarmcert::logs {
namespace {

using Source = SignalInfo::Source;

/// Returns "cf1" for "/cf1/pose"; empty for topics without a namespace.
std::string name_space(const std::string& topic) {
  const std::size_t end = topic.find('/', 1);
  return topic.empty() || topic[0] != '/' || end == std::string::npos ? "" : topic.substr(1, end - 1);
}

/// If a bag holds several vehicles, "/cf1/pose" and "/cf2/pose", keeps only the topics of the first one.
void keep_one_vehicle(RawLog& raw, Log& log) {
  const auto rest_of = [](const RawTopic& topic) {
    return topic.name.substr(std::min(topic.name.size(), name_space(topic.name).size() + 1));
  };
  std::map<std::string, std::set<std::string>> spaces;  // by the rest of the topic's name
  for (const RawTopic& topic : raw.topics)
    if (!name_space(topic.name).empty()) spaces[rest_of(topic)].insert(name_space(topic.name));
  std::set<std::string> others;
  std::string first;
  for (const RawTopic& topic : raw.topics) {
    const std::string space = name_space(topic.name);
    if (space.empty() || spaces[rest_of(topic)].size() < 2) continue;
    if (first.empty()) first = space;
    others.insert(space);
  }
  others.erase(first);
  if (others.empty()) return;
  const auto is_other = [&](const RawTopic& topic) { return others.count(name_space(topic.name)) != 0; };
  raw.topics.erase(std::remove_if(raw.topics.begin(), raw.topics.end(), is_other), raw.topics.end());
  std::string names;
  for (const std::string& other : others) names += (names.empty() ? "" : ", ") + other;
  log.interpretation.push_back("the file contains several vehicles: " + first + " is used, not " + names +
                               "; one file per vehicle makes them one flight");
}

/// Returns a signal of the table, or `otherwise` if the table does not have it.
double signal_value(const SignalTable& table, int signal, std::size_t record, double otherwise) {
  return table.has(signal) ? table[signal][record] : otherwise;
}

Sample sample_of(const SignalTable& t, std::size_t i, const Signals& signals) {
  Sample sample;
  sample.time_us = t.time_us[i];
  sample.restarts = t.restarts[i] != 0;
  const auto three = [&](int first, double otherwise) {
    return Vector{signal_value(t, first, i, otherwise), signal_value(t, first + 1, i, otherwise),
                  signal_value(t, first + 2, i, otherwise)};
  };
  sample.position_m = three(kPosition, 0);
  sample.velocity_m_s = three(kVelocity, 0);
  if (t.has(kAttitude)) sample.attitude = t.attitude(i);
  for (int k = 0; k < 4; ++k) {
    const auto at = static_cast<std::size_t>(k);
    sample.duty[at] = signal_value(t, kDuty + k, i, signals.force ? 0 : kNaN);
    sample.motor_force_N[at] = signal_value(t, kMotorForce + k, i, kNaN);
  }
  if (signals.force) sample.specific_force_m_s2 = three(kForceWorld, 0);
  for (int k = 0; k < signals.motor_commands; ++k)
    sample.motor_command[static_cast<std::size_t>(k)] = static_cast<float>(t[kMotorCommand + k][i]);
  if (signals.thrust != ThrustSource::kDuty) sample.given_thrust = signal_value(t, kThrust, i, 0);
  sample.battery_V = signal_value(t, kBattery, i, 0);
  sample.rates_rad_s = three(kRates, kNaN);
  sample.target_position_m = three(kTargetPosition, kNaN);
  sample.target_velocity_m_s = three(kTargetVelocity, kNaN);
  sample.thrust_command_N =
      signals.thrust == ThrustSource::kHoverMultiple ? kNaN : signal_value(t, kThrust, i, kNaN);
  sample.torque_command_Nm = three(kTorque, kNaN);
  return sample;
}

void refuse_without_motion(const Draft& draft) {
  if (draft.log.channels.empty())
    throw files::InputError({draft.raw.path, "", "columns", "", "no variable was logged",
                             "name them where the logger is configured: config.txt of a micro-SD deck"});
  for (const Carried& carried : draft.recognition.groups) {
    if (carried.signal < kAttitude) return;  // position, velocity or acceleration
  }
  if (has_torque_signals(draft.recognition)) return;
  std::string hint = "log it, or name its column in a columns.toml (--columns)";
  for (const std::string& rejected : draft.recognition.rejected) hint += "; not used: " + rejected;
  throw files::InputError({draft.raw.path, "", "position", "",
                           "no column carries it, nor a velocity or an acceleration, nor "
                           "rates beside the commands of motors",
                           hint});
}

/// Makes clocks that count from 1970 start at zero and stores the offset in Log::epoch_s. Other clocks keep their
/// start; a receiver may know its absolute time.
void take_epoch_off(const RawLog& raw, SignalTable& table, Log& log) {
  if (table.time_us.empty()) return;
  if (table.time_us.front() * 1e-6 < kAbsoluteClock_s) {
    log.epoch_s = std::max(0.0, receiver_offset_s(raw));
    return;
  }
  log.epoch_s = std::floor(table.time_us.front() * 1e-6);
  for (double& time_us : table.time_us) time_us -= 1e6 * log.epoch_s;
  for (LogEvent& event : log.events) event.time_s -= log.epoch_s;
}

/// Ends events that last to the end of the log there.
void end_events(const SignalTable& table, Log& log) {
  for (LogEvent& event : log.events) {
    if (std::isinf(event.duration_s) && table.size() > 0)
      event.duration_s = std::max(0.0, 1e-6 * table.time_us.back() - event.time_s);
  }
  log.events.erase(std::remove_if(log.events.begin(), log.events.end(),
                                  [](const LogEvent& event) { return !std::isfinite(event.duration_s); }),
                   log.events.end());
}

void add_rest(Draft& draft) {
  const std::pair<const char*, int> groups[] = {{"target_position", kTargetPosition},
                                                {"target_velocity", kTargetVelocity},
                                                {"motor_force", kMotorForce},
                                                {"torque_command", kTorque}};
  for (const auto& [name, signal] : groups) {
    if (draft.is_measured(signal)) draft.add_measured(name, signal);
  }
}

/// Adds up what was repaired in the topics that carry signals.
void count_repaired(const std::vector<Repaired>& of_topics, const Recognition& recognition, Repaired& sum) {
  std::set<std::size_t> used = {recognition.clock};
  for (const Carried& carried : recognition.groups) used.insert(carried.topic);
  for (const std::size_t topic : used) {
    if (topic >= of_topics.size()) continue;
    sum.unsorted_rows += of_topics[topic].unsorted_rows;
    sum.repeated_rows += of_topics[topic].repeated_rows;
    sum.unwrapped_clocks += of_topics[topic].unwrapped_clocks;
  }
}

double rate_hz_of(const RawTopic& topic) {
  const double step = median(steps_of(topic.time_s));
  return step > 0 ? 1 / step : 0;
}

}  // namespace

void Draft::add(const std::string& name, SignalInfo::Source source, const std::string& from,
                const std::string& unit, double noise) const {
  const double step_s = table.step_s();
  const bool has_rate = source != Source::kMissing && step_s > 0;
  log.sources.push_back({name, source, from, unit, has_rate ? 1 / step_s : 0, noise});
}

void Draft::add_measured(const std::string& name, int signal) const {
  std::string from, unit, topic, runner_up;
  double rate_hz = 0, odds_bits = kNaN;
  // A columns.toml assigns each axis separately.
  for (const Carried& carried : recognition.groups) {
    if (kind_of_signal(carried.signal).first != signal) continue;
    const RawTopic& carrier = raw.topics[carried.topic];
    from += from.empty() ? "" : ", ";
    if (raw.topics.size() > 1 && !carrier.name.empty() && carrier.name != topic) from += carrier.name + ": ";
    topic = carrier.name;
    from += names_of(raw, carried);
    unit = carried.unit;
    rate_hz = rate_hz_of(carrier);
    odds_bits = carried.odds_bits;
    runner_up = carried.runner_up;
  }
  log.sources.push_back({name, Source::kMeasured, from, unit, rate_hz, kNaN, odds_bits, runner_up});
}

void Draft::add_measured_or_missing(const std::string& name, int signal, bool is_there) const {
  if (is_there)
    add_measured(name, signal);
  else
    add(name, Source::kMissing, "", kind_of_signal(signal).units[0].name);
}

void settle_judgement(Draft& draft) {
  const SignalTable& t = draft.table;
  Signals& signals = draft.log.signals;
  const auto lacks = [&lacking = signals.force_lacks](const std::string& what) {
    lacking += (lacking.empty() ? "" : "; ") + what;
  };
  if (signals.specific_force == ForceSource::kNone)
    lacks("specific force, or a velocity or position to derive it from");
  if (signals.thrust == ThrustSource::kNone)
    lacks("thrust: duty of the motors and battery voltage, or a commanded force");
  if (!signals.not_multirotor.empty())
    signals.force_lacks =
        "rotors that carry it: the log says that the vehicle is a " + signals.not_multirotor;
  signals.force = signals.force_lacks.empty();
  for (std::size_t k = 0; k < 3 && signals.force; ++k) {
    const bool moves =
        signals.specific_force == ForceSource::kAccelerometer || !draft.acceleration_m_s2[k].empty();
    signals.force_axes[k] = moves && (k == 2 || signals.attitude);
  }
  signals.targets = t.has_group(kTargetPosition, 3) && t.has_group(kTargetVelocity, 3);
  signals.commands = t.has_group(kMotorForce, 4) && t.has(kThrust) && t.has_group(kTorque, 3);
  signals.rates = t.has_group(kRates, 3);
  signals.rotor_speeds = t.has_group(kRotorSpeed, 4);
  // Torques need the thrust of each rotor, and their dynamics are aliased below the rate of the attitude loop.
  const bool each_rotor = t.has_group(kDuty, 4) || t.has_group(kRotorSpeed, 4) ||
                          t.has_group(kRequested, 4) || signals.motor_commands > 0;
  signals.torque = !each_rotor || !signals.not_multirotor.empty()              ? TorqueUse::kNone
                   : signals.rates && t.step_s() > 0 && t.step_s() < 1 / 400.0 ? TorqueUse::kDynamic
                                                                               : TorqueUse::kMean;
}

Log interpret(RawLog raw, const SignalMap& map, SignalMap* meaning) {
  Log log;
  log.path = raw.path;
  log.format = raw.format;
  log.health = raw.health;
  log.armed = was_armed(raw);
  log.signals.not_multirotor = vehicle_without_rotors(raw);
  log.parameters = raw.parameters;
  keep_one_vehicle(raw, log);
  std::vector<Repaired> repaired;
  for (RawTopic& topic : raw.topics) repaired.push_back(put_in_order(topic));
  for (const RawTopic& topic : raw.topics) {
    for (const RawColumn& column : topic.columns) log.channels.push_back(column.name);
  }
  add_own_names(raw, log.interpretation);
  log.left_out = raw.left_out;
  Draft draft{raw, recognise(raw, map), {}, log, {}, map.empty()};
  if (meaning != nullptr) *meaning = meaning_of(raw, draft.recognition);
  draft.table = signal_table(raw, draft.recognition, log.health, log.events);
  count_repaired(repaired, draft.recognition, log.health.repaired);
  for (const std::string& decided : draft.recognition.decided) draft.note(decided);
  for (const std::string& rejected : draft.recognition.rejected) draft.note("not used: " + rejected);
  refuse_without_motion(draft);
  add_landed(raw, log);
  take_epoch_off(raw, draft.table, log);
  for (RawTopic& topic : raw.topics) {
    for (RawColumn& column : topic.columns) column.values = {};  // already copied to the table
  }
  derive_kinematics(draft);
  settle_attitude(draft);
  settle_specific_force(draft);
  settle_thrust(draft);
  if (meaning != nullptr) *meaning = meaning_of(raw, draft.recognition);
  add_rest(draft);
  settle_judgement(draft);
  estimate_delays(draft);
  end_events(draft.table, log);
  log.samples.reserve(draft.table.size());
  for (std::size_t i = 0; i < draft.table.size(); ++i)
    log.samples.push_back(sample_of(draft.table, i, log.signals));
  return log;
}

}  // namespace swarmcert::logs
