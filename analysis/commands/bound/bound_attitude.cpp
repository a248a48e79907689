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

}  // namespace

bool has_attitude_gains(const Tracking& input, const std::string& words) {
  if (!words.empty()) return true;
  return input.gains.attitude && axis_loop(input.gains, input.plant, 0) &&
         axis_loop(input.gains, input.plant, 1);
}

stability::Cascade attitude_cascade(const Tracking& input, const std::string& words, int axis) {
  // A vehicle tilts about its other horizontal axis.
  const auto about = static_cast<std::size_t>(1 - axis);
  const std::array<double, 3> gains =
      !words.empty()
          ? read_attitude_gains(words)
          : std::array<double, 3>{input.gains.attitude->KR_Nm[about], input.gains.attitude->Kw_Nm_s[about],
                                  input.gains.attitude->KI_Nm_per_s[about]};
  const std::optional<stability::AxisLoop> position = axis_loop(input.gains, input.plant, axis);
  if (!position) throw UsageError("attitude gains: Lambda or K couples the axes; make them diagonal");
  // axis_loop() has the thrust's scale in its gains already.
  const double scale = input.plant.thrust_scale;
  const double inertia = input.model.inertia_kg_m2[about];
  stability::Cascade loop{position->Kp / scale,
                          position->Kd / scale,
                          position->Ki / scale,
                          scale,
                          stability::AttitudeLoop{gains[0] / inertia, gains[1] / inertia, gains[2] / inertia},
                          input.gains.motor_lag_s,
                          input.gains.body_rate_lag_s};
  if (const auto sampled = sampled_axis_loop(input.gains, input.plant, axis))
    loop.Ki = effective_Ki(*sampled) / scale;
  return loop;
}

files::Json attitude_json(const Tracking& input, const std::string& words) {
  files::Json rows = files::Json::array();
  for (int axis = 0; axis < 2; ++axis) {
    const stability::Cascade loop = attitude_cascade(input, words, axis);
    stability::CascadeMargins margins = cascade_margins(loop);
    // The delay of gains.toml uses up the margin.
    margins.delay_s = std::max(0.0, margins.delay_s - input.gains.delay_s);
    if (margins.delay_s == 0) margins = {};
    rows.push_back({{"axis", stability::axis_name(axis)},
                    {"stable", margins.gain > 0},
                    {"verdict", name(nearness_to_limit_cycle(margins))},
                    {"gain_margin", finite(margins.gain)},
                    {"least_gain", finite(margins.low_gain)},
                    {"delay_margin_s", finite(margins.delay_s)},
                    {"damping", margins.damping},
                    {"frequency_rad_s", margins.frequency_rad_s},
                    {"exact",
                     {{"force", gains_json(loop, CascadeInput::kAcceleration, "m per m/s^2")},
                      {"velocity_error", gains_json(loop, CascadeInput::kVelocityError, "m per m/s")},
                      {"torque", gains_json(loop, CascadeInput::kAngularAcceleration, "m per rad/s^2")}}}});
  }
  return rows;
}

void print_attitude(const files::Json& attitude) {
  fmt::print("\nAround the attitude loop, linear; gain margin: factor that destabilises\n");
  for (const files::Json& row : attitude) {
    const auto number = [&row](const char* key, const char* format) {
      return row[key].is_number() ? fmt::format(fmt::runtime(format), row[key].get<double>())
                                  : std::string("any");
    };
    fmt::print("  {} {:<24} gain margin {}, delay margin {} s, least damping {} at {} rad/s\n",
               row["axis"].get<std::string>(), row["verdict"].get<std::string>(),
               number("gain_margin", "{:.3g}"), number("delay_margin_s", "{:.3g}"),
               number("damping", "{:.3g}"), number("frequency_rad_s", "{:.3g}"));
  }
}

}  // namespace swarmcert::analysis
