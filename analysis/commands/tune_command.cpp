#include <fmt/core.h>

#include <cmath>
#include <memory>

#include "analysis/bound_report.h"
#include "analysis/commands/command.h"
#include "analysis/tracking_input.h"
#include "stability/sweep/tune.h"

namespace swarmcert::analysis {
namespace {

using stability::TunedPoint;
using stability::TuneResult;

struct Options {
  TrackingArguments tracking;
  stability::TuneOptions tune;
  std::string objective = "impulse";
  std::string axis = "z";
  double noise_factor = 1, lag_factor = 0.5;
};

files::Json point_json(const TunedPoint& p) {
  return {{"Kp", p.Kp},
          {"Kd", p.Kd},
          {"Ki", p.Ki},
          {"objective", finite(p.objective)},
          {"rate", finite(p.norms.rate)},
          {"amplitude", finite(p.norms.amplitude)},
          {"edge", finite(p.norms.edge)},
          {"impulse", finite(p.norms.impulse)},
          {"noise_command_m_s2", finite(p.noise_m_s2)},
          {"lag_limit_s", finite(p.lag_limit_s)},
          {"effort", finite(p.effort)},
          {"feasible", p.feasible}};
}

void print_row(const char* what, double before, double after, const char* unit) {
  fmt::print("  {:<22} {:>12.6g} {:>12.6g} {:>+9.1f} %  {}\n", what, before, after,
             100 * (after / before - 1), unit);
}

void print_result(const Options& options, const TuneResult& found, const stability::TuneConstraints& limits) {
  const TunedPoint& a = found.shipped;
  const TunedPoint& b = found.best;
  fmt::print("Axis {}, least {} gain under: noise at most {:.6g} m/s^2, further lag of {:.6g} s borne\n\n",
             options.axis, options.objective, limits.most_noise_m_s2, limits.least_lag_limit_s);
  if (!b.feasible) {
    fmt::print("no gains within a factor {} satisfy the constraints ({})\n", options.tune.range,
               found.stopped);
    return;
  }
  fmt::print("  {:<22} {:>12} {:>12}\n", "", "shipped", "tuned");
  print_row(("Kp[" + options.axis + "]").c_str(), a.Kp, b.Kp, "1/s^2");
  print_row(("Kd[" + options.axis + "]").c_str(), a.Kd, b.Kd, "1/s");
  print_row(("Ki[" + options.axis + "]").c_str(), a.Ki, b.Ki, "1/s^3");
  print_row("rate", a.norms.rate, b.norms.rate, "m per N/s");
  print_row("amplitude", a.norms.amplitude, b.norms.amplitude, "m/N");
  print_row("edge", a.norms.edge, b.norms.edge, "m/N");
  print_row("impulse", a.norms.impulse, b.norms.impulse, "m per N s");
  print_row("noise of the command", a.noise_m_s2, b.noise_m_s2, "m/s^2");
  print_row("further lag borne", a.lag_limit_s, b.lag_limit_s, "s");
  print_row("effort", a.effort, b.effort, "N/N");
  std::string active;
  for (const std::string& name : found.active_constraints) active += (active.empty() ? "" : ", ") + name;
  fmt::print("\nactive constraints: {}\n", active.empty() ? "none" : active);
  fmt::print("search: {}; good gains, not proved to be the best\n", found.stopped);
}

int run(Options options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  const Tracking input = load_tracking(options.tracking);
  const int axis = options.axis == "x" ? 0 : options.axis == "y" ? 1 : 2;
  std::optional<stability::SampledLoop> loop = sampled_axis_loop(input.gains, input.plant, axis);
  if (!loop) {
    const std::optional<stability::AxisLoop> continuous = axis_loop(input.gains, input.plant, axis);
    if (!continuous) throw UsageError("Lambda or K couples axes: there are no gains of one axis to tune");
    throw UsageError(options.tracking.gains + " has no rate_hz: the noise of the command depends on it");
  }
  if (!(loop->plant.Ki > 0)) throw UsageError("Ki of axis " + options.axis + " is 0: tune needs a PID law");
  options.tune.objective = options.objective == "amplitude" ? stability::TuneObjective::kAmplitude
                           : options.objective == "edge"    ? stability::TuneObjective::kEdge
                           : options.objective == "rate"    ? stability::TuneObjective::kRate
                                                            : stability::TuneObjective::kImpulse;
  const TunedPoint shipped = evaluate_gains(*loop, options.tune.objective);
  stability::TuneConstraints& limits = options.tune.constraints;
  if (limits.most_noise_m_s2 == 0) limits.most_noise_m_s2 = options.noise_factor * shipped.noise_m_s2;
  if (limits.least_lag_limit_s == 0) limits.least_lag_limit_s = options.lag_factor * shipped.lag_limit_s;
  const TuneResult found = stability::tune(*loop, options.tune);

  files::Json result = result_head("tune", {options.tracking.gains, options.tracking.model});
  result["seed"] = options.tune.seed;
  result["axis"] = options.axis;
  result["objective"] = options.objective;
  result["constraints"] = {
      {"most_noise_m_s2", limits.most_noise_m_s2},
      {"least_lag_limit_s", limits.least_lag_limit_s},
      {"most_rate", limits.most_rate > 0 ? files::Json(limits.most_rate) : files::Json()},
      {"most_effort", limits.most_effort > 0 ? files::Json(limits.most_effort) : files::Json()}};
  result["gains"] = found.best.feasible
                        ? files::Json{{"Kp", found.best.Kp}, {"Kd", found.best.Kd}, {"Ki", found.best.Ki}}
                        : files::Json();
  result["shipped"] = point_json(found.shipped);
  result["tuned"] = found.best.feasible ? point_json(found.best) : files::Json();
  result["active_constraints"] = found.active_constraints;
  result["stopped"] = found.stopped;
  write_result(common, result);
  if (common.prints_text()) print_result(options, found, limits);
  return found.best.feasible ? kDone : kInconclusive;
}

}  // namespace

Command tune_command() {
  return {
      "tune", "Better gains for one axis under constraints",
      "Searches Kp, Kd, Ki of one axis, globally and then locally (NLopt), for the least worst-case error "
      "under\n"
      "limits on the command's noise, the lag that must be borne, and others. Says which limits hold it back "
      "and\n"
      "what changes against the gains given.\n\n"
      "Example: swarmcert tune --gains controller/gains/crazyflie-small.toml --model "
      "stability/models/crazyflie-small.toml",
      [](CLI::App& app) {
        const auto options = std::make_shared<Options>();
        declare_tracking(app, options->tracking);
        app.add_option("--axis", options->axis, "x, y or z (default z)")
            ->check(CLI::IsMember({"x", "y", "z"}));
        app.add_option("--objective", options->objective, "Gain to make least (default impulse)")
            ->check(CLI::IsMember({"rate", "amplitude", "edge", "impulse"}));
        auto& limits = options->tune.constraints;
        app.add_option(
               "--max-noise", limits.most_noise_m_s2,
               "Most noise of the command, m/s^2, for 1 mm and 0.05 m/s of sensor noise (default: as now)")
            ->check(CLI::PositiveNumber);
        app.add_option("--min-lag", limits.least_lag_limit_s,
                       "Further lag that the loop must bear, s (default: half of what it bears now)")
            ->check(CLI::PositiveNumber);
        app.add_option("--max-rate", limits.most_rate, "Largest rate gain, m per N/s")
            ->check(CLI::PositiveNumber);
        app.add_option("--max-effort", limits.most_effort, "Largest effort gain, N/N")
            ->check(CLI::PositiveNumber);
        app.add_option("--range", options->tune.range, "Gains at most this factor away (default 8)")
            ->check(CLI::Range(1.01, 100.0));
        app.add_option("--nodes", options->tune.global_evaluations, "Evaluations of the global search")
            ->check(CLI::PositiveNumber);
        app.add_option("--seed", options->tune.seed, "Seed of the global search (default 1)");
        return [options](const CommonOptions& common) { return run(*options, common); };
      }};
}

}  // namespace swarmcert::analysis
