#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "analysis/cli/command_line.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/bound/bound_answer.h"
#include "analysis/commands/bound/bound_attitude.h"
#include "analysis/commands/bound/bound_output.h"
#include "analysis/commands/bound/bound_promise.h"
#include "analysis/commands/bound/bound_report.h"
#include "analysis/commands/bound/disturbance_input.h"
#include "analysis/commands/bound/float_errors.h"
#include "analysis/commands/bound/swarm_bound.h"
#include "analysis/commands/bound/tracking_certificate.h"
#include "analysis/commands/bound/tube_output.h"
#include "analysis/commands/bound/tube_over_time.h"
#include "analysis/commands/bound/uncertain.h"
#include "analysis/commands/commands.h"
#include "nn/base/file_io.h"

namespace swarmcert::analysis {
namespace {

struct BoundOptions {
  TrackingArguments tracking;
  DisturbanceArguments disturbance;
  stability::InitialError initial;
  std::vector<std::string> uncertain;
  bool is_uncertain = false;
  int most_loops = UncertainRun{}.most_loops;
  double coverage = 0;   ///< 0: no promise
  std::string attitude;  ///< empty: no attitude loop
  bool verified = false;
  std::string certificate;  ///< file to write; empty: none
  bool tube = false;
  TubeArguments task;
  std::string swarm;
  bool details = false;
  std::string report;
};

/// Rejects options that work axis by axis if axes are coupled: they need single-axis loops.
void refuse_coupled_axes(const BoundOptions& options, const Tracking& input) {
  const char* const asked = options.is_uncertain ? "--uncertain"
                            : options.verified   ? "--verified"
                            : options.tube       ? "--tube"
                                                 : nullptr;
  if (asked == nullptr) return;
  for (int axis = 0; axis < 3; ++axis) {
    if (input.continuous(axis)) return;
  }
  throw UsageError(std::string(asked) + ": Lambda or K of " + options.tracking.gains +
                   " couples all axes, and this bounds the loop of one axis at a time; leave " + asked +
                   " out, or make Lambda and K diagonal");
}

bool has_initial(const stability::InitialError& initial) {
  return initial.position_m != 0 || initial.velocity_m_s != 0 || initial.learning_error_N != 0;
}

/// With a thrust ratio r other than 1 the acceleration feedforward leaves the force (r - 1) m p_d'', which a bound on
/// the jerk does not limit.
void refuse_jerk_of_scaled_thrust(const stability::DisturbanceSource& source, const Tracking& input) {
  if (source.thrust_ratio_error > 0 && source.has_moving_reference()) {
    throw UsageError(
        "thrust_ratio_error: it also scales the acceleration that a moving set point feeds forward, which "
        "reference_step_m, reference_speed_step_m_s and reference_jerk_m_s3 do not bound: leave one of them "
        "out");
  }
  for (const stability::ReferenceMotion& motion : source.reference) {
    if (motion.jerk_m_s3 == 0 || input.plant.thrust_scale == 1) continue;
    throw UsageError(fmt::format(
        "reference_jerk_m_s3: the thrust ratio {} of the model scales the acceleration that is fed "
        "forward, which leaves a force that the jerk does not limit; add it to --amplitude, with "
        "a model without the ratio",
        input.plant.thrust_scale));
  }
}

/// Rejects inputs that the tubes or the swarm bound would ignore: the tubes start from rest, and the tube around a
/// task knows only the force of the declared truth.
void refuse_what_is_left_out(const BoundOptions& options, const stability::DisturbanceSource& source) {
  const auto refuse = [](const char* what, const char* without) {
    throw UsageError(fmt::format("{} does not contain {}: leave one of them out", what, without));
  };
  const bool has_task = !options.task.task.empty();
  const char* const asked = has_task ? "--tube --task" : options.tube ? "--tube" : nullptr;
  if (source.thrust_ratio_error > 0 && (asked != nullptr || !options.swarm.empty()))
    refuse(asked != nullptr ? asked : "--swarm", "thrust_ratio_error of --disturbance");
  if ((asked != nullptr || !options.swarm.empty()) && source.has_moving_reference()) {
    refuse(asked != nullptr ? asked : "--swarm", "the moving set point of --disturbance");
  }
  if (asked != nullptr && has_initial(options.initial)) {
    refuse(asked, "--initial-error, --initial-speed and --initial-learning-error, as it starts from rest");
  }
  const auto has_force = [&source](int axis) {
    return source.axis[axis].amplitude_N != 0 || source.bias_N[axis] != 0;
  };
  if (has_task && (source.kind == "measured" ||
                   (source.kind == "declared" && (has_force(0) || has_force(1) || has_force(2))))) {
    refuse(asked, "the force error of --rate, --amplitude, --edge, --impulse, --bias or --from");
  }
}

/// Returns the declared force and appends the files it was read from to `inputs`.
LoadedDisturbance checked_disturbance(const BoundOptions& options, const Tracking& input,
                                      std::vector<std::string>& inputs) {
  const bool has_task = !options.task.task.empty();
  if (has_task && !options.tube) throw UsageError("--task requires --tube");
  DisturbanceArguments told = options.disturbance;
  if (has_task && options.coverage > 0) told.from.clear();  // measured beside --truth, not a class of its own
  // The tube bounds the motion of the vehicles itself; without --speed no other bounds are stated.
  if (has_task && told.speed < 0) told.network = {}, told.truth.clear(), told.certificate.clear();
  LoadedDisturbance disturbance = load_disturbance(told, input);
  stability::DisturbanceSource& source = disturbance.source;
  if (has_initial(options.initial) && source.kind == "none") declare_no_class(source);
  refuse_what_is_left_out(options, source);
  refuse_jerk_of_scaled_thrust(source, input);
  inputs.insert(inputs.end(), disturbance.inputs.begin(), disturbance.inputs.end());
  const bool has_size = std::any_of(std::begin(source.axis), std::end(source.axis), [](const auto& d) {
    return std::isfinite(d.amplitude_N) || std::isfinite(d.impulse_N_s);
  });
  if (options.tube && !has_task && !has_size)
    throw UsageError("--tube needs a force of known size: --amplitude E or --impulse J, --from or --truth");
  return disturbance;
}

Uncertain uncertain_result(const BoundOptions& options, const Tracking& input, const CommonOptions& common) {
  const CancelOnInterrupt interrupt;
  Progress progress(common.quiet);
  UncertainRun run;
  run.jobs = common.jobs;
  run.most_loops = options.most_loops;
  run.progress = [&progress](int done, int total) {
    progress.show(done, total, "of the enclosures over the intervals");
  };
  run.cancelled = interrupt.flag();
  return uncertain_gains(input, options.uncertain, run);
}

struct BoundResult {
  BoundAnswer answer;
  TrackingResult tracking;
  stability::FloatErrors float32;
  std::optional<Truth> truth;
  // What was requested in addition to the bounds:
  std::optional<Uncertain> uncertain;
  std::optional<CoverageBound> coverage;
  std::optional<std::vector<stability::AttitudeRow>> attitude;
  std::optional<VerifiedGains> verified;
  std::optional<std::vector<AxisTube>> tube;
  std::optional<TaskTube> local_tube;
  std::optional<SwarmBound> swarm;
  std::optional<TrackingCertificate> certificate;
};

void describe(files::Record& record, const BoundResult& result) {
  record.field("answer", result.answer, "Does this loop fly, and how large can its error become?");
  describe(record, result.tracking);
  record.field("float32", result.float32, "Error of the controller's own float32 arithmetic.");
  record.may("truth", result.truth, "The declared truth, enclosed.");
  record.may("uncertain", result.uncertain, "Worst gains over intervals of the parameters.");
  record.may("coverage", result.coverage, "A bound for a further flight, with the flights that it rests on.");
  record.may("attitude", result.attitude, "Margins and gains of the position loop around the attitude loop.");
  record.may("verified", result.verified, "Gains, enclosed in interval arithmetic.");
  record.may("tube", result.tube, "Bound of every error over time, from rest.");
  record.may("local_tube", result.local_tube, "The tube around a task flown by several vehicles.");
  record.may("swarm", result.swarm, "Stability of vehicles that disturb one another.");
  record.may_object(result.certificate.has_value(), "certificate", "Certificate of the gains, with -o.",
                    [&result](files::Record& r) {
                      describe_certificate(r, result.certificate.value_or(TrackingCertificate{}));
                    });
}

/// Computes the results requested in addition to the bounds.
void add_extras(const BoundOptions& options, const CommonOptions& common, const Tracking& input,
                BoundResult& result) {
  const stability::DisturbanceSource& source = result.tracking.source;
  if (options.is_uncertain) result.uncertain = uncertain_result(options, input, common);
  if (options.coverage > 0 && !(result.local_tube && result.local_tube->measured)) {
    // Only what was given on the command line is added to the classes of the file.
    DisturbanceArguments others = options.disturbance;
    others.from.clear();
    result.coverage = promise_of(input, result.tracking.report, load_disturbance(others, input).source,
                                 options.initial, options.disturbance.from, options.coverage);
  }
  if (input.gains.attitude) result.attitude = attitude_rows(input);
  if (options.verified) result.verified = verified_gains(input);
  if (options.tube) result.tube = tubes_over_time(input, source, 101);
  if (!options.swarm.empty()) result.swarm = swarm_bound(input, options.swarm, source);
}

void print_extras(const BoundResult& result) {
  if (result.uncertain) print(*result.uncertain);
  if (result.coverage) print(*result.coverage);
  if (result.attitude) print(*result.attitude);
  if (result.verified) print(*result.verified);
  if (result.local_tube) print(*result.local_tube);
  if (result.tube) fmt::print("\nthe tube over time is in the JSON result (--json)\n");
  if (result.swarm) print(*result.swarm);
}

/// Searches for the tube around the task, calibrated by the flights of --from with --coverage.
TaskTube task_tube(const BoundOptions& options, const Tracking& input,
                   const stability::DisturbanceSource& source, const CommonOptions& common,
                   std::vector<std::string>& inputs) {
  TaskTube result;
  result.task = options.task.task;
  result.vehicles = options.task.vehicles;
  if (options.coverage > 0) {
    result.measured = load_measured_truth(options.disturbance, input.model.kind, options.coverage);
    inputs.push_back(options.disturbance.from);
  }
  result.tube = load_local_tube(options.task, options.disturbance, input, source,
                                result.measured ? &*result.measured : nullptr, common, inputs);
  return result;
}

int exit_code(const BoundResult& result) {
  const bool is_refuted = result.swarm && result.swarm->found.is_refuted();
  if (result.answer.flies == false || is_refuted) return kViolated;
  const bool is_proved = (!result.swarm || result.swarm->found.small_gain.proved) &&
                         (!result.local_tube || result.local_tube->tube.proved);
  return is_proved ? exit_code(result.answer) : kInconclusive;
}

int run_bound(const BoundOptions& options, const CommonOptions& common) {
  refuse_to_replace(common, common.json);
  refuse_to_replace(common, options.certificate);
  refuse_folder(common, options.report);
  Tracking input = load_tracking(options.tracking);
  state_attitude_gains(options.attitude, input);
  refuse_coupled_axes(options, input);
  std::vector<std::string> inputs = {options.tracking.gains, options.tracking.model};
  if (!options.swarm.empty()) inputs.push_back(options.swarm);
  const LoadedDisturbance disturbance = checked_disturbance(options, input, inputs);
  const stability::DisturbanceSource& source = disturbance.source;
  BoundResult result;
  if (!options.task.task.empty()) result.local_tube = task_tube(options, input, source, common, inputs);
  result.tracking = {input.plant.mass_kg, input.plant.thrust_scale, source,
                     tracking_bounds(input, source, options.initial)};
  stability::TrackingReport& report = result.tracking.report;
  result.float32 = float_errors(input, report);
  for (stability::AxisBounds& row : report.bounds) row.float32_m = result.float32.tracking_error_m[row.axis];
  result.answer = bound_answer(input, source, options.initial, report);
  result.truth = disturbance.truth;
  add_extras(options, common, input, result);
  if (!options.certificate.empty()) {
    result.certificate = tracking_certificate(input, options.tracking, *result.verified);
    if (!result.certificate->has_no_gain())
      files::write_file(options.certificate,
                        files::to_text(files::to_json(files::record_of(*result.certificate))), common.force);
  }
  const files::Node described = result_of("bound", inputs, std::nullopt, result);
  std::string report_path;
  if (!options.report.empty())
    report_path = write_bound_report(input, disturbance, report, result.local_tube, described, options.report,
                                     common.force);
  write_result(common, described);
  if (common.prints_text()) {
    print_answer(input, result.answer);
    if (options.details) {
      print_tracking(input, source, report);
      print(result.float32);
      if (result.truth) print(*result.truth);
    }
    print_extras(result);
    if (result.certificate) print_certificate_summary(*result.certificate, options.certificate);
    if (!report_path.empty()) fmt::print("\nreport: {}\n", report_path);
  }
  const bool flies = result.answer.flies.value_or(false);
  print_next(common, {flies ? "iss-check" : "tune", "--gains", options.tracking.gains, "--model",
                      options.tracking.model});
  return exit_code(result);
}

void declare_initial(CLI::App& app, stability::InitialError& initial) {
  app.add_option("--initial-error", initial.position_m, "|e| at t = 0, m")->check(CLI::NonNegativeNumber);
  app.add_option("--initial-speed", initial.velocity_m_s, "|e'| at t = 0, m/s")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--initial-learning-error", initial.learning_error_N,
                 "|f_hat - f_a| at t = 0, bias included, N")
      ->check(CLI::NonNegativeNumber);
}

/// Declares the options for additional results.
/// @return the option --uncertain, whose intervals are optional.
CLI::Option* declare_extras(CLI::App& app, BoundOptions& options) {
  CLI::Option* const uncertain =
      app.add_option("--uncertain", options.uncertain,
                     "Worst over intervals: mass=A:B, thrust=A:B, lag=A:B, delay=A:B, "
                     "battery=A:B; alone: 5 %, 10 %, 20 %, 20 %")
          ->expected(0, -1)
          ->default_str("default");
  app.add_option("--loops", options.most_loops,
                 "Maximum number of loops evaluated per row of --uncertain; results remain valid "
                 "bounds if the limit is reached")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  declare_attitude(app, options.attitude);
  app.add_option("--coverage", options.coverage,
                 "Bound that a further flight exchangeable with those of --from keeps with this probability "
                 "(split-conformal prediction over flights); with --tube --task, the tube, where --truth "
                 "must be the model that compare used")
      ->check(CLI::Range(0.5, 0.999))
      ->needs("--from");
  app.add_flag("--verified", options.verified, "Rigorous enclosures of the gains (intervals)");
  add_output(app, "-o,--output", options.certificate,
             "File for a certificate of the gains of --verified, for check: continuous and sampled loops")
      ->needs("--verified");
  app.add_flag("--tube", options.tube,
               "Bound of |e(t)| over time, from rest (JSON); with --task: the least tube around its "
               "trajectories that the network and the truth prove");
  declare_tube(app, options.task);
  app.add_option("--swarm", options.swarm,
                 "swarm.toml: do the vehicles' mutual forces stay bounded? Errors of the estimates, "
                 "--amplitude, --rate and --bias count");
  app.add_flag("--details", options.details,
               "Print the tables: theorem, gains, bounds, and what they rest on");
  add_output(app, "--report", options.report, "Write an HTML report with plots into this folder");
  return uncertain;
}

}  // namespace

Command bound_command() {
  return {
      "bound", "Tracking error that gains and a vehicle give under a bounded force error",
      "Answers first: does this loop fly under all that is declared, how large can its error become, what "
      "does that\n"
      "rest on, what limits it. Exit code 0: it flies; 1: it diverges, or a declared input saturates the "
      "thrust; 4:\n"
      "undecided. --details adds whether the tracking theorem applies or why not, its ball, the exact gains "
      "of every\n"
      "axis for the continuous and the sampled loop, and, for a declared or measured force error, the "
      "smallest of\n"
      "five bounds, each with the bias, the initial error and the errors of the estimates that are "
      "declared.\n"
      "A certificate or a network bounds the rate of f_hat only and gives no ball; --truth declares the "
      "true force\nand encloses its constants; --from takes measured quantiles.\n\n"
      "Example: swarmcert bound --gains controller/gains/crazyflie-small.toml --model "
      "stability/models/crazyflie-small.toml \\\n"
      "           --amplitude 0.097 --impulse 0.0202 --rate 0.75\n"
      "         swarmcert bound --gains controller/gains/composite.toml --model "
      "stability/models/crazyflie-small.toml --tube --task swap \\\n"
      "           --network nn/networks/demo/network.toml --truth "
      "stability/models/crazyflie-small-effects.toml",
      [](CLI::App& app) {
        const auto options = std::make_shared<BoundOptions>();
        declare_tracking(app, options->tracking);
        declare_disturbance(app, options->disturbance);
        declare_initial(app, options->initial);
        const CLI::Option* const uncertain = declare_extras(app, *options);
        return [options, uncertain](const CommonOptions& common) {
          options->is_uncertain = uncertain->count() > 0;
          return run_bound(*options, common);
        };
      },
      fields_of<BoundResult>()};
}

}  // namespace swarmcert::analysis
