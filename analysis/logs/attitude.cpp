#include <fmt/core.h>

#include <cmath>
#include <cstdint>

#include "analysis/logs/interpretation.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

/// Unpacks the firmware's quaternion: two bits identify the largest component, which is positive; each of the others
/// has a sign and nine bits, from the last component down to the first.
Attitude unpacked(double packed) {
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
  return {q[0], q[1], q[2], q[3]};
}

void set_attitude(SignalTable& table, std::size_t record, const Attitude& attitude) {
  const std::array<double, 4> xyzw = attitude.xyzw();
  for (int k = 0; k < 4; ++k) table[kAttitude + k][record] = xyzw[static_cast<std::size_t>(k)];
}

void make_room(SignalTable& table) {
  for (int k = 0; k < 4; ++k) table[kAttitude + k].assign(table.size(), 0);
}

bool has_lateral(const Draft& draft) {
  return !draft.acceleration_m_s2[0].empty() && !draft.acceleration_m_s2[1].empty();
}

/// Derives the attitude whose thrust axis is along acceleration + g and whose yaw is the given one.
void derive_from_acceleration(Draft& draft) {
  SignalTable& t = draft.table;
  make_room(t);
  const bool lateral = has_lateral(draft), has_yaw = t.has(kEuler + 2);
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double yaw = has_yaw ? t[kEuler + 2][i] : 0;
    double ax = lateral ? draft.acceleration_m_s2[0][i] : 0, ay = lateral ? draft.acceleration_m_s2[1][i] : 0;
    double az = draft.acceleration_m_s2[2].empty() ? 0 : draft.acceleration_m_s2[2][i];
    if (!std::isfinite(ax + ay + az)) ax = ay = az = 0;
    // In free fall there is no thrust whose axis could be determined.
    const double up = std::max(kGravity_m_s2 + az, 0.2 * kGravity_m_s2);
    const double forward = std::cos(yaw) * ax + std::sin(yaw) * ay,
                 left = -std::sin(yaw) * ax + std::cos(yaw) * ay;
    const double pitch = std::atan2(forward, up), roll = std::atan2(-left, std::hypot(forward, up));
    set_attitude(t, i, attitude_of_angles(roll, pitch, yaw));
  }
}

}  // namespace

Attitude attitude_of_angles(double roll, double pitch, double yaw) {
  const double cr = std::cos(roll / 2), sr = std::sin(roll / 2), cp = std::cos(pitch / 2),
               sp = std::sin(pitch / 2), cy = std::cos(yaw / 2), sy = std::sin(yaw / 2);
  return {sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
          cr * cp * cy + sr * sp * sy};
}

std::array<Vector, 3> Attitude::rotation() const {
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
           {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
           {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
}

void settle_attitude(Draft& draft) {
  SignalTable& t = draft.table;
  const Carried* const quaternion = draft.recognition.find(kAttitude);
  if (t.has(kPackedAttitude)) {
    make_room(t);
    for (std::size_t i = 0; i < t.size(); ++i) set_attitude(t, i, unpacked(t[kPackedAttitude][i]));
    draft.log.signals.attitude = true;
    draft.add_measured("attitude", kPackedAttitude);
  } else if (quaternion != nullptr && t.has_group(kAttitude, 4)) {
    draft.log.signals.attitude = true;
    draft.add_measured("attitude", kAttitude);
  } else if (t.has_group(kEuler, 2)) {
    make_room(t);
    for (std::size_t i = 0; i < t.size(); ++i)
      set_attitude(
          t, i, attitude_of_angles(t[kEuler][i], t[kEuler + 1][i], t.has(kEuler + 2) ? t[kEuler + 2][i] : 0));
    draft.log.signals.attitude = t.has(kEuler + 2);
    const Carried& angles = *draft.recognition.find(kEuler);
    draft.add("attitude", SignalInfo::Source::kDerived, "Euler angles " + names_of(draft.raw, angles), "1");
    draft.log.sources.back().odds_bits = angles.odds_bits;
    draft.log.sources.back().runner_up = angles.runner_up;
  } else {
    const bool possible = has_lateral(draft);
    derive_from_acceleration(draft);
    draft.add("attitude", possible ? SignalInfo::Source::kDerived : SignalInfo::Source::kMissing,
              !possible           ? ""
              : t.has(kEuler + 2) ? "thrust axis along acceleration + g; yaw from its column"
                                  : "thrust axis along acceleration + g; yaw unknown",
              "1");
  }
  draft.add_measured_or_missing("rates", kRates, draft.is_measured(kRates) && t.has_group(kRates, 3));
}

}  // namespace swarmcert::logs
