#include "stability/bounds/around_attitude.h"

#include <algorithm>
#include <cmath>

#include "stability/bounds/saturation.h"

namespace swarmcert::stability {
namespace {

/// Subtracts the delay of gains.toml from the delay margin. If the delay uses up the whole margin, the loop is
/// unstable.
CascadeMargins left_by_delay(CascadeMargins margins, const FlownLoop& loop) {
  margins.delay_s = std::max(0.0, margins.delay_s - loop.gains.delay_s);
  return margins.delay_s == 0 ? CascadeMargins{} : margins;
}

AttitudeRow decoupled_row(const FlownLoop& loop, const Cascade& cascade, int axis) {
  const auto gains = [&cascade](CascadeInput of) { return response_norms(cascade_transfer(cascade, of)); };
  AttitudeRow row;
  row.axes = {axis};
  row.margins = left_by_delay(cascade_margins(cascade), loop);
  row.nearness = nearness_to_limit_cycle(row.margins);
  row.exact = CascadeGains{gains(CascadeInput::kAcceleration), gains(CascadeInput::kVelocityError),
                           gains(CascadeInput::kAngularAcceleration)};
  return row;
}

AttitudeRow coupled_row(const FlownLoop& loop, const std::vector<int>& axes) {
  CoupledMargins margins = coupled_margins(loop.coupled_cascade(axes));
  margins.together = left_by_delay(margins.together, loop);
  for (CascadeMargins& alone : margins.alone) {
    // If the delay of all motors makes the loop unstable, no channel has a margin left.
    alone = margins.together.gain > 0 ? left_by_delay(alone, loop) : CascadeMargins{};
  }
  return {axes, margins.together, nearness_to_limit_cycle(margins), std::nullopt, margins.alone};
}

}  // namespace

std::vector<AttitudeRow> attitude_rows(const FlownLoop& loop) {
  std::vector<AttitudeRow> rows;
  for (int axis = 0; axis < 2; ++axis) {
    if (const std::optional<Cascade> cascade = loop.cascade(axis))
      rows.push_back(decoupled_row(loop, *cascade, axis));
  }
  const std::vector<int> coupled = loop.coupled_axes();
  if (!coupled.empty()) rows.push_back(coupled_row(loop, coupled));
  return rows;
}

namespace {

/// Gains of x or y around the attitude loop, of the loop that flies.
GainNorms norms_around(const FlownLoop& loop, const Cascade& cascade, int axis) {
  if (const std::optional<SampledLoop> sampled = loop.sampled_cascade(axis))
    return sampled_norms(*sampled, Channel::kForce, Instants::kAll);
  const ResponseNorms h = response_norms(cascade_transfer(cascade, CascadeInput::kAcceleration));
  const double mass_kg = loop.plant.mass_kg;
  return {0, h.integral_abs / mass_kg, h.step_max_abs / mass_kg, h.max_abs() / mass_kg};
}

GainNorms norms_with_lag(const FlownLoop& loop, int axis) {
  if (loop.is_sampled()) return sampled_norms(*loop.sampled(axis), Channel::kForce, Instants::kAll);
  AxisLoop lagged = *loop.continuous(axis);
  lagged.delay_s = 0;  // as in the cascade
  return continuous_norms(lagged, Channel::kForce);
}

/// Gains around the attitude loop, of both horizontal axes; empty without one.
std::vector<GainNorms> norms_around(const FlownLoop& loop) {
  std::vector<GainNorms> norms;
  for (int axis = 0; axis < 2; ++axis)
    if (const std::optional<Cascade> cascade = loop.cascade(axis))
      norms.push_back(norms_around(loop, *cascade, axis));
  return norms.size() == 2 ? norms : std::vector<GainNorms>();
}

double largest_ratio(const std::vector<GainNorms>& around, const FlownLoop& loop) {
  double largest = 0;
  for (int axis = 0; axis < 2; ++axis) {
    const GainNorms with_lag = norms_with_lag(loop, axis);
    for (const auto gain : {&GainNorms::amplitude, &GainNorms::edge, &GainNorms::impulse})
      largest = std::max(largest, around[static_cast<std::size_t>(axis)].*gain / with_lag.*gain);
  }
  return largest;
}

}  // namespace

std::optional<double> gain_beyond_lag(const FlownLoop& loop) {
  const std::vector<GainNorms> around = norms_around(loop);
  if (around.empty()) return std::nullopt;
  const double ratio = largest_ratio(around, loop);
  return std::isfinite(ratio) && ratio > 0 ? std::optional<double>(ratio) : std::nullopt;
}

std::string attitude_objection(const FlownLoop& loop) {
  if (!loop.gains.attitude) return "";
  if (loop.diverges_around_attitude()) return "the loop around that of [attitude] diverges";
  const std::optional<double> beyond = gain_beyond_lag(loop);
  if (!beyond || *beyond <= 1) return "";
  return "around the loop of [attitude] a gain of x or y is " + decimals(*beyond) + " times as large";
}

std::optional<double> lag_that_contains_attitude_s(FlownLoop loop) {
  constexpr double kShortest_s = 1e-3, kLongest_s = 1, kStep = 1.1;
  const std::vector<GainNorms> around = norms_around(loop);
  for (double lag_s = kShortest_s; !around.empty() && lag_s <= kLongest_s; lag_s *= kStep) {
    loop.gains.attitude_lag_s = lag_s;
    const double ratio = largest_ratio(around, loop);
    if (ratio > 0 && ratio <= 1) return lag_s;
  }
  return std::nullopt;
}

}  // namespace swarmcert::stability
