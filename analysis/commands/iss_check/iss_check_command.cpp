#include <fmt/core.h>
#include <fmt/ranges.h>

#include <array>
#include <cmath>
#include <map>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/counted.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/commands/iss_check/iss_check_report.h"
#include "nn/base/input_error.h"
#include "nn/base/pi.h"
#include "stability/bounds/declared_disturbance.h"
#include "stability/iss/iss_full_loop.h"

namespace swarmcert::analysis {
namespace {

using stability::IssCheck;
using stability::IssRun;

struct IssCheckOptions {
  std::string gains, model, report, disturbance;
  stability::IssOptions check;
};

constexpr double kDegrees = 180 / kPi;

std::array<double, 3> three_numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

const char* verdict(const IssCheck& check) {
  if (check.is_refuted()) return "refuted";
  return check.why_inconclusive().empty() ? "none_found" : "inconclusive";
}

struct KindSummary {
  std::string name;
  int runs = 0, violations = 0, left = 0, failed = 0;
  double worst_ratio = 0, worst_transient_ratio = 0;
};

std::vector<KindSummary> by_kind(const IssCheck& check) {
  std::map<std::string, KindSummary> kinds;
  for (const IssRun& run : check.runs) {
    KindSummary& kind = kinds[run.kind];
    kind.name = run.kind;
    ++kind.runs;
    kind.violations += run.is_violation ? 1 : 0;
    kind.left += run.left.empty() ? 0 : 1;
    kind.failed += run.failure.empty() ? 0 : 1;
    kind.worst_ratio = std::max(kind.worst_ratio, run.ratio);
    kind.worst_transient_ratio = std::max(kind.worst_transient_ratio, run.transient_ratio);
  }
  std::vector<KindSummary> all;
  for (const auto& [name, kind] : kinds) all.push_back(kind);
  return all;
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

struct IssCheckResult {
  int runs = 0;  ///< asked for
  IssCheck check;
  std::vector<stability::FullLoopRun> flown;
};

/// A piece of a disturbance with a constant rate.
struct Piece {
  double until_s = 0;
  Eigen::Vector3d rate_N_s = Eigen::Vector3d::Zero();
};

std::optional<std::string> text_or_null(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional<std::string>(text);
}

/// Fields of a run of either loop.
template <class Run>
void describe_end(files::Record& record, const Run& run) {
  record.field("left_hypothesis", text_or_null(run.left),
               "Hypothesis of the theorem that it left; null: none.");
  record.field("left_at_s", run.left.empty() ? std::nullopt : std::optional<double>(run.left_at_s),
               "When it left it; null: never.", "s");
  record.field("failure", text_or_null(run.failure), "Why it could not be integrated; null: it was.");
}

void describe_run(files::Record& record, const IssRun& run) {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < run.disturbance.until_s.size(); ++i)
    pieces.push_back({run.disturbance.until_s[i], run.disturbance.rate_W_N_s[i]});
  record.field("disturbance", run.kind, "Its kind.");
  record.field("ratio", run.ratio, "Largest error over the ball.", "", "lower bound of what is possible");
  record.field("transient_ratio", run.transient_ratio, "Largest error over the transient bound.");
  record.field("largest_error_m", run.largest_m, "Norm of the position error.", "m");
  record.field("at_s", run.at_s, "When it was reached.", "s");
  describe_end(record, run);
  record.field("initial_position_error_m", three_numbers(run.position_m), "World frame.", "m");
  record.field("initial_velocity_error_m_s", three_numbers(run.velocity_m_s), "World frame.", "m/s");
  record.field("bias_N", three_numbers(run.disturbance.bias_W_N), "Disturbance at the start, world frame.",
               "N");
  record.list("pieces", pieces, "Of the disturbance.", [](files::Record& one, const Piece& piece) {
    one.field("until_s", piece.until_s, "End of the piece.", "s");
    one.field("rate_N_s", three_numbers(piece.rate_N_s), "World frame.", "N/s");
  });
}

void describe_disturbance_kind(files::Record& record, const KindSummary& kind) {
  record.field("disturbance", kind.name, "Its kind.");
  record.field("runs", kind.runs, "Runs that were made.");
  record.field("violations", kind.violations, "Runs that left the ball or the transient bound.");
  record.field("left_hypotheses", kind.left,
               "Runs that left a hypothesis of the theorem; they refute nothing.");
  record.field("failed", kind.failed, "Runs that could not be integrated.");
  record.field("worst_ratio", kind.worst_ratio, "Largest error over the ball.");
  record.field("worst_transient_ratio", kind.worst_transient_ratio,
               "Largest error over the transient bound.");
}

/// A run with attitude and rotors, and the one without that has the same disturbance.
struct FullRun {
  stability::FullLoopRun run;
  IssRun of;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
};

std::vector<FullRun> full_runs(const IssCheckResult& result) {
  std::vector<FullRun> all;
  for (const stability::FullLoopRun& run : result.flown) {
    const IssRun& of = result.check.runs[static_cast<std::size_t>(run.run)];
    all.push_back({run, of, of.disturbance.rate_W_N_s.back().stableNormalized()});
  }
  return all;
}

void describe_full_run(files::Record& record, const FullRun& full) {
  record.field("disturbance", full.of.kind, "Its kind.");
  record.field("direction", three_numbers(full.direction), "Of its last piece, world frame.");
  record.field("ratio", full.run.ratio, "Largest error over the ball.");
  record.field("ratio_without_attitude", full.of.ratio, "The same of the position loop alone.");
  record.field("at_s", full.run.at_s, "When the largest error was reached.", "s");
  record.field("largest_tilt_deg", kDegrees * full.run.largest_tilt_rad, "Largest tilt.", "deg");
  describe_end(record, full.run);
}

void describe(files::Record& record, const IssCheckResult& result) {
  const IssCheck& check = result.check;
  record.field("loop", "continuous position loop with the declared lags, clamps and thrust limit",
               "The loop that was integrated.");
  record.field("delay_left_out_s", check.delay_left_out_s, "Delay of the gains that this loop does not have.",
               "s");
  record.object("theorem", "Whether the theorem applies.", [&](files::Record& theorem) {
    theorem.field("applies", check.theorem_applies, "Whether all its hypotheses hold.");
    theorem.field("why_not", check.why_not, "Hypotheses that do not hold.");
  });
  record.field("rate_N_s", check.rate_N_s, "Bound on the rate of the disturbance.", "N/s");
  record.field("ball_m", check.ball_m, "Radius of the ball that was to be left.", "m");
  record.field("ball_from",
               check.has_ball ? "theorem" : "smallest eigenvalues or m Ki: the gains lack the theorem's form",
               "What gives the ball.");
  record.field("duration_s", check.duration_s, "Of each run.", "s");
  record.field("runs", result.runs, "Runs that were asked for.");
  record.field("reported_runs", check.runs.size(), "Runs that were made, of all kinds.");
  record.field("violations", check.violations, "Runs that left the ball or the transient bound.");
  record.field("left_hypotheses", check.left,
               "Runs that left a hypothesis of the theorem; they refute nothing.");
  record.field("failed", check.failed, "Runs that could not be integrated.");
  record.field("worst_ratio", check.worst_ratio, "Largest error over the ball.");
  record.field("worst_transient_ratio", check.worst_transient_ratio,
               "Largest error over the transient bound.");
  record.list("kinds", by_kind(check), "The same by kind of disturbance.", describe_disturbance_kind);
  const IssRun* const shown = witness(check);
  record.object_or_null(shown != nullptr, "worst", "The most significant run; null: no runs.",
                        [&](files::Record& run) { describe_run(run, shown != nullptr ? *shown : IssRun{}); });
  record.object("full_loop", "The same disturbances with attitude and rotors, outside the hypotheses.",
                [&](files::Record& full) {
                  double worst = 0;
                  for (const stability::FullLoopRun& run : result.flown) worst = std::max(worst, run.ratio);
                  full.field("worst_ratio", worst, "Largest error over the ball.");
                  full.list("runs", full_runs(result), "One per disturbance.", describe_full_run);
                });
  record.field("verdict", verdict(check),
               "refuted: a run left the ball under the theorem's hypotheses; none_found; inconclusive.");
  record.field("why_inconclusive", check.why_inconclusive(), "Why nothing is concluded.");
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
           const std::vector<stability::FullLoopRun>& flown, const files::Node& described) {
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
  fmt::print("{}", to_text(iss_kinds_table(described)));
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

/// Returns the bound on the rate that a disturbance.toml declares.
double rate_of(const std::string& path) {
  stability::DisturbanceSource source;
  stability::read_disturbance_file(path, source);
  if (!(source.rate_norm_N_s > 0) || std::isinf(source.rate_norm_N_s))
    throw files::InputError(
        {path, "", "rate_N_s", "", "is missing or 0",
         "state how fast the learning error can change: the theorem's ball is proportional to it"});
  return source.rate_norm_N_s;
}

int run_iss_check(IssCheckOptions options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_folder(common, options.report);
  const stability::FlownLoop loop = stability::load_flown_loop(options.gains, options.model);
  std::vector<std::string> inputs = {options.gains, options.model};
  if (!options.disturbance.empty()) {
    inputs.push_back(options.disturbance);
    options.check.rate_N_s = rate_of(options.disturbance);
  }
  Progress progress(common.quiet);
  options.check.jobs = common.jobs;
  options.check.progress = [&progress](int done, int total) { progress.show(done, total, "integrations"); };
  const CancelOnInterrupt interrupt;
  options.check.cancelled = interrupt.flag();
  const IssCheck check = stability::check_iss(loop, options.check);
  const std::vector<stability::FullLoopRun> flown =
      check.cancelled ? std::vector<stability::FullLoopRun>{}
                      : stability::fly_full_loop(loop.gains, loop.model, check);
  const files::Node described =
      result_of("iss-check", inputs, options.check.seed, IssCheckResult{options.check.runs, check, flown});
  write_result(common, described);
  if (common.prints_text()) print(options, check, flown, described);
  if (!options.report.empty()) {
    const std::string path = write_iss_check_report(check, described, options.report, common.force);
    if (common.prints_text()) fmt::print("report: {}\n", path);
  }
  const bool is_open = check.is_refuted() || !check.why_inconclusive().empty();
  print_next(common,
             is_open ? std::vector<std::string>{"bound", "--gains", options.gains, "--model", options.model,
                                                "--details"}
                     : std::vector<std::string>{"simulate", "random-walk", "--vehicles", "2", "--gains",
                                                options.gains, "--model", options.model, "-o", "flights"});
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
        auto* const rate =
            app.add_option("--rate", options->check.rate_N_s,
                           "d_m in N/s (default: a fifth of the weight over the settling time)")
                ->check(CLI::PositiveNumber);
        app.add_option("--disturbance", options->disturbance, "disturbance.toml, of which rate_N_s counts")
            ->excludes(rate);
        app.add_option("--seed", options->check.seed, "Seed of the random disturbances (default 0)");
        add_output(app, "--report", options->report, "Write an HTML report with plots into this folder");
        return [options](const CommonOptions& common) { return run_iss_check(*options, common); };
      },
      fields_of<IssCheckResult>()};
}

}  // namespace swarmcert::analysis
