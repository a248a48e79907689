#include "analysis/commands/bound/bound_attitude.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "stability/bounds/tracking_bounds.h"

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

AttitudeRow decoupled_row(const Tracking& input, const std::string& words, int axis) {
  const stability::Cascade loop = attitude_cascade(input, words, axis);
  const auto gains = [&loop](CascadeInput of) { return response_norms(cascade_transfer(loop, of)); };
  AttitudeRow row;
  row.axes = {axis};
  row.margins = left_by_delay(cascade_margins(loop), input);
  row.nearness = nearness_to_limit_cycle(row.margins);
  row.exact = CascadeGains{gains(CascadeInput::kAcceleration), gains(CascadeInput::kVelocityError),
                           gains(CascadeInput::kAngularAcceleration)};
  return row;
}

AttitudeRow coupled_row(const Tracking& input, const std::string& words, const std::vector<int>& axes) {
  stability::CoupledMargins margins = coupled_margins(coupled_attitude_cascade(input, words, axes));
  margins.together = left_by_delay(margins.together, input);
  for (stability::CascadeMargins& alone : margins.alone) {
    // If the delay of all motors makes the loop unstable, no channel has a margin left.
    alone = margins.together.gain > 0 ? left_by_delay(alone, input) : stability::CascadeMargins{};
  }
  return {axes, margins.together, nearness_to_limit_cycle(margins), std::nullopt, margins.alone};
}

void describe_margins(files::Record& record, const stability::CascadeMargins& margins) {
  record.field("gain_margin", margins.gain, "Factor by which thrust and torque can grow; null: by any.");
  record.field("least_gain", margins.low_gain, "Factor to which they can shrink; 0: to nothing.");
  record.field(
      "delay_margin_s", margins.delay_s,
      "Delay between state and motors, beside [lag], at which the loop becomes unstable; null: none.", "s");
}

void describe_cascade_gains(files::Record& record, const stability::ResponseNorms& h, const char* unit) {
  record.field("unit", unit, "Of the amplitude.");
  record.field("amplitude", h.integral_abs, "");
  record.field("edge", h.step_max_abs, "");
  record.field("impulse", h.max_abs(), "");
}

std::string names_of_axes(const std::vector<int>& axes) {
  std::string all;
  for (const int axis : axes) all += stability::axis_name(axis);
  return all;
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

void describe(files::Record& record, const AttitudeRow& row) {
  const bool is_coupled = row.axes.size() > 1;
  describe_margins(record, row.margins);
  record.field("axis", names_of_axes(row.axes),
               "One axis, or all that Lambda or K couples, as one loop: \"xy\".");
  record.field("stable", row.margins.gain > 0, "");
  record.field("verdict", name(row.nearness),
               "clear, close to a limit cycle, or unstable: by the smallest gain margin of the row.");
  record.field("damping", row.margins.damping, "Of the least damped pair of poles.");
  record.field("frequency_rad_s", row.margins.frequency_rad_s, "Of the same.", "rad/s");
  std::vector<std::pair<std::string, stability::CascadeMargins>> alone;
  for (std::size_t i = 0; i < row.alone.size(); ++i)
    alone.emplace_back(stability::axis_name(row.axes[i]), row.alone[i]);
  record.may_fields(is_coupled, [&alone](files::Record& r) {
    r.list("channels", alone, "The same margins where the gain, or the delay, of one axis changes alone.",
           [](files::Record& one, const std::pair<std::string, stability::CascadeMargins>& channel) {
             one.field("axis", channel.first, "");
             describe_margins(one, channel.second);
           });
  });
  const CascadeGains exact = row.exact.value_or(CascadeGains());
  record.object_or_null(
      row.exact.has_value(), "exact", "Worst error per unit of a disturbance; null: axes are coupled.",
      [&exact](files::Record& r) {
        const auto add = [&r](const char* of, const stability::ResponseNorms& h, const char* unit) {
          r.object(of, "", [&](files::Record& one) { describe_cascade_gains(one, h, unit); });
        };
        add("force", exact.force, "m per m/s^2");
        add("velocity_error", exact.velocity_error, "m per m/s");
        add("torque", exact.torque, "m per rad/s^2");
      });
  constexpr char kWhyNot[] =
      "a disturbance along one coupled axis moves the others: the gain of one axis alone does not bound its "
      "error";
  record.may("why_no_exact", is_coupled ? std::optional<std::string>(kWhyNot) : std::nullopt, "");
}

std::vector<AttitudeRow> attitude_rows(const Tracking& input, const std::string& words) {
  std::vector<AttitudeRow> rows;
  const std::vector<int> coupled = coupled_axes(input);
  for (int axis = 0; axis < 2; ++axis)
    if (input.continuous(axis)) rows.push_back(decoupled_row(input, words, axis));
  if (!coupled.empty()) rows.push_back(coupled_row(input, words, coupled));
  return rows;
}

void print(const std::vector<AttitudeRow>& attitude) {
  fmt::print("\nAround the attitude loop, linear; gain margin: factor that destabilises\n");
  const auto number = [](double x) {
    return std::isfinite(x) ? fmt::format("{:.3g}", x) : std::string("any");
  };
  for (const AttitudeRow& row : attitude) {
    const stability::CascadeMargins& m = row.margins;
    fmt::print("  {} {:<24} gain margin {}, delay margin {} s, least damping {} at {} rad/s\n",
               names_of_axes(row.axes), name(row.nearness), number(m.gain), number(m.delay_s),
               number(m.damping), number(m.frequency_rad_s));
    if (row.alone.empty()) continue;
    fmt::print("    as one loop with all motors; margins of each axis alone:\n");
    for (std::size_t i = 0; i < row.alone.size(); ++i)
      fmt::print("    {} gain margin {}, delay margin {} s\n", stability::axis_name(row.axes[i]),
                 number(row.alone[i].gain), number(row.alone[i].delay_s));
  }
}

}  // namespace swarmcert::analysis
