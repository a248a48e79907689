#include "analysis/commands/bound/verified.h"

#include <fmt/core.h>

#include <cmath>

#include "analysis/tracking/tube/error_loops.h"
#include "stability/bounds/enclosures/verified_sampled_norms.h"

namespace swarmcert::analysis {
namespace {

using namespace stability;  // NOLINT: every name below is of that library

void describe_enclosures(files::Record& record, const VerifiedNorms& norms) {
  const auto add = [&record](const char* name, const Interval& enclosure, const char* unit) {
    record.field(name, enclosure, "Contains the exact value; null: not bounded.", unit, "enclosure");
  };
  add("rate", norms.rate, "m per N/s");
  add("amplitude", norms.amplitude, "m/N");
  add("edge", norms.edge, "m/N");
  add("impulse", norms.impulse, "m per N s");
}

constexpr char kNotVerified[] = "stability could not be verified in intervals";

/// @param input a channel of the force error, or an estimate.
template <class Input>
void add_verified_rows(const AxisLoop& loop, const std::optional<SampledLoop>& sampled, int axis, Input input,
                       VerifiedGains& rows) {
  VerifiedRow row;
  row.axis = axis;
  row.input = name(input);
  row.norms = verified_norms(loop, input);
  if (row.norms && loop.delay_s > 0) row.delay_gain = row.norms->delay_gain;
  if (!row.norms)
    row.why = is_stable(loop)    ? kNotVerified
              : loop.delay_s > 0 ? "the loop is unstable: a shorter delay or lower gains would be needed"
                                 : "the loop is unstable";
  rows.push_back(row);
  if (!sampled) return;
  row = {axis, name(input), Loop::kSampled, {}, {}, {}, kNotVerified};
  if (const auto held = verified_sampled_norms(*sampled, input)) {
    row.norms = held->at_samples;
    row.between_samples = held->all_times;
    row.why.clear();
  }
  rows.push_back(row);
}

}  // namespace

void describe(files::Record& record, const VerifiedRow& row) {
  const bool is_proved = row.norms.has_value();
  record.field("axis", axis_name(row.axis), "");
  record.field("channel", row.input, "force, command, velocity or position: where the disturbance enters.");
  record.field("loop", name(row.loop), "continuous or sampled.");
  record.field("status", is_proved ? "proved" : "inconclusive", "");
  record.may_fields(
      is_proved, [&row](files::Record& r) { describe_enclosures(r, row.norms.value_or(VerifiedNorms())); });
  record.may_object(
      row.between_samples.has_value(), "between_samples", "The same at all times.",
      [&row](files::Record& r) { describe_enclosures(r, row.between_samples.value_or(VerifiedNorms())); });
  record.may("delay_gain", row.delay_gain, "With a delay, about half the relative width.");
  record.may("why", is_proved ? std::nullopt : std::optional(row.why), "Why nothing was proved.");
}

VerifiedGains verified_gains(const Tracking& input) {
  VerifiedGains rows, of_estimates;
  std::optional<AxisLoop> last;
  const auto repeat = [](VerifiedGains& of_all, std::size_t count, int axis) {
    for (std::size_t i = 0; i < count; ++i) {
      VerifiedRow row = of_all[of_all.size() - count];
      row.axis = axis;
      of_all.push_back(row);
    }
  };
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<AxisLoop> loop = input.continuous(axis);
    if (!loop) continue;
    const std::optional<SampledLoop> sampled = input.sampled(axis);
    if (last && same_gains_and_lags(*loop, *last)) {
      for (VerifiedGains* const repeated : {&rows, &of_estimates}) repeat(*repeated, sampled ? 4 : 2, axis);
      continue;
    }
    last = loop;
    for (const Channel channel : {Channel::kForce, Channel::kCommand})
      add_verified_rows(*loop, sampled, axis, channel, rows);
    for (const Estimate estimate : {Estimate::kVelocity, Estimate::kPosition})
      add_verified_rows(*loop, sampled, axis, estimate, of_estimates);
  }
  rows.insert(rows.end(), of_estimates.begin(), of_estimates.end());
  return rows;
}

void print(const VerifiedGains& verified) {
  fmt::print("\nVerified enclosures of the gains\n");
  for (const VerifiedRow& row : verified) {
    fmt::print("  {} {:<8} {:<10} ", axis_name(row.axis), row.input, name(row.loop));
    if (!row.norms) {
      fmt::print("inconclusive: {}\n", row.why);
      continue;
    }
    const auto text = [](const char* key, const Interval& x) {
      return std::isfinite(x.lower) ? fmt::format("{} [{:.13g}, {:.13g}]", key, x.lower, x.upper)
                                    : fmt::format("{} unbounded", key);
    };
    const VerifiedNorms& norms = *row.norms;
    fmt::print("{}  {}\n                        {}  {}\n", text("rate", norms.rate),
               text("amplitude", norms.amplitude), text("edge", norms.edge), text("impulse", norms.impulse));
    if (row.delay_gain)
      fmt::print("{:24}the delay alone makes them {:.2g} % wide\n", "", 200 * *row.delay_gain);
  }
}

}  // namespace swarmcert::analysis
