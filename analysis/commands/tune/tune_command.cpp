#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/bound/bound_attitude.h"
#include "analysis/commands/bound/bound_output.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/shared/tracking_input.h"
#include "analysis/commands/tune/tune_report.h"
#include "nn/base/input_error.h"
#include "stability/sweep/tune.h"

namespace swarmcert::analysis {
namespace {

using stability::TunedPoint;
using stability::TuneResult;

struct TuneOptions {
  TrackingArguments tracking;
  stability::TuneOptions tune;
  std::string objective = "impulse";
  std::string axis = "z";
  bool without_integrator = false;
  std::string attitude;     ///< empty: no attitude loop
  std::string disturbance;  ///< empty: none is declared
  std::string report;
};

/// By default the tuned gains must tolerate this share of the additional lag that the shipped gains tolerate.
constexpr double kKeptLag = 0.5;

const std::map<std::string, stability::TuneObjective> kObjectives = {
    {"rate", &stability::GainNorms::rate},
    {"amplitude", &stability::GainNorms::amplitude},
    {"edge", &stability::GainNorms::edge},
    {"impulse", &stability::GainNorms::impulse},
    {"error", nullptr}};

/// The gains under the names used in the published firmware.
struct FirmwareGain {
  const char* name = "";
  double TunedPoint::*value = nullptr;
  const char* unit = "";
};
constexpr FirmwareGain kFirmwareGains[] = {{"Kpos_P", &TunedPoint::Kp, "1/s^2"},
                                           {"Kpos_D", &TunedPoint::Kd, "1/s"},
                                           {"Kpos_I", &TunedPoint::Ki, "1/s^3"}};

std::vector<TunedQuantity> quantities(const std::string& axis, const TuneResult& found) {
  const TunedPoint& a = found.shipped;
  const TunedPoint& b = found.best;
  std::vector<TunedQuantity> all;
  for (const FirmwareGain& gain : kFirmwareGains)
    all.push_back({fmt::format("{} {}", gain.name, axis), a.*gain.value, b.*gain.value, gain.unit});
  all.insert(all.end(), {{"rate", a.norms.rate, b.norms.rate, "m per N/s"},
                         {"amplitude", a.norms.amplitude, b.norms.amplitude, "m/N"},
                         {"edge", a.norms.edge, b.norms.edge, "m/N"},
                         {"impulse", a.norms.impulse, b.norms.impulse, "m per N s"},
                         {"noise of the command", a.noise_m_s2, b.noise_m_s2, "m/s^2"},
                         {"additional lag allowed", a.lag_limit_s, b.lag_limit_s, "s"},
                         {"effort", a.effort, b.effort, "N/N"}});
  if (a.disturbed && b.disturbed) {
    all.push_back({"largest error", a.disturbed->error_m, b.disturbed->error_m, "m"});
    all.push_back({"thrust left", a.disturbed->thrust_margin_N, b.disturbed->thrust_margin_N, "N"});
  }
  return all;
}

std::string constraint_names(const std::vector<std::string>& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

void print_result(const TuneOptions& options, const TuneResult& found) {
  const stability::TuneConstraints& limits = options.tune.constraints;
  const TunedPoint& a = found.shipped;
  const TunedPoint& b = found.best;
  fmt::print("Axis {}, least {} under: noise at most {:.6g} m/s^2, additional lag of {:.6g} s allowed",
             options.axis, options.objective, limits.most_noise_m_s2, limits.least_lag_limit_s);
  if (limits.most_rate > 0) fmt::print(", rate gain at most {:.6g}", limits.most_rate);
  if (limits.most_effort > 0) fmt::print(", effort at most {:.6g}", limits.most_effort);
  fmt::print("\n\n");
  if (!b.feasible) {
    if (found.infeasible.empty()) {
      fmt::print(
          "NONE FOUND: no gains within a factor {} of the given ones were found that satisfy all "
          "constraints\n",
          options.tune.range);
    } else {
      fmt::print("INFEASIBLE: {}\n", found.infeasible);
    }
    fmt::print("nearest: Kp {:.6g}, Kd {:.6g}, Ki {:.6g}; violates {} by {:.3g} %\nsearch: {}\n", b.Kp, b.Kd,
               b.Ki, constraint_names(found.violated), 100 * b.excess, found.stopped);
    return;
  }
  fmt::print("  {:<22} {:>12} {:>12}\n", "", "shipped", "tuned");
  for (const TunedQuantity& q : quantities(options.axis, found)) {
    const double change = 100 * (q.tuned / q.shipped - 1);
    fmt::print("  {:<22} {:>12.6g} {:>12.6g} {:>11}  {}\n", q.name, q.shipped, q.tuned,
               std::isfinite(change) ? fmt::format("{:+.1f} %", change) : std::string("-"), q.unit);
  }
  fmt::print("\nactive constraints: {}\n", constraint_names(found.active_constraints));
  if (!a.feasible) fmt::print("the shipped gains violate a constraint\n");
  fmt::print("search: {}; good gains, not proved to be the best\n", found.stopped);
}

/// The sampled loop of the axis whose gains are searched.
stability::SampledLoop loop_of(const TuneOptions& options, const Tracking& input, int axis) {
  std::optional<stability::SampledLoop> loop = input.sampled(axis);
  if (!loop) {
    const std::optional<stability::AxisLoop> continuous = input.continuous(axis);
    if (!continuous) throw UsageError("Lambda or K couples axes: there are no gains of one axis to tune");
    throw files::InputError({options.tracking.gains, "", "position.rate_hz", "", "is missing",
                             "the noise of the command depends on the rate of the loop"});
  }
  if (options.without_integrator) loop->plant.Ki = 0;
  if (!(loop->plant.Ki > 0) && (options.objective == "rate" || options.tune.constraints.most_rate > 0)) {
    throw UsageError(
        "without an integrator (Ki = 0) the rate gain is infinite: choose another objective, and leave "
        "--max-rate out");
  }
  return *loop;
}

/// What the declared disturbance does to the vehicle with other gains on the axis.
std::function<stability::DisturbedLoop(const stability::SampledLoop&)> disturbed_by(
    const TuneOptions& options, const Tracking& input, int axis) {
  const stability::DisturbanceSource source = load_disturbance_file(options.disturbance);
  if (!input.coupled_axes().empty())
    throw UsageError("--disturbance: Lambda or K couples axes: make them diagonal");
  return [source, input, axis](const stability::SampledLoop& loop) {
    const Tracking changed = input.with_axis(axis, loop.plant);
    stability::DisturbedLoop result;
    for (const auto channel : {stability::Channel::kForce, stability::Channel::kCommand})
      result.error_m = std::max(
          result.error_m, axis_bounds(changed, flown_gains(changed, axis, channel), source, {}).least());
    result.thrust_margin_N = thrust_demand(changed, source, {}).margin_N();
    return result;
  };
}

/// Sets the objective and the limits that the command line leaves out: by default nothing may be worse than with the
/// given gains, except the tolerated lag.
void set_limits(const stability::SampledLoop& loop, const Tracking& input, int axis, TuneOptions& options) {
  if (!options.attitude.empty() && axis == 2)
    throw UsageError("--attitude-gains: the z axis has no attitude loop");
  options.tune.attitude = input.cascade(axis);
  options.tune.objective = kObjectives.at(options.objective);
  if (!options.disturbance.empty()) options.tune.under_disturbance = disturbed_by(options, input, axis);
  if (options.tune.objective == nullptr && options.disturbance.empty())
    throw UsageError("--objective error: state what disturbs the vehicle: --disturbance FILE");
  const TunedPoint shipped = evaluate_gains(loop, options.tune);
  stability::TuneConstraints& limits = options.tune.constraints;
  constexpr double kSlack = 1e-9;  // for round-off error
  if (limits.most_noise_m_s2 == 0) limits.most_noise_m_s2 = shipped.noise_m_s2 * (1 + kSlack);
  if (limits.least_lag_limit_s == 0) limits.least_lag_limit_s = kKeptLag * shipped.lag_limit_s;
  if (limits.most_rate == 0 && loop.plant.Ki > 0) limits.most_rate = shipped.norms.rate * (1 + kSlack);
}

struct TuneOutcome {
  TuneOptions options;
  TuneResult found;
};

void describe_point(files::Record& record, const TunedPoint& p) {
  record.field("Kp", p.Kp, "Position gain.", "1/s^2");
  record.field("Kd", p.Kd, "Velocity gain.", "1/s");
  record.field("Ki", p.Ki, "Integral gain.", "1/s^3");
  record.field("objective", p.objective, "The gain that is minimised.");
  record.field("noise_command_m_s2", p.noise_m_s2, "Of the command, for 1 mm and 0.05 m/s of sensor noise.",
               "m/s^2");
  record.field("lag_limit_s", p.lag_limit_s, "Additional first-order lag that the loop tolerates.", "s");
  record.field("effort", p.effort, "Feedback force per amplitude of force.", "N/N");
  record.field("feasible", p.feasible, "Whether all limits are kept.");
  const auto disturbed = p.disturbed.value_or(stability::DisturbedLoop());
  record.may_fields(p.disturbed.has_value(), [&disturbed](files::Record& r) {
    r.field("error_m", disturbed.error_m, "Largest error under --disturbance.", "m", "upper bound");
    r.field("thrust_margin_N", disturbed.thrust_margin_N, "Thrust that is left; negative: saturates.", "N");
  });
  record.may_object(p.margins.has_value(), "limit_cycle", "With an attitude loop.",
                    [&](files::Record& cycle) {
                      const auto margins = p.margins.value_or(std::decay_t<decltype(*p.margins)>());
                      cycle.field("verdict", name(nearness_to_limit_cycle(margins)),
                                  "clear, close to a limit cycle, or unstable.");
                      cycle.field("gain_margin", margins.gain, "Of the cascade; null: unlimited.");
                      cycle.field("damping", margins.damping, "Least damping of its poles.");
                    });
  describe_norms(record, p.norms);
}

void describe_firmware_gain(files::Record& record, const FirmwareGain& gain, const TuneOutcome& outcome) {
  const double before = gain.value != nullptr ? outcome.found.shipped.*gain.value : 0;
  const double after = gain.value != nullptr ? outcome.found.best.*gain.value : 0;
  record.field("name", gain.name, "Parameter of the firmware.");
  record.field("axis", outcome.options.axis, "Whose gain it is.");
  record.field("shipped", before, "Value of the gains given, in `unit`.");
  record.field("tuned", after, "Value found, in `unit`.");
  record.field("relative_change", before > 0 ? std::optional<double>(after / before - 1) : std::nullopt,
               "null: there was no such gain.");
  record.field("unit", gain.unit, "Of both values.");
}

std::string verdict_of(const TuneResult& found) {
  if (!found.best.feasible) return found.infeasible.empty() ? "none found" : "infeasible";
  return found.shipped.feasible && found.best.objective > found.shipped.objective * (1 - 1e-6)
             ? "no better gains found"
             : "found";
}

void describe_limits(files::Record& record, const stability::TuneConstraints& limits) {
  const auto if_set = [](double limit) { return limit > 0 ? std::optional<double>(limit) : std::nullopt; };
  record.field("most_noise_m_s2", limits.most_noise_m_s2, "Largest noise of the command.", "m/s^2");
  record.field("least_lag_limit_s", limits.least_lag_limit_s, "Additional lag that must be tolerated.", "s");
  record.field("most_rate", if_set(limits.most_rate), "Largest rate gain; null: no limit.", "m per N/s");
  record.field("most_effort", if_set(limits.most_effort), "Largest effort; null: no limit.", "N/N");
}

void describe(files::Record& record, const TuneOutcome& outcome) {
  const TuneResult& found = outcome.found;
  const bool is_feasible = found.best.feasible;
  record.field("axis", outcome.options.axis, "Whose gains are searched.");
  record.field("objective", outcome.options.objective, "The gain that is minimised.");
  record.object("constraints", "Limits that the gains must keep.",
                [&](files::Record& limits) { describe_limits(limits, outcome.options.tune.constraints); });
  record.field("verdict", verdict_of(found),
               "found, no better gains found, none found, or infeasible: proved that there are none.");
  record.object_or_null(is_feasible, "gains", "null: none found.", [&](files::Record& gains) {
    gains.field("Kp", found.best.Kp, "Position gain.", "1/s^2");
    gains.field("Kd", found.best.Kd, "Velocity gain.", "1/s");
    gains.field("Ki", found.best.Ki, "Integral gain.", "1/s^3");
  });
  record.list_or_null(
      is_feasible, "firmware_parameters",
      std::vector<FirmwareGain>(std::begin(kFirmwareGains), std::end(kFirmwareGains)),
      "The gains under the names of the published firmware; null: none found.",
      [&](files::Record& one, const FirmwareGain& gain) { describe_firmware_gain(one, gain, outcome); });
  record.object("shipped", "The gains given, and what they reach.",
                [&](files::Record& point) { describe_point(point, found.shipped); });
  const auto best = [&](files::Record& point) { describe_point(point, found.best); };
  record.object_or_null(is_feasible, "tuned", "The gains found, and what they reach; null: none found.",
                        best);
  record.object_or_null(!is_feasible, "nearest",
                        "Gains that come nearest to keeping all limits; null: some keep them.", best);
  record.field("violated_constraints", found.violated, "Limits that the nearest gains break.");
  record.field("why_infeasible", found.infeasible, "The proof that no gains keep all limits; empty: none.");
  record.field("active_constraints", found.active_constraints, "Limits that the gains found touch.");
  record.field("stopped", found.stopped, "Why the search ended.");
}

/// Gains that were found are to be judged with all axes together; if none were, the bounds show what limits them.
void print_next_of(const TuneOptions& options, const TuneResult& found, const CommonOptions& common) {
  const std::string& gains = options.tracking.gains;
  if (common.prints_text() && found.best.feasible)
    fmt::print("Write the gains of axis {} into {}; then:\n", options.axis, gains);
  print_next(common, {"bound", "--gains", gains, "--model", options.tracking.model, "--details"});
}

int run_tune(TuneOptions options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  Tracking input = load_tracking(options.tracking);
  state_attitude_gains(options.attitude, input);
  const int axis = options.axis == "x" ? 0 : options.axis == "y" ? 1 : 2;
  const stability::SampledLoop loop = loop_of(options, input, axis);
  set_limits(loop, input, axis, options);
  Progress progress(common.quiet);
  options.tune.progress = [&progress](int done, int total) { progress.show(done, total, "evaluations"); };
  const CancelOnInterrupt interrupt;
  options.tune.cancelled = interrupt.flag();
  const TuneResult found = stability::tune(loop, options.tune);

  std::vector<std::string> inputs = {options.tracking.gains, options.tracking.model};
  if (!options.disturbance.empty()) inputs.push_back(options.disturbance);
  const files::Node result = result_of("tune", inputs, options.tune.seed, TuneOutcome{options, found});
  write_result(common, result);
  if (common.prints_text()) print_result(options, found);
  if (!options.report.empty()) {
    const std::string verdict = fmt::format(
        "Axis {}, least {}: {}. Active constraints: {}. Good gains, not proved to be the best.", options.axis,
        options.objective, verdict_of(found), constraint_names(found.active_constraints));
    const std::string path = write_tune_report(
        verdict, found.best.feasible ? quantities(options.axis, found) : std::vector<TunedQuantity>(), result,
        options.report, common.force);
    if (common.prints_text()) fmt::print("report: {}\n", path);
  }
  print_next_of(options, found, common);
  if (!found.best.feasible) return found.infeasible.empty() ? kInconclusive : kViolated;
  return kDone;
}

}  // namespace

Command tune_command() {
  return {
      "tune", "Better gains for one axis under constraints",
      "Searches Kp, Kd, Ki of one axis, globally and then locally (NLopt), for the least worst-case error "
      "under\n"
      "limits on the command's noise, the lag that must be tolerated, the rate gain, and the effort. Reports "
      "the active\nlimits and the changes relative to the gains given. Exit code 4: no gains found; 1: "
      "proved that there "
      "are none. Ctrl-C ends the search with the best gains so far.\n\n"
      "Example: swarmcert tune --gains controller/gains/crazyflie-small.toml --model "
      "stability/models/crazyflie-small.toml",
      [](CLI::App& app) {
        const auto options = std::make_shared<TuneOptions>();
        declare_tracking(app, options->tracking);
        app.add_option("--axis", options->axis, "x, y or z (default z)")
            ->check(CLI::IsMember({"x", "y", "z"}));
        app.add_option("--objective", options->objective,
                       "Gain to minimize (default impulse), or the largest error under --disturbance")
            ->check(CLI::IsMember(kObjectives));
        app.add_option("--disturbance", options->disturbance,
                       "disturbance.toml, under which the thrust must suffice");
        auto& limits = options->tune.constraints;
        app.add_option(
               "--max-noise", limits.most_noise_m_s2,
               "Largest noise of the command, m/s^2, for 1 mm and 0.05 m/s of sensor noise (default: as now)")
            ->check(CLI::PositiveNumber);
        app.add_option("--min-lag", limits.least_lag_limit_s,
                       "Additional lag that the loop must tolerate, s (default: half of the present margin)")
            ->check(CLI::PositiveNumber);
        app.add_option("--max-rate", limits.most_rate,
                       "Largest rate gain, m per N/s (default: as now; keeps Ki up)")
            ->check(CLI::PositiveNumber);
        app.add_option("--max-effort", limits.most_effort, "Largest effort gain, N/N")
            ->check(CLI::PositiveNumber);
        app.add_flag("--no-integrator", options->without_integrator,
                     "Search Kp and Kd with Ki = 0, as if the gains given had Ki = 0");
        declare_attitude(app, options->attitude);
        app.add_option("--range", options->tune.range, "Gains at most this factor away (default 8)")
            ->check(CLI::Range(1.01, 100.0));
        app.add_option("--nodes", options->tune.global_evaluations, "Evaluations of the global search")
            ->check(CLI::PositiveNumber);
        app.add_option("--seed", options->tune.seed, "Seed of the global search (default 1)");
        add_output(app, "--report", options->report, "Write an HTML report with plots into this folder");
        return [options](const CommonOptions& common) { return run_tune(*options, common); };
      },
      fields_of<TuneOutcome>()};
}

}  // namespace swarmcert::analysis
