#include <fmt/core.h>
#include <fmt/ranges.h>

#include <map>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/counted.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/iss_check/iss_check_report.h"
#include "stability/iss/iss_full_loop.h"

namespace swarmcert::analysis {
namespace {

using files::Json;
using stability::IssCheck;
using stability::IssRun;

struct IssCheckOptions {
  std::string gains, model, report;
  stability::IssOptions check;
};

constexpr double kDegrees = 57.29577951308232;

Json vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

const char* verdict(const IssCheck& check) {
  if (check.is_refuted()) return "refuted";
  return check.why_inconclusive().empty() ? "none_found" : "inconclusive";
}

struct KindSummary {
  int runs = 0, violations = 0, left = 0, failed = 0;
  double worst_ratio = 0, worst_transient_ratio = 0;
};

std::map<std::string, KindSummary> by_kind(const IssCheck& check) {
  std::map<std::string, KindSummary> kinds;
  for (const IssRun& run : check.runs) {
    KindSummary& kind = kinds[run.kind];
    ++kind.runs;
    kind.violations += run.is_violation ? 1 : 0;
    kind.left += run.left.empty() ? 0 : 1;
    kind.failed += run.failure.empty() ? 0 : 1;
    kind.worst_ratio = std::max(kind.worst_ratio, run.ratio);
    kind.worst_transient_ratio = std::max(kind.worst_transient_ratio, run.transient_ratio);
  }
  return kinds;
}

/// Whether the shown ratio refers to the ball: if the ball is exceeded, or if nothing is violated and the run started
/// at rest. Otherwise it refers to the transient bound.
bool is_about_ball(const IssRun& run) { return run.ratio > 1 || (run.ratio > 0 && !run.is_violation); }

double shown_ratio(const IssRun& run) { return is_about_ball(run) ? run.ratio : run.transient_ratio; }

/// The most significant run: a violation of the ball if there is one, else of the transient bound, else the run with
/// the largest ratio.
const IssRun* witness(const IssCheck& check) {
  const IssRun* best = nullptr;
  for (const IssRun& run : check.runs) {
    const auto better = [&] {
      if (run.is_violation != best->is_violation) return run.is_violation;
      if (run.is_violation && is_about_ball(run) != is_about_ball(*best)) return is_about_ball(run);
      return shown_ratio(run) > shown_ratio(*best);
    };
    if (best == nullptr || better()) best = &run;
  }
  return best;
}

Json run_json(const IssRun& run) {
  Json pieces = Json::array();
  for (std::size_t i = 0; i < run.disturbance.until_s.size(); ++i) {
    pieces.push_back(
        {{"until_s", run.disturbance.until_s[i]}, {"rate_N_s", vector(run.disturbance.rate_W_N_s[i])}});
  }
  return {{"disturbance", run.kind},
          {"ratio", run.ratio},
          {"transient_ratio", run.transient_ratio},
          {"largest_error_m", run.largest_m},
          {"at_s", run.at_s},
          {"left_hypothesis", run.left.empty() ? Json() : Json(run.left)},
          {"left_at_s", run.left.empty() ? Json() : Json(run.left_at_s)},
          {"failure", run.failure.empty() ? Json() : Json(run.failure)},
          {"initial_position_error_m", vector(run.position_m)},
          {"initial_velocity_error_m_s", vector(run.velocity_m_s)},
          {"bias_N", vector(run.disturbance.bias_W_N)},
          {"pieces", std::move(pieces)}};
}

Json result_json(const IssCheckOptions& options, const IssCheck& check,
                 const std::vector<stability::FullLoopRun>& flown) {
  Json result = result_head("iss-check", {options.gains, options.model});
  result["seed"] = options.check.seed;
  result["loop"] = "continuous position loop with the declared lags, clamps and thrust limit";
  result["delay_left_out_s"] = check.delay_left_out_s;
  result["theorem"] = {{"applies", check.theorem_applies}, {"why_not", check.why_not}};
  result["rate_N_s"] = check.rate_N_s;
  result["ball_m"] = check.ball_m;
  result["ball_from"] =
      check.has_ball ? "theorem" : "smallest eigenvalues or m Ki: the gains lack the theorem's form";
  result["duration_s"] = check.duration_s;
  int runs = 0;
  Json kinds = Json::array();
  for (const auto& [name, kind] : by_kind(check)) {
    runs += kind.runs;
    kinds.push_back({{"disturbance", name},
                     {"runs", kind.runs},
                     {"violations", kind.violations},
                     {"left_hypotheses", kind.left},
                     {"failed", kind.failed},
                     {"worst_ratio", kind.worst_ratio},
                     {"worst_transient_ratio", kind.worst_transient_ratio}});
  }
  result["runs"] = options.check.runs;
  result["reported_runs"] = runs;
  result["violations"] = check.violations;
  result["left_hypotheses"] = check.left;
  result["failed"] = check.failed;
  result["worst_ratio"] = check.worst_ratio;
  result["worst_transient_ratio"] = check.worst_transient_ratio;
  result["kinds"] = std::move(kinds);
  const IssRun* const shown = witness(check);
  result["worst"] = shown != nullptr ? run_json(*shown) : Json();
  Json full = Json::array();
  double worst_full = 0;
  for (const stability::FullLoopRun& run : flown) {
    const IssRun& of = check.runs[static_cast<std::size_t>(run.run)];
    worst_full = std::max(worst_full, run.ratio);
    full.push_back({{"disturbance", of.kind},
                    {"direction", vector(of.disturbance.rate_W_N_s.back().stableNormalized())},
                    {"ratio", run.ratio},
                    {"ratio_without_attitude", of.ratio},
                    {"at_s", run.at_s},
                    {"largest_tilt_deg", kDegrees * run.largest_tilt_rad},
                    {"left_hypothesis", run.left.empty() ? Json() : Json(run.left)},
                    {"left_at_s", run.left.empty() ? Json() : Json(run.left_at_s)},
                    {"failure", run.failure.empty() ? Json() : Json(run.failure)}});
  }
  result["full_loop"] = {{"worst_ratio", worst_full}, {"runs", std::move(full)}};
  result["verdict"] = verdict(check);
  result["why_inconclusive"] = check.why_inconclusive();
  return result;
}

/// What was not judged in the runs of a kind.
std::string unjudged_text(const KindSummary& kind) {
  std::string text;
  if (kind.left > 0) text += fmt::format("  {} left a hypothesis", kind.left);
  if (kind.failed > 0) text += fmt::format("  {} could not be integrated", kind.failed);
  return text;
}

std::string end_text(const stability::FullLoopRun& run) {
  if (!run.left.empty()) return fmt::format("; ended after {:.4g} s, when {}", run.left_at_s, run.left);
  return run.failure.empty() ? "" : "; ended early: " + run.failure;
}

void print_verdict(const IssCheckOptions& options, const IssCheck& check) {
  if (check.violations > 0) {
    const IssRun& run = *witness(check);
    fmt::print("{} in {} runs. The worst: {}, largest |error| {:.6g} m at {:.3f} s, up to {:.6f} of the {}\n",
               check.is_refuted() ? "VIOLATED" : "Exceeded", check.violations, run.kind, run.largest_m,
               run.at_s, shown_ratio(run), is_about_ball(run) ? "ball" : "transient bound");
  } else {
    const std::string runs = check.cancelled
                                 ? fmt::format("{} finished before the interruption, of {}",
                                               counted(check.runs.size(), "run"), options.check.runs)
                                 : counted(options.check.runs, "run");
    fmt::print("No violation found in {}.{}\n", runs,
               check.why_inconclusive().empty() ? " This is not a proof." : "");
  }
  const std::vector<std::string> why = check.why_inconclusive();
  if (!why.empty()) fmt::print("Inconclusive: {}\n", fmt::join(why, "; "));
}

void print(const IssCheckOptions& options, const IssCheck& check,
           const std::vector<stability::FullLoopRun>& flown) {
  if (check.theorem_applies) {
    fmt::print("The theorem's hypotheses hold for these gains.\n");
  } else {
    fmt::print("The theorem does not apply:\n");
    for (const std::string& why : check.why_not) fmt::print("  - {}\n", why);
  }
  fmt::print(
      "Ball {:.6g} m for a learning error that changes by at most {:.4g} N/s{}\n", check.ball_m,
      check.rate_N_s,
      check.has_ball ? "" : " (these gains do not have the theorem's form; this is the analogous number)");
  fmt::print(
      "Integrated with SUNDIALS (Dormand-Prince 5(4), 1e-9), {:.3g} s each; ratios are |error| over the "
      "ball, from rest\n",
      check.duration_s);
  if (check.delay_left_out_s > 0) {
    fmt::print(
        "Not integrated: the delay of {} s. A loop with the delay may violate more; simulate and bound "
        "include it\n",
        check.delay_left_out_s);
  }
  fmt::print("  {:<14} {:>6} {:>11} {:>12} {:>16}\n", "disturbance", "runs", "violations", "worst ratio",
             "over transient");
  for (const auto& [name, kind] : by_kind(check)) {
    fmt::print("  {:<14} {:>6} {:>11} {:>12.6f} {:>16.6f}{}\n", name, kind.runs, kind.violations,
               kind.worst_ratio, kind.worst_transient_ratio, unjudged_text(kind));
  }
  if (!flown.empty())
    fmt::print("The same disturbances with attitude and rotors (SE(3)), outside the hypotheses:\n");
  for (const stability::FullLoopRun& run : flown) {
    const IssRun& of = check.runs[static_cast<std::size_t>(run.run)];
    const Eigen::Vector3d u = of.disturbance.rate_W_N_s.back().stableNormalized();
    fmt::print("  {:<14} along ({:+.0f} {:+.0f} {:+.0f}): ratio {:.4f}, tilt up to {:.1f} degrees{}\n",
               of.kind, u.x(), u.y(), u.z(), run.ratio, kDegrees * run.largest_tilt_rad, end_text(run));
  }
  print_verdict(options, check);
}

int run_iss_check(IssCheckOptions options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  const stability::FlownLoop loop = stability::load_flown_loop(options.gains, options.model);
  Progress progress(common.quiet);
  options.check.jobs = common.jobs;
  options.check.progress = [&progress](int done, int total) { progress.show(done, total, "integrations"); };
  const CancelOnInterrupt interrupt;
  options.check.cancelled = interrupt.flag();
  const IssCheck check = stability::check_iss(loop, options.check);
  const std::vector<stability::FullLoopRun> flown =
      check.cancelled ? std::vector<stability::FullLoopRun>{}
                      : stability::fly_full_loop(loop.gains, loop.model, check);
  const Json result = result_json(options, check, flown);
  write_result(common, result);
  if (common.prints_text()) print(options, check, flown);
  if (!options.report.empty()) {
    const std::string path = write_iss_check_report(check, result, options.report, common.force);
    if (common.prints_text()) fmt::print("report: {}\n", path);
  }
  if (check.is_refuted()) return kViolated;
  return check.why_inconclusive().empty() ? kDone : kInconclusive;
}

}  // namespace

Command iss_check_command() {
  return {
      "iss-check",
      "Attempt to falsify the tracking theorem's ball by integrating the loop under disturbances",
      "Integrates the continuous loop (SUNDIALS) under learning errors that change by at most d_m: "
      "ramps, the worst\n"
      "input of the linear loop, switching and random ones, random starts, and ones optimised with "
      "NLopt. Errors are\n"
      "compared with the ball d_m / (lambda_min(Lambda)^2 lambda_min(K)) and the transient bound. Exit "
      "code 1 with\n"
      "the disturbance if one is exceeded while every hypothesis holds; 4 if the theorem does not apply to "
      "the gains,\n"
      "or if runs leave its hypotheses (saturation, clamp, tilt) or cannot be integrated: such runs refute\n"
      "nothing. Finding no violation proves nothing: `bound` has the proved numbers.\n"
      "Example\n"
      "  swarmcert iss-check --gains controller/gains/composite.toml \\\n"
      "      --model stability/models/crazyflie-small.toml",
      [](CLI::App& app) {
        auto options = std::make_shared<IssCheckOptions>();
        app.add_option("--gains", options->gains, "gains.toml")->required();
        app.add_option("--model", options->model, "model.toml")->required();
        app.add_option("--runs", options->check.runs, "Integrations (default 200)")
            ->check(CLI::Range(5, 1000000));
        app.add_option("--rate", options->check.rate_N_s,
                       "d_m in N/s (default: a fifth of the weight over the settling time)")
            ->check(CLI::PositiveNumber);
        app.add_option("--seed", options->check.seed, "Seed of the random disturbances (default 0)");
        add_output(app, "--report", options->report, "Write an HTML report with plots into this folder");
        return [options](const CommonOptions& common) { return run_iss_check(*options, common); };
      }};
}

}  // namespace swarmcert::analysis
