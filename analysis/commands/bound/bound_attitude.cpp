#include "analysis/commands/bound/bound_attitude.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "analysis/commands/bound/bound_output.h"

namespace swarmcert::analysis {
namespace {

using stability::CascadeInput;

std::array<double, 3> read_attitude_gains(const std::string& words) {
  std::array<double, 3> gains{};
  const char* at = words.c_str();
  for (std::size_t k = 0; k < 3; ++k) {
    char* end = nullptr;
    gains[k] = std::strtod(at, &end);
    const bool ends_well = *end == (k < 2 ? ',' : '\0');
    if (end == at || !ends_well || !std::isfinite(gains[k]) || gains[k] < 0 || (k < 2 && gains[k] == 0)) {
      throw UsageError(
          "--attitude-gains " + words +
          ": write KR,Kw,KI in N m, N m s and N m/s, e.g. 0.007,0.00115,0.03; KR and Kw positive");
    }
    at = end + 1;
  }
  return gains;
}

files::Json gains_json(const stability::Cascade& loop, CascadeInput input, const char* unit) {
  const stability::ResponseNorms h = response_norms(cascade_transfer(loop, input));
  return {{"unit", unit},
          {"amplitude", finite(h.integral_abs)},
          {"edge", finite(h.step_max_abs)},
          {"impulse", finite(h.max_abs())}};
}

/// Axes that Lambda or K couples to other axes.
std::vector<int> coupled_axes(const Tracking& input) {
  std::vector<int> result;
  for (int axis = 0; axis < 3; ++axis)
    if (!input.continuous(axis)) result.push_back(axis);
  return result;
}

/// The lags, the thrust ratio and, for x and y, the attitude law of an axis, without its position gains.
stability::Cascade without_position(const Tracking& input, const std::string& words, int axis) {
  stability::Cascade loop;
  loop.ratio = input.plant.thrust_scale;
  loop.lag_s = input.gains.motor_lag_s;
  if (axis == 2) return loop;
  // The vehicle tilts about its other horizontal axis.
  const auto about = static_cast<std::size_t>(1 - axis);
  const std::array<double, 3> gains =
      !words.empty()
          ? read_attitude_gains(words)
          : std::array<double, 3>{input.gains.attitude->KR_Nm[about], input.gains.attitude->Kw_Nm_s[about],
                                  input.gains.attitude->KI_Nm_per_s[about]};
  const double inertia = input.model.inertia_kg_m2[about];
  loop.attitude = stability::AttitudeLoop{gains[0] / inertia, gains[1] / inertia, gains[2] / inertia};
  loop.body_rate_lag_s = input.gains.body_rate_lag_s;
  return loop;
}

/// Subtracts the delay of gains.toml from the delay margin. If the delay uses up the whole margin, the loop is
/// unstable.
stability::CascadeMargins left_by_delay(stability::CascadeMargins margins, const Tracking& input) {
  margins.delay_s = std::max(0.0, margins.delay_s - input.gains.delay_s);
  return margins.delay_s == 0 ? stability::CascadeMargins{} : margins;
}

files::Json margins_json(const stability::CascadeMargins& margins) {
  return {{"gain_margin", finite(margins.gain)},
          {"least_gain", finite(margins.low_gain)},
          {"delay_margin_s", finite(margins.delay_s)}};
}

files::Json axis_json(const Tracking& input, const std::string& words, int axis) {
  const stability::Cascade loop = attitude_cascade(input, words, axis);
  const stability::CascadeMargins margins = left_by_delay(cascade_margins(loop), input);
  files::Json row = margins_json(margins);
  row.update({{"axis", stability::axis_name(axis)},
              {"stable", margins.gain > 0},
              {"verdict", name(nearness_to_limit_cycle(margins))},
              {"damping", margins.damping},
              {"frequency_rad_s", margins.frequency_rad_s},
              {"exact",
               {{"force", gains_json(loop, CascadeInput::kAcceleration, "m per m/s^2")},
                {"velocity_error", gains_json(loop, CascadeInput::kVelocityError, "m per m/s")},
                {"torque", gains_json(loop, CascadeInput::kAngularAcceleration, "m per rad/s^2")}}}});
  return row;
}

files::Json coupled_json(const Tracking& input, const std::string& words, const std::vector<int>& axes) {
  const stability::CoupledCascade loop = coupled_attitude_cascade(input, words, axes);
  stability::CoupledMargins margins = coupled_margins(loop);
  margins.together = left_by_delay(margins.together, input);
  std::string all;
  files::Json channels = files::Json::array();
  for (std::size_t i = 0; i < axes.size(); ++i) {
    // If the delay of all motors makes the loop unstable, no channel has a margin left.
    stability::CascadeMargins& alone = margins.alone[i];
    alone = margins.together.gain > 0 ? left_by_delay(alone, input) : stability::CascadeMargins{};
    all += stability::axis_name(axes[i]);
    files::Json channel = margins_json(alone);
    channel["axis"] = stability::axis_name(axes[i]);
    channels.push_back(std::move(channel));
  }
  files::Json row = margins_json(margins.together);
  row.update({{"axis", all},
              {"stable", margins.together.gain > 0},
              {"verdict", name(nearness_to_limit_cycle(margins))},
              {"damping", margins.together.damping},
              {"frequency_rad_s", margins.together.frequency_rad_s},
              {"channels", std::move(channels)},
              {"exact", nullptr},
              {"why_no_exact",
               "a disturbance along one coupled axis moves the others: the gain of one axis alone does "
               "not bound its error"}});
  return row;
}

}  // namespace

bool has_attitude_gains(const Tracking& input, const std::string& words) {
  return !words.empty() || input.gains.attitude.has_value();
}

stability::Cascade attitude_cascade(const Tracking& input, const std::string& words, int axis) {
  const std::optional<stability::AxisLoop> position = input.continuous(axis);
  if (!position) throw UsageError("attitude gains: Lambda or K couples the axes; make them diagonal");
  stability::Cascade loop = without_position(input, words, axis);
  // The gains of the loop already contain the thrust scale.
  loop.Kp = position->Kp / loop.ratio;
  loop.Kd = position->Kd / loop.ratio;
  loop.Ki = position->Ki / loop.ratio;
  return loop;
}

stability::CoupledCascade coupled_attitude_cascade(const Tracking& input, const std::string& words,
                                                   const std::vector<int>& axes) {
  stability::CoupledCascade loop;
  const stability::PidMatrices all = stability::pid_matrices(*input.gains.composite, input.plant.mass_kg);
  loop.position = {all.Kp(axes, axes), all.Kd(axes, axes), all.Ki(axes, axes)};
  loop.position.Ki *= input.integral_share();
  for (const int axis : axes) loop.channels.push_back(without_position(input, words, axis));
  return loop;
}

files::Json attitude_json(const Tracking& input, const std::string& words) {
  files::Json rows = files::Json::array();
  const std::vector<int> coupled = coupled_axes(input);
  for (int axis = 0; axis < 2; ++axis)
    if (input.continuous(axis)) rows.push_back(axis_json(input, words, axis));
  if (!coupled.empty()) rows.push_back(coupled_json(input, words, coupled));
  return rows;
}

void print_attitude(const files::Json& attitude) {
  fmt::print("\nAround the attitude loop, linear; gain margin: factor that destabilises\n");
  const auto number = [](const files::Json& row, const char* key, const char* format) {
    return row[key].is_number() ? fmt::format(fmt::runtime(format), row[key].get<double>())
                                : std::string("any");
  };
  for (const files::Json& row : attitude) {
    fmt::print("  {} {:<24} gain margin {}, delay margin {} s, least damping {} at {} rad/s\n",
               row["axis"].get<std::string>(), row["verdict"].get<std::string>(),
               number(row, "gain_margin", "{:.3g}"), number(row, "delay_margin_s", "{:.3g}"),
               number(row, "damping", "{:.3g}"), number(row, "frequency_rad_s", "{:.3g}"));
    if (!row.contains("channels")) continue;
    fmt::print("    as one loop with all motors; margins of each axis alone:\n");
    for (const files::Json& channel : row["channels"]) {
      fmt::print("    {} gain margin {}, delay margin {} s\n", channel["axis"].get<std::string>(),
                 number(channel, "gain_margin", "{:.3g}"), number(channel, "delay_margin_s", "{:.3g}"));
    }
  }
}

}  // namespace swarmcert::analysis
