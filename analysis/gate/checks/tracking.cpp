#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/gate/checks/checks.h"
#include "analysis/gate/checks/disturbance.h"
#include "analysis/gate/plant_box.h"
#include "analysis/residuals/comparison.h"
#include "analysis/residuals/flight_peaks.h"
#include "analysis/tracking/kept_promise.h"
#include "analysis/tracking/usual_uncertainty.h"
#include "nn/base/file_keys.h"
#include "nn/base/toml.h"

namespace swarmcert::gate {
namespace {

const std::vector<std::string> kGuardQuantiles = {"p50", "p95", "max"}, kOver = {"box", "corners"};

/// Uncertain parameters: an interval if stated, otherwise the default about model and gains.
struct Uncertainty {
  std::optional<Interval> mass_kg, thrust_scale, lag_s, delay_s;
};

/// The set on which the bound must hold for the check to pass.
enum class Over { kBox, kCorners };

struct Guard {
  std::optional<double> declared;
  std::string quantile = "p95";
};

std::optional<Interval> interval(const files::TomlTable& table, const char* key, bool is_positive) {
  if (!table.has(key)) return std::nullopt;
  const std::vector<double> ends = table.numbers(key);
  if (ends.size() != 2 || !(ends[0] <= ends[1]) || !(is_positive ? ends[0] > 0 : ends[0] >= 0))
    table.refuse(key, "",
                 is_positive ? "must be two positive numbers, from and to"
                             : "must be two numbers from 0 on, from and to");
  return Interval{ends[0], ends[1]};
}

void describe_uncertainty(files::Keys& keys) {
  keys.may<Interval>("mass_kg", "", "kg");
  keys.may<Interval>("thrust_scale", "Actual over commanded thrust.");
  keys.may<Interval>("lag_s", "Of the motors.", "s");
  keys.may<Interval>("delay_s", "Of the command.", "s");
}

Uncertainty read_uncertainty(const files::TomlTable& table) {
  if (!table.has("uncertainty")) return {};
  const files::TomlTable inner = table.table("uncertainty");
  inner.allow_only(files::key_names(describe_uncertainty));
  return {interval(inner, "mass_kg", true), interval(inner, "thrust_scale", true),
          interval(inner, "lag_s", false), interval(inner, "delay_s", false)};
}

stability::UncertainPlant box_of(const stability::FlownLoop& setup, const Uncertainty& stated) {
  const stability::UncertainPlant usual = analysis::usual_uncertainty(setup.gains, setup.plant);
  return {stated.mass_kg.value_or(usual.mass_kg), stated.thrust_scale.value_or(usual.thrust_scale),
          stated.lag_s.value_or(usual.lag_s), stated.delay_s.value_or(usual.delay_s)};
}

/// Ratio by which measured peaks exceed those of the loop driven by the measured residual; at least 1.
double guard_factor(Evidence& evidence, const Guard& guard, int axis) {
  if (guard.declared) return *guard.declared;
  const residuals::Trajectories& flown = evidence.comparison().trajectories;
  if (flown.peak_ratio.tracks == 0)
    throw Unfounded("no guard factor: no track of the reference flights could be flown again" +
                    (flown.refused.empty() ? std::string() : ": " + flown.refused));
  if (flown.diverged > 0)
    throw Unfounded(
        fmt::format("no guard factor: {} tracks diverge when they are flown again", flown.diverged));
  const residuals::Axes& ratio = guard.quantile == "p50"   ? flown.peak_ratio.p50
                                 : guard.quantile == "p95" ? flown.peak_ratio.p95
                                                           : flown.peak_ratio.max;
  const double value = axis == 0 ? ratio.x : axis == 1 ? ratio.y : ratio.z;
  return std::isnan(value) ? value : std::max(1.0, value);
}

void judge_tracking(Evidence& evidence, const DisturbanceTable& declared, const EstimateTable& estimates,
                    const Uncertainty& uncertainty, const Guard& guard, Over over, const Limit& limit,
                    Checks& checks) {
  const stability::FlownLoop& setup = evidence.tracking();
  stability::DisturbanceSource source = disturbance(declared, evidence);
  add_estimates(estimates, declared, evidence, source);
  const BoxBound bound = bound_over(setup, box_of(setup, uncertainty), source);
  Check check = row("tracking", limit);
  double proved = 0, attained = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double factor = guard_factor(evidence, guard, axis);
    const double reached = bound.reached_m[axis] * factor;
    const double value = bound.is_enclosed ? bound.enclosed_m[axis] * factor : reached;
    if (!(value <= proved)) proved = value;
    if (!std::isnan(proved) && !(reached <= attained)) {
      attained = reached;
      check.witness = fmt::format(
          "axis {}: {}; guard factor {:.4g}; force error {}; {}", stability::axis_name(axis),
          bound.where[axis], factor, words(source, axis),
          bound.is_enclosed ? "enclosed over the box" : "at the corners of the box, not enclosed");
    }
    if (std::isnan(proved)) break;
  }
  if (std::isnan(proved)) {
    check.reason = "Lambda or K couples the axes, or a number is missing: no bound per axis";
  } else if (!std::isfinite(proved)) {
    judge(check, limit, proved, std::isfinite(attained) ? attained : -1);
    check.value.reset();
    if (check.verdict == Verdict::kInconclusive)
      check.reason =
          "there is no bound on the error: the loop is unstable in the box, the integrator's clamp may act, "
          "or the force error's amplitude is unknown";
  } else if (!bound.saturation.is_proved() && !(attained > limit.value)) {
    judge(check, limit, std::numeric_limits<double>::infinity(), -1);
    check.value.reset();
    check.reason = fmt::format(
        "{:.6g} m hold only if the thrust does not saturate, which is {} at a corner of the box: {}", proved,
        stability::name(bound.saturation.verdict), bound.saturation.why);
  } else if (over == Over::kBox && !bound.is_enclosed && !(attained > limit.value)) {
    judge(check, limit, std::numeric_limits<double>::infinity(), attained);
    check.value.reset();
    check.reason = fmt::format(
        "at most {:.6g} m at the corners of the uncertainty, but nothing bounds a sampled loop with an "
        "integrator clamp in between; over = \"corners\" checks only the corners",
        proved);
  } else {
    judge(check, limit, proved, attained);
  }
  checks.push_back(std::move(check));
}

/// Judges how often the promise held on reference flights not used to make it, along the worst axis.
void judge_promise(Evidence& evidence, const Limit& limit, Checks& checks) {
  const analysis::Promise promise = analysis::read_promise(evidence.release().promise);
  const analysis::KeptPromise kept = analysis::kept_promise(promise, evidence.flight_peaks());
  Check check = row("tracking.promise_kept", limit);
  const int axis = kept.worst_axis();
  if (axis < 0) {
    check.reason = kept.used.empty()
                       ? "no reference flight has a set point"
                       : "the promise was made from the reference flights: none is left to judge it";
  } else {
    const analysis::KeptAlong& along = kept.axes[static_cast<std::size_t>(axis)];
    judge(check, limit, along.share(), along.share());
    check.witness = fmt::format(
        "axis {}: below {:.4g} m in {} of {} flights (90 % interval {:.3f} to {:.3f}), promised {:g}",
        stability::axis_name(axis), promise.bound_m[static_cast<std::size_t>(axis)], along.held,
        along.flights, along.interval_90.lower, along.interval_90.upper, promise.level);
  }
  checks.push_back(std::move(check));
}

}  // namespace

void describe_tracking_keys(files::Keys& keys) {
  describe_disturbance(keys);
  describe_estimates(keys);
  keys.must<double>("max_error_m", "", "m");
  keys.may<double>("guard_factor", "By which peaks exceed the bound of the linear loop; absent: measured.");
  keys.may("guard_quantile", "Of the measured factor.", "", files::OneOf{kGuardQuantiles});
  keys.may("over", "Where the bound must hold; box if absent.", "", files::OneOf{kOver});
  keys.may_table("uncertainty", "[from, to] of what is not known exactly; absent: the usual.",
                 describe_uncertainty);
  keys.may<double>("min_promise_kept", "Share of the flights that must keep the promise.");
}

Run read_tracking(const files::TomlTable& table, Policy& policy) {
  const std::optional<Limit> limit = gate::limit(table, "max_error_m", "m");
  if (!limit) refuse_without_limit(table, "max_error_m = 0.15");
  const DisturbanceTable declared = read_disturbance(table);
  const EstimateTable estimates = read_estimates(table);
  Guard guard;
  if (table.has("guard_factor") && table.has("guard_quantile"))
    table.refuse("guard_quantile", "", "conflicts with a declared guard_factor", "give one");
  if (table.has("guard_factor")) {
    guard.declared = table.number("guard_factor");
    if (!(*guard.declared >= 1))
      table.refuse("guard_factor", fmt::format("{}", *guard.declared), "must be at least 1");
  } else if (table.has("guard_quantile")) {
    guard.quantile = kGuardQuantiles[table.choice("guard_quantile", kGuardQuantiles)];
  }
  if (!declared.is_declared())
    require_file(table, policy, "flights", " (or state rate_N_s, amplitude_N, ... here)");
  if (!guard.declared) {
    require_file(table, policy, "flights", " (or state guard_factor here)");
    policy.wants_guard_factor = true;
  }
  const std::optional<Limit> kept = gate::limit(table, "min_promise_kept", "", false);
  if (kept) {
    require_file(table, policy, "promise");
    require_file(table, policy, "flights");
  }
  const Over over = table.has("over") && table.choice("over", kOver) == 1 ? Over::kCorners : Over::kBox;
  return [declared, estimates, over, uncertainty = read_uncertainty(table), guard, limit = *limit, kept](
             Evidence& evidence, Checks& checks) {
    judge_tracking(evidence, declared, estimates, uncertainty, guard, over, limit, checks);
    if (kept) judge_promise(evidence, *kept, checks);
  };
}

}  // namespace swarmcert::gate
