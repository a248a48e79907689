#include "analysis/logs/signals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "nn/base/input_error.h"
#include "nn/base/suggest.h"

namespace swarmcert::logs {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kLongestPause_us = 10e6;
constexpr double kTickRange_us = 4294967296.0;

using Values = std::array<double, kNumSignals>;

/// The firmware's packed quaternion: two bits name the largest component, which is positive; the others have a sign
/// and nine bits each, from the last component down to the first.
std::array<double, 4> unpacked(double packed) {
  auto bits = static_cast<std::uint32_t>(packed);
  const std::uint32_t largest = bits >> 30;
  std::array<double, 4> q{};
  double sum = 0;
  for (int i = 3; i >= 0; --i) {
    if (static_cast<std::uint32_t>(i) == largest) continue;
    const double magnitude = static_cast<double>(bits & 511u) / 511 / std::sqrt(2.0);
    const double value = (bits & 512u) != 0 ? -magnitude : magnitude;
    bits >>= 10;
    q[static_cast<std::size_t>(i)] = value;
    sum += value * value;
  }
  q[largest] = std::sqrt(std::max(0.0, 1 - sum));
  return q;
}

Vector three(const Values& values, int first) {
  const auto k = static_cast<std::size_t>(first);
  return {values[k], values[k + 1], values[k + 2]};
}

std::array<double, 4> four(const Values& values, int first) {
  const auto k = static_cast<std::size_t>(first);
  return {values[k], values[k + 1], values[k + 2], values[k + 3]};
}

template <std::size_t kSize>
bool is_finite(const std::array<double, kSize>& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

}  // namespace

std::array<Vector, 3> rotation(const Sample& sample) {
  const auto& [x, y, z, w] = sample.attitude;
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
           {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
           {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

struct SampleBuilder::State {
  Log& log;
  const SignalMap& map;
  struct Used {
    std::size_t signal, column;
    double multiply, divide;
  };
  std::vector<Used> used;
  std::array<bool, kNumSignals> has{};
  bool wraps = false;
  std::optional<Sample> pending;  ///< a jump in time that the next record must confirm

  bool has_group(int first, int size) const {
    for (int k = first; k < first + size; ++k) {
      if (!has[static_cast<std::size_t>(k)]) return false;
    }
    return true;
  }

  /// Finite in all that the log's signals need, or nothing.
  std::optional<Sample> to_sample(const Values& values) const {
    Sample sample;
    sample.time_us = values[kTime];
    sample.position_m = three(values, kPosition);
    sample.velocity_m_s = three(values, kVelocity);
    bool sound =
        std::isfinite(sample.time_us) && is_finite(sample.position_m) && is_finite(sample.velocity_m_s);
    if (has[kPackedAttitude]) {
      sound = sound && std::isfinite(values[kPackedAttitude]);
      if (sound) sample.attitude = unpacked(values[kPackedAttitude]);
    } else if (has_group(kAttitude, 4)) {
      sample.attitude = four(values, kAttitude);
      double norm = 0;
      for (const double q : sample.attitude) norm += q * q;
      sound = sound && std::abs(norm - 1) < 0.05;  // also false for NaN
    }
    if (log.signals.force) {
      sample.specific_force_m_s2 = specific_force(values, sample);
      sample.duty = four(values, kDuty);
      sample.battery_V = values[kBattery];
      sound = sound && is_finite(sample.specific_force_m_s2) && is_finite(sample.duty) &&
              std::isfinite(sample.battery_V);
    }
    if (!sound) return std::nullopt;
    sample.rates_rad_s = three(values, kRates);
    sample.target_position_m = three(values, kTargetPosition);
    sample.target_velocity_m_s = three(values, kTargetVelocity);
    sample.motor_force_N = four(values, kMotorForce);
    sample.thrust_command_N = values[kThrust];
    sample.torque_command_Nm = three(values, kTorque);
    return sample;
  }

  Vector specific_force(const Values& values, const Sample& sample) const {
    if (has_group(kForceWorld, 3)) return three(values, kForceWorld);
    if (has_group(kForceBody, 3)) {
      const Vector body = three(values, kForceBody);
      const auto R = rotation(sample);
      Vector world{};
      for (std::size_t i = 0; i < 3; ++i)
        world[i] = R[i][0] * body[0] + R[i][1] * body[1] + R[i][2] * body[2];
      return world;
    }
    Vector world = three(values, kAccelerationWorld);
    world[2] += kGravity_m_s2;
    return world;
  }

  void accept(Sample sample) {
    std::vector<Sample>& samples = log.samples;
    sample.restarts = true;
    if (!samples.empty()) {
      const double pause_s = (sample.time_us - samples.back().time_us) * 1e-6;
      sample.restarts = pause_s > kLongestGap_s;
      if (sample.restarts) {
        ++log.health.gaps;
        log.health.longest_gap_s = std::max(log.health.longest_gap_s, pause_s);
      }
    }
    samples.push_back(sample);
    ++log.health.records;
  }

  void drop_pending() {
    if (pending) ++log.health.clock_jumps;
    pending.reset();
  }

  void take(const Sample& sample) {
    std::vector<Sample>& samples = log.samples;
    if (pending) {
      const double after = sample.time_us - pending->time_us;
      if (after > 0 && after <= kLongestPause_us)
        accept(*pending);
      else
        drop_pending();
      pending.reset();
    }
    if (samples.size() == 1 && sample.time_us <= samples[0].time_us) {  // the first record was the odd one
      samples.clear();
      --log.health.records;
      ++log.health.clock_jumps;
    }
    const double step = samples.empty() ? 1 : sample.time_us - samples.back().time_us;
    if (step <= 0) {
      ++log.health.clock_jumps;
    } else if (step > kLongestPause_us) {
      pending = sample;
    } else {
      accept(sample);
    }
  }
};

SampleBuilder::SampleBuilder(Log& log, const SignalMap& map)
    : state_(new State{log, map, {}, {}, false, {}}) {}
SampleBuilder::~SampleBuilder() = default;

void SampleBuilder::begin(const std::vector<std::string>& names) {
  State& s = *state_;
  s.log.channels = names;
  for (const SignalSource& source : s.map) {
    const auto found = std::find(names.begin(), names.end(), source.column);
    const auto signal = static_cast<std::size_t>(source.signal);
    if (found == names.end() && source.is_certain) {
      throw files::InputError({s.log.path, "line 1", "column", files::in_quotes(source.column),
                               "is no column of this log, but columns.toml names it",
                               files::did_you_mean(source.column, names)});
    }
    if (found == names.end() || s.has[signal]) continue;
    s.has[signal] = true;
    if (source.signal == kTime) s.wraps = source.column == "tick";
    s.used.push_back(
        {signal, static_cast<std::size_t>(found - names.begin()), source.multiply, source.divide});
  }
  const auto need = [&](bool present, const std::string& what) {
    if (present) return;
    throw files::InputError({s.log.path, "", what, "", "no column carries it",
                             "log it, or say in a columns.toml (--columns) which column does"});
  };
  need(s.has[kTime], "time");
  need(s.has_group(kPosition, 3), "position");
  need(s.has_group(kVelocity, 3), "velocity");
  Signals& signals = s.log.signals;
  const bool attitude = s.has[kPackedAttitude] || s.has_group(kAttitude, 4);
  const bool force =
      s.has_group(kForceWorld, 3) || s.has_group(kForceBody, 3) || s.has_group(kAccelerationWorld, 3);
  const std::pair<bool, const char*> needed[] = {{force, "specific force"},
                                                 {attitude, "attitude"},
                                                 {s.has_group(kDuty, 4), "duty of the motors"},
                                                 {s.has[kBattery], "battery voltage"}};
  for (const auto& [present, what] : needed) {
    if (!present) signals.force_lacks += (signals.force_lacks.empty() ? "" : ", ") + std::string(what);
  }
  signals.force = signals.force_lacks.empty();
  signals.targets = s.has_group(kTargetPosition, 3) && s.has_group(kTargetVelocity, 3);
  signals.commands = s.has_group(kMotorForce, 4) && s.has[kThrust] && s.has_group(kTorque, 3);
  signals.rates = s.has_group(kRates, 3);
}

bool SampleBuilder::needs(std::size_t column) const {
  return std::any_of(state_->used.begin(), state_->used.end(),
                     [&](const State::Used& used) { return used.column == column; });
}

void SampleBuilder::record(const std::vector<double>& raw) {
  State& s = *state_;
  Values values;
  values.fill(kNaN);
  for (const State::Used& used : s.used) values[used.signal] = raw[used.column] * used.multiply / used.divide;
  if (s.wraps && !s.log.samples.empty()) {
    // Of all times that a 32-bit tick can mean, the one nearest to the last.
    values[kTime] +=
        kTickRange_us * std::round((s.log.samples.back().time_us - values[kTime]) / kTickRange_us);
  }
  const std::optional<Sample> sample = s.to_sample(values);
  if (sample)
    s.take(*sample);
  else
    ++s.log.health.not_finite;
}

void SampleBuilder::end() { state_->drop_pending(); }

}  // namespace swarmcert::logs
