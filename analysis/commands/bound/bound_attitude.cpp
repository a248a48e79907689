#include "analysis/commands/bound/bound_attitude.h"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "stability/bounds/tracking_bounds.h"

namespace swarmcert::stability {
namespace {

void describe_margins(files::Record& record, const CascadeMargins& margins) {
  record.field("gain_margin", margins.gain, "Factor by which thrust and torque can grow; null: by any.");
  record.field("least_gain", margins.low_gain, "Factor to which they can shrink; 0: to nothing.");
  record.field(
      "delay_margin_s", margins.delay_s,
      "Delay between state and motors, beside [lag], at which the loop becomes unstable; null: none.", "s");
}

void describe_cascade_gains(files::Record& record, const ResponseNorms& h, const char* unit) {
  record.field("unit", unit, "Of the amplitude.");
  record.field("amplitude", h.integral_abs, "");
  record.field("edge", h.step_max_abs, "");
  record.field("impulse", h.max_abs(), "");
}

std::string names_of_axes(const std::vector<int>& axes) {
  std::string all;
  for (const int axis : axes) all += axis_name(axis);
  return all;
}

}  // namespace

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
  std::vector<std::pair<std::string, CascadeMargins>> alone;
  for (std::size_t i = 0; i < row.alone.size(); ++i) alone.emplace_back(axis_name(row.axes[i]), row.alone[i]);
  record.may_fields(is_coupled, [&alone](files::Record& r) {
    r.list("channels", alone, "The same margins where the gain, or the delay, of one axis changes alone.",
           [](files::Record& one, const std::pair<std::string, CascadeMargins>& channel) {
             one.field("axis", channel.first, "");
             describe_margins(one, channel.second);
           });
  });
  const CascadeGains exact = row.exact.value_or(CascadeGains());
  record.object_or_null(
      row.exact.has_value(), "exact", "Worst error per unit of a disturbance; null: axes are coupled.",
      [&exact](files::Record& r) {
        const auto add = [&r](const char* of, const ResponseNorms& h, const char* unit) {
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

}  // namespace swarmcert::stability

namespace swarmcert::analysis {

using stability::AttitudeRow;
using stability::names_of_axes;

namespace {

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

}  // namespace

void declare_attitude(CLI::App& app, std::string& words) {
  app.add_option(
      "--attitude-gains", words,
      "KR,Kw,KI of the attitude law, N m, N m s, N m/s: the loop around it must be stable and clear of "
      "limit cycles (default: [attitude] of gains.toml, if present)");
}

void state_attitude_gains(const std::string& words, Tracking& input) {
  if (words.empty()) return;
  const auto [KR, Kw, KI] = read_attitude_gains(words);
  input.gains.attitude = stability::AttitudeGains{{KR, KR, KR}, {Kw, Kw, Kw}, {KI, KI, KI}};
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
