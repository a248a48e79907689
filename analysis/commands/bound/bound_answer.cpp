#include "analysis/commands/bound/bound_answer.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "analysis/commands/bound/bound_output.h"
#include "stability/bounds/around_attitude.h"

namespace swarmcert::analysis {
namespace {

using namespace stability;  // NOLINT: every name below is of that library

/// Largest total of an axis in the loop that flies, over the channels by which a force error may enter.
std::optional<double> largest_error_m(const Tracking& input, const TrackingReport& report, int axis) {
  std::optional<double> result;
  for (const AxisBounds& row : report.bounds) {
    if (row.axis != axis || (row.loop == Loop::kSampled) != input.is_sampled()) continue;
    result = std::max(result.value_or(0), row.total_m());
  }
  return result;
}

/// Returns the largest amplitude of the force error, the same on all axes, for which the thrust provably never
/// saturates; 0 if there is none.
double proved_amplitude_N(const Tracking& input, DisturbanceSource source, const InitialError& initial) {
  const auto is_proved = [&](double amplitude_N) {
    for (Disturbance& d : source.axis) d.amplitude_N = amplitude_N;
    return thrust_demand(input, source, initial).is_proved();
  };
  double low_N = 0, high_N = input.thrust_range_N().upper;
  if (!std::isfinite(high_N) || !is_proved(0)) return 0;
  for (int i = 0; i < 12; ++i) {
    const double middle_N = (low_N + high_N) / 2;
    (is_proved(middle_N) ? low_N : high_N) = middle_N;
  }
  return low_N;
}

std::string why_divergent(const Tracking& input) {
  const double radius = input.is_sampled() ? input.spectral_radius() : 0;
  if (radius >= 1)
    return fmt::format("the loop diverges: spectral radius {:.4g} at {:g} Hz", radius, input.gains.rate_hz);
  return input.gains.attitude ? "the loop around that of [attitude] diverges" : "the loop diverges";
}

void add_limits(const Tracking& input, const TrackingReport& report, BoundAnswer& answer) {
  if (report.is_stable == false) {
    answer.limits.push_back(why_divergent(input));
    return;
  }
  const Saturation& thrust = report.saturation;
  if (!thrust.is_proved()) answer.limits.push_back(thrust.why);
  if (std::isfinite(thrust.most_N)) {
    answer.limits.push_back(
        fmt::format("thrust: {:.3g} to {:.3g} N commanded at most, {:.3g} to {:.3g} N available",
                    thrust.least_N, thrust.most_N, thrust.available_N.lower, thrust.available_N.upper));
  }
  std::vector<std::string> clamped;
  for (int axis = 0; axis < 3; ++axis) {
    const auto may_act = [axis](const AxisBounds& row) { return row.axis == axis && !row.clamp.never_acts; };
    if (std::any_of(report.bounds.begin(), report.bounds.end(), may_act))
      clamped.emplace_back(axis_name(axis));
  }
  if (!clamped.empty())
    answer.limits.push_back(fmt::format("the integrator's clamp may act: {}", fmt::join(clamped, ", ")));
  const auto least =
      std::min_element(report.facts.begin(), report.facts.end(),
                       [](const auto& a, const auto& b) { return a.lag_limit_s < b.lag_limit_s; });
  if (least != report.facts.end() && std::isfinite(least->lag_limit_s))
    answer.limits.push_back(
        fmt::format("axis {} tolerates {:.3g} s more lag", axis_name(least->axis), least->lag_limit_s));
}

std::string change_of(const Tracking& input, const DisturbanceSource& source, const InitialError& initial,
                      const TrackingReport& report) {
  if (report.is_stable == false)
    return input.is_sampled() ? "raise rate_hz, or lower the gains" : "lower the gains";
  if (source.kind == "rate of f_hat") return "state the learning error: --amplitude, --from or --truth";
  if (report.saturation.is_proved() || report.facts.size() < 3) return "";
  if (!attitude_objection(input).empty()) {
    const std::optional<double> lag_s = lag_that_contains_attitude_s(input);
    return lag_s ? fmt::format("[lag] attitude_s = {:.4g} contains the loop of [attitude]", *lag_s) : "";
  }
  const double amplitude_N = proved_amplitude_N(input, source, initial);
  if (!(amplitude_N > 0)) return "leave more thrust: the other declared inputs alone take it all";
  return fmt::format("for force errors up to --amplitude {:.3g} the thrust provably suffices", amplitude_N);
}

}  // namespace

BoundAnswer bound_answer(const Tracking& input, const DisturbanceSource& source, const InitialError& initial,
                         const TrackingReport& report) {
  BoundAnswer answer;
  for (const Assumption& one : report.assumptions)
    if (one.name != kContinuousLoop || !input.is_sampled()) answer.conditions.push_back(one);
  add_limits(input, report, answer);
  answer.change = change_of(input, source, initial, report);
  const Saturation::Verdict thrust = report.saturation.verdict;
  if (report.is_stable == false || thrust == Saturation::Verdict::kRefuted) {
    answer.flies = false;
    return answer;
  }
  bool has_all = report.is_stable.has_value() && thrust == Saturation::Verdict::kProved;
  for (int axis = 0; axis < 3 && source.kind != "none"; ++axis) {
    const std::optional<double> error_m = largest_error_m(input, report, axis);
    if (source.bounds_learning_error() && error_m && std::isfinite(*error_m)) {
      answer.error_m[axis] = error_m;
    } else {
      has_all = false;
    }
  }
  if (has_all) answer.flies = true;
  return answer;
}

void describe(files::Record& record, const BoundAnswer& answer) {
  record.field(
      "flies", answer.flies,
      "True: the loop is stable and every condition is proved or declared. False: it diverges, or a declared "
      "input breaks a condition. Null: undecided.");
  record.object("error_m", "Largest error for all that was declared, per axis; null: no bound.",
                [&answer](files::Record& r) {
                  for (int axis = 0; axis < 3; ++axis)
                    r.field(axis_name(axis), answer.error_m[axis], "", "m", "upper bound");
                });
  record.field("conditions", answer.conditions, "What the answer rests on.");
  record.field("limits", answer.limits, "What limits the loop or the answer, with numbers.");
  record.field("change", answer.change, "What would change the answer; empty: nothing.");
}

void print_answer(const Tracking& input, const BoundAnswer& answer) {
  fmt::print("{}: {} on {} ({} kg)\n",
             !answer.flies   ? "UNDECIDED"
             : *answer.flies ? "FLIES"
                             : "DOES NOT FLY",
             input.gains.path, input.model.path, input.plant.mass_kg);
  std::vector<std::string> errors;
  for (int axis = 0; axis < 3; ++axis) {
    if (answer.error_m[axis])
      errors.push_back(fmt::format("{} {:.4g} m", axis_name(axis), *answer.error_m[axis]));
  }
  if (!errors.empty()) {
    fmt::print("error at most {}{}\n", fmt::join(errors, ", "),
               answer.flies ? ", for all that is declared" : ", if the conditions that are not proved hold");
  }
  std::vector<std::string> conditions;
  for (const Assumption& condition : answer.conditions)
    conditions.push_back(fmt::format("{} ({})", condition.name, condition.status));
  fmt::print("rests on: {}; all that is known: --details\n", fmt::join(conditions, "; "));
  if (!answer.limits.empty()) fmt::print("limited by: {}\n", fmt::join(answer.limits, "; "));
  if (!answer.change.empty()) fmt::print("to change it: {}\n", answer.change);
}

int exit_code(const BoundAnswer& answer) {
  return !answer.flies ? kInconclusive : *answer.flies ? kDone : kViolated;
}

}  // namespace swarmcert::analysis
