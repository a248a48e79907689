#include "analysis/commands/bound/tube_output.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/cli/counted.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/bound/bound_output.h"
#include "analysis/report/report.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/suggest.h"

namespace swarmcert::analysis {
namespace {

using files::Json;

/// Number of points of the curves in the JSON result.
constexpr int kCurvePoints = 200;
/// Far above the lag of any motor; larger numbers are probably milliseconds.
constexpr double kLongestLag_s = 1;

}  // namespace

void declare_tube(CLI::App& app, TubeArguments& arguments) {
  auto* task = app.add_option(
      "--task", arguments.task,
      "Task for --tube (swap, hover); requires --network and --truth, contains --velocity-error and "
      "--position-error");
  app.add_option("--vehicles", arguments.vehicles, "Number of vehicles that fly --task (default 2)")
      ->check(CLI::Range(2, 10))
      ->needs(task);
  app.add_option("--duration", arguments.duration_s,
                 "Duration of --task, s, at most 60 (default: the task's own)")
      ->check(CLI::Range(0.1, 60.0))
      ->needs(task);
  app.add_option(
         "--lag-interval", arguments.motor_lag_s,
         "LOW HIGH: the motors of each vehicle that flies --task have a constant lag between these, s "
         "(default: the one of --truth, else of [lag])")
      ->expected(2)
      ->needs(task);
}

namespace {

/// Returns the interval of --lag-interval, which must contain the lag of the truth if it has one.
std::optional<Interval> lag_interval(const TubeArguments& arguments, const stability::Model& truth,
                                     const Tracking& tracking) {
  if (arguments.motor_lag_s.empty()) return std::nullopt;
  const Interval lag_s(arguments.motor_lag_s[0], arguments.motor_lag_s[1]);
  const std::string given = fmt::format("--lag-interval {:g} {:g}: ", lag_s.lower, lag_s.upper);
  if (!(lag_s.lower > 0 && lag_s.lower <= lag_s.upper && lag_s.upper <= kLongestLag_s)) {
    throw UsageError(given +
                     fmt::format("write the least and the largest lag in seconds, above 0 and at most {:g}",
                                 kLongestLag_s));
  }
  const double of_truth_s = TruthForce(truth, tracking.plant.largest_thrust_N).motor_lag_s();
  if (of_truth_s > 0 && !(of_truth_s >= lag_s.lower && of_truth_s <= lag_s.upper)) {
    throw UsageError(given +
                     fmt::format("the effect motor_lag of --truth has tau_s = {:.4g}, outside: take an "
                                 "interval that contains it, or another truth",
                                 of_truth_s));
  }
  return lag_s;
}

}  // namespace

MeasuredTruth load_measured_truth(const DisturbanceArguments& disturbance, const std::string& kind,
                                  double level) {
  if (disturbance.truth.empty())
    throw UsageError("--tube --task with --from: add --truth MODEL, the model that compare was run with");
  const std::string sha256 = files::sha256(files::read_file(disturbance.truth));
  const Json compared = files::read_json(disturbance.from, "swarmcert/compare/1");
  bool is_same = false;
  for (const Json& input : compared.value("inputs", Json::array()))
    is_same = is_same || (input.is_object() && input.value("sha256", "") == sha256);
  if (!is_same) {
    throw files::InputError(
        {disturbance.from, "", "inputs", files::in_quotes(disturbance.truth),
         "is not among the files that compare read: its residuals belong to another model",
         "give --truth the model of compare, or compare with this one"});
  }
  return read_measured_truth(disturbance.from, kind, level);
}

LocalTube load_local_tube(const TubeArguments& arguments, const DisturbanceArguments& disturbance,
                          const Tracking& tracking, const stability::DisturbanceSource& estimates,
                          const MeasuredTruth* measured, const CommonOptions& common,
                          std::vector<std::string>& inputs) {
  const std::vector<std::string> tasks = stability::task_names();
  if (std::find(tasks.begin(), tasks.end(), arguments.task) == tasks.end()) {
    throw UsageError("unknown task " + arguments.task + ": " + files::did_you_mean(arguments.task, tasks));
  }
  if (disturbance.network.file.empty() && disturbance.network.phi.empty()) {
    throw UsageError("a tube around a task needs the predictions of a network: add --network NET");
  }
  if (disturbance.truth.empty()) {
    throw UsageError(
        "a tube around a task needs the true force, since a network bounds only its own prediction: "
        "add --truth MODEL");
  }
  const std::unique_ptr<stability::Task> task =
      stability::make_task(arguments.task, {arguments.vehicles, arguments.duration_s, 0});
  if (!task->over(0, 0, 0)) {
    throw UsageError("--task " + arguments.task + ": its trajectories have no enclosure; take swap or hover");
  }
  const files::Network network = load_net(disturbance.network);
  std::vector<std::string> read = input_files(network);
  read.push_back(disturbance.truth);
  for (const std::string& path : read)
    if (std::find(inputs.begin(), inputs.end(), path) == inputs.end()) inputs.push_back(path);
  const stability::Model truth = stability::read_model(disturbance.truth);
  Progress progress(common.quiet);
  const CancelOnInterrupt interrupt;
  LocalTubeOptions options;
  // For n vehicles, n copies of the network with n - 1 neighbours are enclosed: fewer boxes, as each costs more.
  const int pairs = arguments.vehicles * (arguments.vehicles - 1);
  options.enclosure.boxes = std::max(1, 2 * options.enclosure.boxes / pairs);
  options.enclosure.jobs = common.jobs;
  options.enclosure.cancelled = interrupt.flag();
  for (int k = 0; k < 3; ++k) {
    options.estimates.velocity_m_s[k] = estimates.velocity_error[k].largest();
    options.estimates.position_m[k] = estimates.position_error[k].largest();
    if (!std::isfinite(options.estimates.velocity_m_s[k] + options.estimates.position_m[k])) {
      throw UsageError(
          "--tube --task needs the size of the errors of the estimates: add --velocity-error V and "
          "--position-error P");
    }
  }
  if (measured != nullptr) options.residual = &measured->envelope;
  options.motor_lag_s = lag_interval(arguments, truth, tracking);
  options.enclosure.progress = [&progress](int done, int total) {
    progress.show(done, total, "tube slice by slice");
  };
  return local_tube(tracking, truth, network, *task, arguments.vehicles, options);
}

namespace {

constexpr char kElsewhere[] = "the hull of all cells with flights";
constexpr char kLikeTheFlights[] =
    "a flight whose residual is drawn from the same distribution as in these flights: same vehicles, task "
    "and model";

std::string what_it_rests_on(const MeasuredTruth& measured) {
  return fmt::format(
      "forces are means over {:g} s, so that the ranges do not cover faster ones; neighbours are at "
      "their logged positions",
      measured.mean_s);
}

void describe_measured(files::Record& record, const MeasuredTruth& measured, const LocalTube& tube) {
  const ConformalThreshold& promise = measured.promise;
  int with_flights = 0;
  std::array<double, 3> widest_N{};
  for (const ResidualEnvelope::Cell& cell : measured.envelope.cells) {
    with_flights += cell.flights > 0 ? 1 : 0;
    for (std::size_t k = 0; k < 3; ++k) widest_N[k] = std::max(widest_N[k], cell.force_N[k].mag());
  }
  record.field("level", promise.level, "Probability with which a further flight keeps the tube.");
  record.field("flights", promise.flights, "That give scores.");
  record.field("shape_flights", measured.shape_flights, "That give the middle and the width in each cell.");
  record.field("interval", promise.coverage_90,
               "5 % and 95 % quantiles of the probability, given these flights.");
  record.field("factor", promise.threshold, "By which the widths of the shape are scaled.");
  record.field("largest_residual_N", widest_N, "", "N");
  record.field("mean_s", measured.mean_s, "Over which forces are averaged.", "s");
  record.field("cells_with_flights", with_flights, "");
  record.field("cells_in_tube", tube.residual_cells, "That vehicles in the tube can reach.");
  record.field("cells_in_tube_without_flights", tube.residual_cells_without_flights, "");
  record.field("elsewhere", kElsewhere, "What cells without flights use.");
  record.field("like_them", kLikeTheFlights, "Which flights are promised.");
  record.field("rests_on", what_it_rests_on(measured), "");
}

void print_measured(const MeasuredTruth& measured, const LocalTube& tube) {
  const ConformalThreshold& promise = measured.promise;
  fmt::print(
      "  a further flight like the {} that were compared keeps it with probability {:g} "
      "({:.3f} to {:.3f} for these flights, 90 %)\n",
      promise.flights + measured.shape_flights, promise.level, promise.coverage_90.lower,
      promise.coverage_90.upper);
  fmt::print(
      "  residual by the place of the neighbour: shape of {} flights, {:.3g} times as wide for {} others\n",
      measured.shape_flights, promise.threshold, promise.flights);
  fmt::print("  {} of the {} cells that the tube reaches have no such flight and use {}\n",
             tube.residual_cells_without_flights, tube.residual_cells, kElsewhere);
  fmt::print("  like them: {}\n  rests on: {}\n", kLikeTheFlights, what_it_rests_on(measured));
}

/// Ranges of the errors of all vehicles up to a time.
struct Curve {
  double until_s = 0;
  std::vector<std::array<Interval, 3>> error_xyz_m;
};

/// The slices of a proved tube, joined to about kCurvePoints.
std::vector<Curve> curves_of(const LocalTube& tube) {
  std::vector<Curve> curves;
  const std::size_t count = tube.proved ? tube.sliced.slices.size() : 0;
  const std::size_t every = std::max<std::size_t>(1, (count + kCurvePoints - 1) / kCurvePoints);
  for (std::size_t first = 0; first < count; first += every) {
    const std::size_t last = std::min(count, first + every);
    Curve curve{static_cast<double>(last) * tube.slice_s, {}};
    for (std::size_t i = 0; i < tube.whole.size(); ++i) {
      auto& range = curve.error_xyz_m.emplace_back(tube.sliced.slices[first][i].position_m);
      for (std::size_t n = first + 1; n < last; ++n)
        for (std::size_t k = 0; k < 3; ++k) range[k] = hull(range[k], tube.sliced.slices[n][i].position_m[k]);
    }
    curves.push_back(std::move(curve));
  }
  return curves;
}

std::array<double, 3> sizes(const std::array<Interval, 3>& ranges) {
  return {ranges[0].mag(), ranges[1].mag(), ranges[2].mag()};
}

std::array<double, 3> axes_of_estimates(const double (&values)[3]) {
  return {values[0], values[1], values[2]};
}

const char* loop_name(const LocalTube& tube) { return tube.is_sampled ? "sampled" : "continuous"; }

const char* verdict_name(const LocalTube& tube) { return tube.proved ? "proved" : "inconclusive"; }

}  // namespace

void describe(files::Record& record, const TaskTube& result) {
  const LocalTube& tube = result.tube;
  record.field("task", result.task, "");
  record.field("vehicles", result.vehicles, "");
  record.field("duration_s", tube.duration_s, "", "s");
  record.field("loop", loop_name(tube), "For which it holds: continuous or sampled.");
  record.field("velocity_error_m_s", axes_of_estimates(tube.estimates.velocity_m_s),
               "Of the estimates, for which it holds.", "m/s");
  record.field("position_error_m", axes_of_estimates(tube.estimates.position_m), "Likewise.", "m");
  record.field("motor_lag_s", tube.motor_lag_s, "Least and largest lag of the motors for which it holds.",
               "s");
  record.field("verdict", verdict_name(tube), "");
  record.may("why", tube.proved ? std::nullopt : std::optional(tube.why), "Why nothing was proved.");
  record.field("radius_m", tube.proved ? largest_position_m(tube.whole) : INFINITY,
               "Of all axes; null: not proved.", "m", "upper bound");
  std::optional<std::array<double, 3>> of_axes_m;
  if (tube.proved)
    of_axes_m = {largest_position_m(tube.whole, 0), largest_position_m(tube.whole, 1),
                 largest_position_m(tube.whole, 2)};
  record.field("radius_xyz_m", of_axes_m, "Null: not proved.", "m", "upper bound");
  record.field("interrupted", tube.cancelled, "");
  std::vector<std::size_t> vehicles;
  for (std::size_t i = 0; tube.proved && i < tube.whole.size(); ++i) vehicles.push_back(i);
  record.list("radii", vehicles, "Largest errors of every vehicle.",
              [&tube](files::Record& r, std::size_t i) {
                const Deviation one = i < tube.whole.size() ? tube.whole[i] : Deviation();
                const double force_N = i < tube.whole.size() ? tube.largest_force_error_N(i) : 0;
                r.field("vehicle", i + 1, "From 1.");
                r.field("position_m", sizes(one.position_m), "", "m", "upper bound");
                r.field("velocity_m_s", sizes(one.velocity_m_s), "", "m/s", "upper bound");
                r.field("force_error_N", force_N, "|f_hat - f_a| along z.", "N", "upper bound");
              });
  record.field("assumptions", tube.assumptions, "");
  const std::vector<Curve> curves = curves_of(tube);
  record.list("slices", curves, "Ranges of the errors over time.", [](files::Record& r, const Curve& curve) {
    r.field("until_s", curve.until_s, "", "s");
    r.field("error_xyz_m", curve.error_xyz_m, "Per vehicle and axis.", "m", "enclosure");
  });
  record.may_object(result.measured.has_value(), "measured",
                    "The residual of flights that the tube contains.", [&](files::Record& r) {
                      describe_measured(r, result.measured ? *result.measured : MeasuredTruth(), tube);
                    });
  record.list("at", curves, "Largest height errors over time.", [](files::Record& r, const Curve& curve) {
    std::vector<double> largest_m;
    for (const auto& range : curve.error_xyz_m) largest_m.push_back(range[2].mag());
    r.field("until_s", curve.until_s, "", "s");
    r.field("error_z_m", largest_m, "Per vehicle.", "m", "upper bound");
  });
}

void print(const TaskTube& result) {
  const LocalTube& tube = result.tube;
  fmt::print("\nTube around {} with {}, {:g} s, {} loop: {}\n", result.task,
             counted(static_cast<std::size_t>(result.vehicles), "vehicle"), tube.duration_s, loop_name(tube),
             verdict_name(tube));
  if (tube.proved) {
    fmt::print("  errors stay below x {:.4g} m, y {:.4g} m, z {:.4g} m\n", largest_position_m(tube.whole, 0),
               largest_position_m(tube.whole, 1), largest_position_m(tube.whole, 2));
    for (std::size_t i = 0; i < tube.whole.size(); ++i)
      fmt::print("  vehicle {}: |f_hat - f_a| <= {:.4g} N\n", i + 1, tube.largest_force_error_N(i));
    if (result.measured) print_measured(*result.measured, tube);
  } else {
    fmt::print("  {}\n", tube.why);
  }
  for (const stability::Assumption& a : tube.assumptions)
    fmt::print("  {:<8} {}{}\n", a.status, a.name, a.note.empty() ? "" : " (" + a.note + ")");
}

void add_plot(Report& report, const TaskTube& result) {
  const LocalTube& tube = result.tube;
  report.heading("Tube around the task");
  report.paragraph(fmt::format("{} with {}, {:g} s, {} loop: {}.", result.task,
                               counted(static_cast<std::size_t>(result.vehicles), "vehicle"), tube.duration_s,
                               loop_name(tube), verdict_name(tube)));
  if (!tube.proved) report.paragraph(tube.why + ".");
  if (!tube.proved) return;
  std::string data = "# until_s, then least and largest e_z per vehicle, m\n";
  for (const Curve& curve : curves_of(tube)) {
    data += fmt::format("{:.6g}", curve.until_s);
    for (const auto& range : curve.error_xyz_m)
      data += fmt::format(" {:.6g} {:.6g}", range[2].lower, range[2].upper);
    data += "\n";
  }
  std::string script = "set xlabel 'time [s]'\nset ylabel 'height error [m]'\nplot ";
  for (std::size_t i = 0; i < tube.whole.size(); ++i) {
    script += fmt::format(
        "{}'local_tube.dat' using 1:{} with fsteps linetype {} title 'cf{}', '' using 1:{} with "
        "fsteps linetype {} notitle",
        i == 0 ? "" : ", ", 2 * i + 2, i + 1, i + 1, 2 * i + 3, i + 1);
  }
  report.figure("local_tube", data, script + "\n",
                fmt::format("Proved range of the height error of each vehicle at each time, within {:.4g} m "
                            "over the whole flight.",
                            largest_position_m(tube.whole, 2)));
}

}  // namespace swarmcert::analysis
