#include <fmt/core.h>

#include <cmath>
#include <cstdint>

#include "analysis/logs/angles.h"
#include "analysis/logs/interpretation.h"
#include "analysis/logs/statistics_of_series.h"

namespace swarmcert::logs {
namespace {

constexpr double kBelieved = 0.4;  ///< correlation above which a sign or a unit is considered established

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

/// Rz(yaw) Ry(pitch) Rx(roll)
Attitude quaternion_of(double roll, double pitch, double yaw) {
  const double cr = std::cos(roll / 2), sr = std::sin(roll / 2), cp = std::cos(pitch / 2),
               sp = std::sin(pitch / 2), cy = std::cos(yaw / 2), sy = std::sin(yaw / 2);
  return {sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy,
          cr * cp * cy + sr * sp * sy};
}

void set_attitude(SignalTable& table, std::size_t record, const Attitude& attitude) {
  const std::array<double, 4> xyzw = attitude.xyzw();
  for (int k = 0; k < 4; ++k) table[kAttitude + k][record] = xyzw[static_cast<std::size_t>(k)];
}

void make_room(SignalTable& table) {
  for (int k = 0; k < 4; ++k) table[kAttitude + k].assign(table.size(), 0);
}

/// Decides between the orders x, y, z, w and w, x, y, z: a vehicle that flies is upright most of the time. An order
/// that names state is given up only if it lays the vehicle on its side or back and the other order keeps it upright.
void settle_order(Draft& draft) {
  const Carried* const carried = draft.recognition.find(kAttitude);
  if (carried == nullptr || !draft.asks_physics) return;
  SignalTable& t = draft.table;
  double last_is_w = 0, first_is_w = 0;  // sum of the cosines of the tilt
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double a = t[kAttitude][i], b = t[kAttitude + 1][i], c = t[kAttitude + 2][i];
    last_is_w += 1 - 2 * (a * a + b * b);
    first_is_w += 1 - 2 * (b * b + c * c);
  }
  constexpr double kOnItsSide = 0.5, kUpright = 0.9;  // mean cosine of the tilt
  const auto n = static_cast<double>(t.size());
  const bool is_open = carried->ask == Ask::kQuaternion;
  const bool w_first =
      is_open ? first_is_w > last_is_w : last_is_w < kOnItsSide * n && first_is_w > kUpright * n;
  if (!is_open && !w_first) return;
  if (w_first) {
    for (int k = 0; k < 3; ++k) std::swap(t[kAttitude + k], t[kAttitude + k + 1]);
  }
  draft.note(fmt::format("{}: order {}, which keeps the vehicle more upright", names_of(draft.raw, *carried),
                         w_first ? "w, x, y, z" : "x, y, z, w"));
}

/// Acceleration in W rotated by -yaw: forward and left components.
struct Lateral {
  std::vector<double> forward, left;
};

Lateral lateral_acceleration(const Draft& draft, double yaw_scale) {
  const SignalTable& t = draft.table;
  Lateral lateral;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double yaw = t.has(kEuler + 2) ? yaw_scale * t[kEuler + 2][i] : 0;
    const double ax = draft.acceleration_m_s2[0][i], ay = draft.acceleration_m_s2[1][i];
    lateral.forward.push_back(std::cos(yaw) * ax + std::sin(yaw) * ay);
    lateral.left.push_back(-std::sin(yaw) * ax + std::cos(yaw) * ay);
  }
  return lateral;
}

bool has_lateral(const Draft& draft) {
  return !draft.acceleration_m_s2[0].empty() && !draft.acceleration_m_s2[1].empty();
}

double largest(const std::vector<double>& values) {
  double found = 0;
  for (const double value : values) found = std::max(found, std::abs(value));
  return found;
}

/// Decides between degrees and radians, and the signs of roll and pitch: positive pitch accelerates forward by g per
/// radian, positive roll to the right.
void settle_angles(Draft& draft) {
  const Carried& carried = *draft.recognition.find(kEuler);
  SignalTable& t = draft.table;
  if (carried.ask == Ask::kLegacyPitch && t.has(kEuler + 1)) {
    for (double& pitch : t[kEuler + 1]) pitch = -pitch;
  }
  const bool lateral_known = has_lateral(draft);
  if (carried.ask == Ask::kAngles && draft.asks_physics) {
    double range = 0;
    for (int k = 0; k < 3; ++k) {
      if (t.has(kEuler + k)) range = std::max(range, largest(t[kEuler + k]));
    }
    bool degrees = range > 2 * kPi;
    if (!degrees && lateral_known && t.has(kEuler)) {
      const Line line = line_through(t[kEuler], lateral_acceleration(draft, 1).left);
      degrees = std::abs(line.correlation) > kBelieved && std::abs(line.slope) < kGravity_m_s2 / 8;
    }
    if (degrees) {
      for (int k = 0; k < 3; ++k) {
        for (double& angle : t[kEuler + k]) angle *= kDegree_rad;
      }
    }
    draft.note(fmt::format("{}: {}, largest {:.3g}", names_of(draft.raw, carried),
                           degrees ? "degrees" : "radians", range));
  }
  if (!lateral_known || !draft.asks_physics) return;
  const Lateral lateral = lateral_acceleration(draft, 1);
  for (const int k : {0, 1}) {
    if (!t.has(kEuler + k)) continue;
    const Line line = line_through(t[kEuler + k], k == 0 ? lateral.left : lateral.forward);
    if (std::abs(line.correlation) < kBelieved) continue;
    const double expected = k == 0 ? -kGravity_m_s2 : kGravity_m_s2;
    const bool agrees = line.slope * expected > 0;
    draft.note(fmt::format("{} positive accelerates {}: {:+.1f} m/s^2 per rad, correlation {:.2f}{}",
                           k == 0 ? "roll" : "pitch",
                           k == 0 ? (line.slope < 0 ? "to the right" : "to the left")
                                  : (line.slope < 0 ? "backward" : "forward"),
                           line.slope, line.correlation, agrees ? "" : "; its sign is inverted"));
    if (agrees) continue;
    for (double& angle : t[kEuler + k]) angle = -angle;
  }
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
    set_attitude(t, i, quaternion_of(roll, pitch, yaw));
  }
}

/// Returns the rates of the attitude in B: 2 q* dq/dt.
std::array<std::vector<double>, 3> attitude_rates(const SignalTable& t) {
  std::array<std::vector<double>, 3> rates;
  for (auto& axis : rates) axis.assign(t.size(), std::nan(""));
  for (std::size_t i = 1; i + 1 < t.size(); ++i) {
    if (t.restarts[i] != 0 || t.restarts[i + 1] != 0) continue;
    std::array<double, 4> a{}, b{};
    double dot = 0;
    for (int k = 0; k < 4; ++k) {
      a[static_cast<std::size_t>(k)] = t[kAttitude + k][i - 1];
      b[static_cast<std::size_t>(k)] = t[kAttitude + k][i + 1];
      dot += a[static_cast<std::size_t>(k)] * b[static_cast<std::size_t>(k)];
    }
    const double sign = dot < 0 ? -2 : 2, step_s = 1e-6 * (t.time_us[i + 1] - t.time_us[i - 1]);
    // vector part of a* b, for small rotations
    rates[0][i] = sign * (a[3] * b[0] - a[0] * b[3] - a[1] * b[2] + a[2] * b[1]) / step_s;
    rates[1][i] = sign * (a[3] * b[1] - a[1] * b[3] - a[2] * b[0] + a[0] * b[2]) / step_s;
    rates[2][i] = sign * (a[3] * b[2] - a[2] * b[3] - a[0] * b[1] + a[1] * b[0]) / step_s;
  }
  return rates;
}

void settle_rates(Draft& draft) {
  const Carried* const carried = draft.recognition.find(kRates);
  SignalTable& t = draft.table;
  if (carried == nullptr || !t.has_group(kRates, 3)) {
    draft.add("rates", SignalInfo::Source::kMissing, "", "rad/s");
    return;
  }
  if (carried->ask == Ask::kLegacyPitch) {
    for (double& rate : t[kRates + 1]) rate = -rate;
  }
  if (carried->ask == Ask::kRates && draft.asks_physics && draft.log.signals.attitude) {
    const auto seen = attitude_rates(t);
    double weighted = 0, weight = 0;
    for (int k = 0; k < 2; ++k) {
      const Line line = line_through(seen[static_cast<std::size_t>(k)], t[kRates + k]);
      if (std::abs(line.correlation) < kBelieved) continue;
      weighted += line.correlation * std::abs(line.slope);
      weight += line.correlation;
    }
    if (weight > 0) {
      // Choose the scale that fits best among the ratios of common units.
      const double ratio = weighted / weight;
      double best = 1;
      for (const double scale : {1 / kDegree_rad, kDegree_rad, 1000.0}) {
        if (std::abs(std::log(ratio / scale)) < std::abs(std::log(ratio / best))) best = scale;
      }
      for (int k = 0; k < 3 && best != 1; ++k) {
        for (double& rate : t[kRates + k]) rate /= best;
      }
      draft.note(fmt::format("{}: read as {}, {:.3g} times the derivative of the attitude{}",
                             names_of(draft.raw, *carried), carried->unit.empty() ? "rad/s" : carried->unit,
                             ratio, best == 1 ? "" : fmt::format("; divided by {:.4g}", best)));
    }
  }
  draft.add_measured("rates", kRates);
}

}  // namespace

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
    settle_order(draft);
    if (draft.has_forward_right_down) t.turn_half_about_x(kAttitude);
    draft.log.signals.attitude = true;
    draft.add_measured("attitude", kAttitude);
  } else if (t.has_group(kEuler, 2)) {
    settle_angles(draft);
    make_room(t);
    for (std::size_t i = 0; i < t.size(); ++i)
      set_attitude(t, i,
                   quaternion_of(t[kEuler][i], t[kEuler + 1][i], t.has(kEuler + 2) ? t[kEuler + 2][i] : 0));
    draft.log.signals.attitude = t.has(kEuler + 2);
    draft.add("attitude", SignalInfo::Source::kDerived,
              "Euler angles " + names_of(draft.raw, *draft.recognition.find(kEuler)), "1");
  } else {
    if (draft.recognition.find(kEuler) != nullptr) settle_angles(draft);
    const bool possible = has_lateral(draft);
    derive_from_acceleration(draft);
    draft.add("attitude", possible ? SignalInfo::Source::kDerived : SignalInfo::Source::kMissing,
              !possible           ? ""
              : t.has(kEuler + 2) ? "thrust axis along acceleration + g; yaw from its column"
                                  : "thrust axis along acceleration + g; yaw unknown",
              "1");
  }
  settle_rates(draft);
}

}  // namespace swarmcert::logs
