#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/logs/battery_compensation.h"
#include "analysis/logs/hover_scale.h"
#include "analysis/logs/interpretation.h"
#include "analysis/logs/statistics_of_series.h"
#include "nn/base/rotor_speed.h"

namespace swarmcert::logs {
namespace {

using Source = SignalInfo::Source;
constexpr int kFour = 4, kEight = 8;

/// Rotor commands or rotor states, as powers of the stored values.
struct Rotors {
  int first = 0, count = 0;
  std::string from;
};

/// Returns, per record, the specific force along the thrust axis over g, which thrust over weight should equal.
std::vector<double> load_factor(const Draft& draft) {
  const SignalTable& t = draft.table;
  std::vector<double> load(t.size(), kNaN);
  if (!t.has_group(kForceWorld, 3)) return load;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double x = t[kAttitude][i], y = t[kAttitude + 1][i];
    const double up = 1 - 2 * (x * x + y * y);  // of the thrust axis
    if (up > 0.5) load[i] = t[kForceWorld + 2][i] / up / kGravity_m_s2;
  }
  return load;
}

/// @param with_battery multiply the values by the battery voltage
std::vector<double> sum_of_powers(const SignalTable& t, const Rotors& rotors, double power,
                                  bool with_battery = false) {
  std::vector<double> sum(t.size(), 0);
  for (int k = 0; k < rotors.count; ++k) {
    for (std::size_t i = 0; i < t.size(); ++i)
      sum[i] += std::pow(std::max(t[rotors.first + k][i], 0.0) * (with_battery ? t[kBattery][i] : 1), power);
  }
  return sum;
}

/// Writes the rotor speeds as commands of the motors; see nn/base/rotor_speed.h.
void speeds_become_commands(Draft& draft) {
  SignalTable& t = draft.table;
  for (int k = 0; k < kFour; ++k) {
    t[kMotorCommand + k] = t[kRotorSpeed + k];
    for (double& command : t[kMotorCommand + k]) command /= kFullRotorSpeed_rad_s;
  }
  draft.log.hover_command /= kFullRotorSpeed_rad_s;
}

/// Sets the thrust in multiples of the hover thrust, linear or quadratic in the command, whichever follows the load
/// factor more closely.
void set_hover_multiple(Draft& draft, const Rotors& rotors, bool squares_only, const std::string& what) {
  SignalTable& t = draft.table;
  const std::vector<double> load = load_factor(draft);
  const std::vector<double> linear = sum_of_powers(t, rotors, 1), square = sum_of_powers(t, rotors, 2);
  const HoverScale of_linear = hover_scale(linear, load), of_square = hover_scale(square, load);
  const bool is_square = squares_only || of_square.scatter < of_linear.scatter;
  const HoverScale& scale = is_square ? of_square : of_linear;
  if (!(scale.hover > 0)) {
    if (quantile_of(linear, 1) <= 0) draft.log.hover_command = 0;
    draft.add("thrust", Source::kMissing, "", "N");
    return;
  }
  draft.log.hover_command =
      is_square ? std::sqrt(scale.hover / rotors.count) : scale.hover / static_cast<double>(rotors.count);
  std::vector<double>& given = t[kThrust];
  given = is_square ? square : linear;
  for (double& value : given) value /= scale.hover;
  draft.log.signals.thrust = ThrustSource::kHoverMultiple;
  const bool has_speeds = rotors.first == kRotorSpeed;
  if (has_speeds) speeds_become_commands(draft);
  if (has_speeds || rotors.first == kMotorCommand) {
    draft.log.signals.motor_commands = rotors.count;
    draft.log.motor_power = is_square ? 2 : 1;
  }
  draft.add("thrust", Source::kDerived,
            fmt::format("{} of {} over the value that carries the weight, at a mean command of {:.4g}", what,
                        rotors.from, draft.log.hover_command),
            "weight", scale.scatter);
  draft.note(fmt::format("thrust {} in {}: ", is_square ? "quadratic" : "linear", rotors.from) +
             (of_linear.scatter + of_square.scatter > 0
                  ? fmt::format("relative scatter {:.3f} (linear {:.3f}, quadratic {:.3f})", scale.scatter,
                                of_linear.scatter, of_square.scatter)
                  : "assumed: no load shows which"));
}

/// "motor.m1" is the requested thrust in some firmware versions and the applied duty in others: decided by which of the
/// two follows the load factor while the battery voltage drops.
bool is_requested(Draft& draft) {
  const Carried& carried = *draft.recognition.find(kRequested);
  SignalTable& t = draft.table;
  if (carried.ask != Ask::kMotors || t.has_group(kDuty, kFour)) return true;
  if (!t.has(kBattery)) return true;
  const std::vector<double> load = load_factor(draft);
  const std::vector<double> requested = sum_of_powers(t, {kRequested, kFour, ""}, 1);
  // The thrust of a brushed motor is roughly proportional to its mean voltage to the power 1.5.
  const std::vector<double> applied = sum_of_powers(t, {kRequested, kFour, ""}, 1.5, true);
  const double of_request = hover_scale(requested, load).scatter,
               of_duty = hover_scale(applied, load).scatter;
  const bool request = of_request<of_duty, is_shown = of_request + of_duty> 0;
  draft.note(
      fmt::format("{}: {}; ", names_of(draft.raw, carried), request ? "requested thrust" : "applied duty") +
      (is_shown ? fmt::format("relative scatter against the load {:.3f} as requested thrust, {:.3f} as "
                              "applied duty",
                              of_request, of_duty)
                : "assumed: no load shows which"));
  return request;
}

void derive_duty(Draft& draft, const std::string& from) {
  SignalTable& t = draft.table;
  for (int k = 0; k < kFour; ++k) {
    t[kDuty + k].resize(t.size());
    for (std::size_t i = 0; i < t.size(); ++i)
      t[kDuty + k][i] = compensated_duty(t[kRequested + k][i], t[kBattery][i]);
  }
  draft.add("duty", Source::kDerived, from + " and battery: the firmware's battery compensation", "1");
}

/// Derives the battery voltage at which the firmware's compensation turns the total request into the total duty.
void derive_battery(SignalTable& t) {
  std::vector<double>& battery = t[kBattery];
  battery.assign(t.size(), kNaN);
  double last = kNaN;
  for (std::size_t i = 0; i < t.size(); ++i) {
    double wanted_V = 0, duty = 0;
    for (int k = 0; k < kFour; ++k) {
      wanted_V += compensated_duty(t[kRequested + k][i], 1, false);
      duty += t[kDuty + k][i];
    }
    if (duty > 0.4) last = wanted_V / duty;
    battery[i] = last;
  }
  const double middle = median(battery);
  for (double& v : battery) v = std::isfinite(v) ? v : middle;
}

/// @param can_derive from the requested thrust and the duty
void settle_battery(Draft& draft, bool can_derive) {
  SignalTable& t = draft.table;
  if (t.has(kBattery)) {
    draft.add_measured("battery", kBattery);
  } else if (can_derive) {
    derive_battery(draft.table);
    draft.add("battery", Source::kDerived, "requested thrust and duty: the firmware's battery compensation",
              "V");
  } else {
    draft.add("battery", Source::kMissing, "", "V");
  }
}

/// Doubles the speeds of rotors that show half of them, replaces missing and impossible speeds by the mean of the
/// others, and reports these rotors.
void replace_broken_rotor_speeds(Draft& draft) {
  SignalTable& t = draft.table;
  std::array<double, kFour> middle{};
  std::vector<double> all;
  for (int k = 0; k < kFour; ++k) {
    std::vector<double> turning = t[kRotorSpeed + k];
    for (double& speed : turning) speed = speed > 0 ? speed : kNaN;
    middle[static_cast<std::size_t>(k)] = median(turning);
    all.push_back(middle[static_cast<std::size_t>(k)]);
  }
  const double common = quantile_of(all, 0.67);
  for (int k = 0; k < kFour; ++k) {
    std::vector<double>& speeds = t[kRotorSpeed + k];
    const double share = middle[static_cast<std::size_t>(k)] / common;
    if (share > 0.4 && share < 0.6) {
      for (double& speed : speeds) speed *= 2;
      draft.note(fmt::format("rotor {}: its speed is {:.2f} of the others': doubled", k + 1, share));
    }
  }
  // No rotor spins at three times the speed that carries the vehicle.
  const auto is_possible = [common](double speed) { return speed > 0.1 * common && speed < 3 * common; };
  std::array<std::size_t, kFour> replaced{};
  for (std::size_t i = 0; i < t.size(); ++i) {
    std::vector<double> others;
    for (int k = 0; k < kFour; ++k) {
      if (is_possible(t[kRotorSpeed + k][i])) others.push_back(t[kRotorSpeed + k][i]);
    }
    double mean = 0;
    for (const double speed : others) mean += speed / static_cast<double>(others.size());
    if (!(mean > 0.6 * common)) continue;
    for (int k = 0; k < kFour; ++k) {
      double& speed = t[kRotorSpeed + k][i];
      if (is_possible(speed)) continue;
      speed = mean;
      ++replaced[static_cast<std::size_t>(k)];
    }
  }
  for (std::size_t k = 0; k < kFour; ++k) {
    if (replaced[k] > 0)
      draft.note(fmt::format("rotor {}: {} records without a possible speed, taken from the others", k + 1,
                             replaced[k]));
  }
}

int number_of_commands(const SignalTable& t) {
  int count = 0;
  while (count < kEight && t.has(kMotorCommand + count)) ++count;
  return count;
}

}  // namespace

void settle_thrust(Draft& draft) {
  SignalTable& t = draft.table;
  Signals& signals = draft.log.signals;
  const bool has_duty = t.has_group(kDuty, kFour);
  bool has_request = t.has_group(kRequested, kFour);
  settle_battery(draft, has_duty && has_request);
  if (has_duty) {
    draft.add_measured("duty", kDuty);
    if (has_request) draft.add_measured("requested_thrust", kRequested);
  } else if (has_request) {
    const std::string from = names_of(draft.raw, *draft.recognition.find(kRequested));
    if (!is_requested(draft)) {
      for (int k = 0; k < kFour; ++k) {
        t[kDuty + k] = std::exchange(t[kRequested + k], {});
        for (double& duty : t[kDuty + k]) duty = std::min(duty, 1.0);
      }
      draft.recognition.find(kRequested)->signal = kDuty;
      draft.add_measured("duty", kDuty);
      has_request = false;
    } else {
      draft.add_measured("requested_thrust", kRequested);
      if (t.has(kBattery)) derive_duty(draft, from);
    }
  }
  if (t.has_group(kRotorSpeed, kFour)) {
    replace_broken_rotor_speeds(draft);
    draft.add_measured("rotor_speed", kRotorSpeed);
  }
  const int commands = number_of_commands(t);
  if (t.has_group(kDuty, kFour) && t.has(kBattery)) {
    signals.thrust = ThrustSource::kDuty;
    draft.add("thrust", Source::kDerived, "duty and battery: the model's thrust map", "N");
  } else if (t.has(kThrust)) {
    signals.thrust = ThrustSource::kForce;
    draft.add("thrust", Source::kDerived,
              "commanded force " + names_of(draft.raw, *draft.recognition.find(kThrust)), "N");
  } else if (t.has_group(kMotorForce, kFour)) {
    t[kThrust].assign(t.size(), 0);
    for (int k = 0; k < kFour; ++k) {
      for (std::size_t i = 0; i < t.size(); ++i) t[kThrust][i] += t[kMotorForce + k][i];
    }
    signals.thrust = ThrustSource::kForce;
    draft.add("thrust", Source::kDerived,
              "commanded force, the sum of " + names_of(draft.raw, *draft.recognition.find(kMotorForce)),
              "N");
  } else if (t.has_group(kRotorSpeed, kFour)) {
    set_hover_multiple(draft, {kRotorSpeed, kFour, "rotor speeds"}, true, "sum of squares");
  } else if (has_request) {
    set_hover_multiple(draft, {kRequested, kFour, "requested thrust"}, false, "sum");
  } else if (t.has_group(kDuty, kFour)) {
    set_hover_multiple(draft, {kDuty, kFour, "duty (no battery voltage)"}, false, "sum");
  } else if (commands >= 3) {
    set_hover_multiple(draft, {kMotorCommand, commands, fmt::format("{} motor commands", commands)}, false,
                       "sum");
  } else if (t.has(kThrustCommand)) {
    set_hover_multiple(draft, {kThrustCommand, 1, "collective thrust command"}, false, "value");
  } else {
    draft.add("thrust", Source::kMissing, "", "N");
  }
}

}  // namespace swarmcert::logs
