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

ForceConstants worst_of(const TubeRow& row) {
  ForceConstants worst;
  for (const ForceConstants& c : row.constants) {
    worst.together = std::max(worst.together, c.together);
    worst.position = std::max(worst.position, c.position);
    worst.velocity = std::max(worst.velocity, c.velocity);
    worst.own = std::max(worst.own, c.own);
  }
  return worst;
}

void describe_verdict(files::Record& record, const LeastTube& tube) {
  using Radii = std::optional<std::array<double, 3>>;
  record.field("verdict", tube.proved ? "proved" : "inconclusive", "");
  record.may("why", tube.proved ? std::nullopt : std::optional(tube.why), "Why nothing was proved.");
  record.field("radius_m", tube.proved ? tube.radius_m() : INFINITY, "Of all axes; null: not proved.", "m",
               "upper bound");
  record.field("radius_xyz_m",
               tube.proved ? Radii({tube.radius_m(0), tube.radius_m(1), tube.radius_m(2)}) : Radii(),
               "Null: not proved.", "m", "upper bound");
  record.field("loop_gain", tube.loop_gain,
               "Factor by which an error adds to its own bound; below 1 proves.");
}

void describe_tube_row(files::Record& record, const TubeRow& row) {
  describe_verdict(record, row.tube);
  const ForceConstants worst = worst_of(row);
  record.object("lipschitz", "Largest of all vehicles; null: not part of this bound.",
                [&worst](files::Record& r) {
                  r.field("all_N", worst.together, "Per (m, m/s).", "N", "upper bound");
                  r.field("position_N_m", worst.position, "", "N/m", "upper bound");
                  r.field("velocity_N_s_m", worst.velocity, "", "N s/m", "upper bound");
                  r.field("own_N", worst.own, "", "N", "upper bound");
                });
}

void describe_force_error(files::Record& record, const ForceErrorBounds& b) {
  const auto bound = [&record](const char* name, double x_m) {
    record.field(name, x_m, "", "m", "upper bound");
  };
  record.field("vehicle", b.vehicle + 1, "From 1.");
  record.constant("axis", "z", "");
  record.object("force_error", "f_hat - f_a within the tube.", [&b](files::Record& r) {
    r.field("amplitude_N", b.amplitude_N, "", "N", "upper bound");
    r.field("rate_N_s", b.rate_N_s, "", "N/s", "upper bound");
    r.field("variation_N", b.variation_N, "", "N", "upper bound");
    r.field("impulse_N_s", b.impulse_N_s, "", "N s", "upper bound");
  });
  bound("rate", b.by_rate_m);
  bound("amplitude", b.by_amplitude_m);
  bound("edges", b.by_edges_m);
  bound("impulse", b.by_impulse_m);
  bound("slices", b.by_slices_m);
  bound("lag", b.lag_m);
  bound("minimum", b.least_m());
}

std::string radius_text(const LeastTube& tube) {
  return tube.proved ? fmt::format("{:.4g} m", tube.radius_m()) : std::string("none");
}

/// The combined tube, with the verdict of all results together.
LeastTube combined(const LocalTube& tube) {
  LeastTube all = tube.tube;
  all.proved = tube.proved;
  all.why = tube.why;
  return all;
}

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
  options.progress = [&progress](int done, int total, const std::string& what) {
    progress.show(done, total, what);
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
  const std::size_t count = tube.proved ? tube.slices.size() : 0;
  const std::size_t every = std::max<std::size_t>(1, (count + kCurvePoints - 1) / kCurvePoints);
  for (std::size_t first = 0; first < count; first += every) {
    const std::size_t last = std::min(count, first + every);
    Curve curve{static_cast<double>(last) * tube.slice_s, {}};
    for (std::size_t i = 0; i < tube.slices.front().size(); ++i) {
      auto& range = curve.error_xyz_m.emplace_back(tube.slices[first][i].position_m);
      for (std::size_t n = first + 1; n < last; ++n)
        for (std::size_t k = 0; k < 3; ++k) range[k] = hull(range[k], tube.slices[n][i].position_m[k]);
    }
    curves.push_back(std::move(curve));
  }
  return curves;
}

struct VehicleRadii {
  std::size_t vehicle = 0;
  std::array<double, 3> position_m{}, velocity_m_s{};
};

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
  describe_verdict(record, combined(tube));
  record.field("interrupted", tube.cancelled, "");
  std::vector<VehicleRadii> radii;
  for (std::size_t i = 0; tube.proved && i < tube.tube.radii.position_m.size(); ++i)
    radii.push_back({i + 1, tube.tube.radii.position_m[i], tube.tube.radii.velocity_m_s[i]});
  record.list("radii", radii, "Largest errors of every vehicle.",
              [](files::Record& r, const VehicleRadii& one) {
                r.field("vehicle", one.vehicle, "From 1.");
                r.field("position_m", one.position_m, "", "m", "upper bound");
                r.field("velocity_m_s", one.velocity_m_s, "", "m/s", "upper bound");
              });
  for (const char* const name : {"product", "global", "local"}) {
    const auto row = std::find_if(tube.rows.begin(), tube.rows.end(),
                                  [name](const TubeRow& one) { return one.name == name; });
    const bool is_present = row != tube.rows.end();
    record.may_object(is_present, name, "What a Lipschitz bound of the network alone would prove.",
                      [&](files::Record& r) { describe_tube_row(r, is_present ? *row : TubeRow()); });
  }
  record.list("bounds", tube.bounds, "Of the error along z, by class of the force error; null: not bounded.",
              describe_force_error);
  record.field("assumptions", tube.assumptions, "");
  const std::vector<Curve> curves = curves_of(tube);
  record.list("slices", curves, "Ranges of the errors over time.", [](files::Record& r, const Curve& curve) {
    r.field("until_s", curve.until_s, "", "s");
    r.field("error_xyz_m", curve.error_xyz_m, "Per vehicle and axis.", "m", "enclosure");
  });
  record.object("one_radius", "With one radius for the whole flight.",
                [&tube](files::Record& r) { describe_verdict(r, tube.one_radius); });
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
    fmt::print("  errors stay below x {:.4g} m, y {:.4g} m, z {:.4g} m\n", tube.tube.radius_m(0),
               tube.tube.radius_m(1), tube.tube.radius_m(2));
    fmt::print("  with one radius for the whole flight: {} (loop gain {:.3g})\n",
               radius_text(tube.one_radius), tube.one_radius.loop_gain);
    const auto number = [](double x) {
      return std::isfinite(x) ? fmt::format("{:.4g}", x) : std::string("-");
    };
    for (const ForceErrorBounds& b : tube.bounds) {
      fmt::print(
          "  vehicle {}: |f_hat - f_a| <= {} N, rate {} N/s, int {} N s; error by rate {}, amplitude {}, "
          "edges {}, impulse {}, slices {} m\n",
          b.vehicle + 1, number(b.amplitude_N), number(b.rate_N_s), number(b.impulse_N_s),
          number(b.by_rate_m), number(b.by_amplitude_m), number(b.by_edges_m), number(b.by_impulse_m),
          number(b.by_slices_m));
    }
    if (result.measured) print_measured(*result.measured, tube);
  } else {
    fmt::print("  {}\n", tube.why);
  }
  for (const TubeRow& row : tube.rows) {
    const ForceConstants worst = worst_of(row);
    const std::string constants =
        std::isfinite(worst.position)
            ? fmt::format("{:.4g} N/m, {:.4g} N s/m", worst.position, worst.velocity)
            : fmt::format("{:.4g} N per (m, m/s)", worst.together);
    fmt::print("  {:<8} Lipschitz bound alone, {}: radius {} (loop gain {:.3g})\n", row.name, constants,
               radius_text(row.tube), row.tube.loop_gain);
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
  std::vector<std::vector<std::string>> rows;
  rows.push_back({"difference of both forces, slice by slice", radius_text(combined(tube)), "any"});
  rows.push_back({"difference of both forces, one radius", radius_text(tube.one_radius),
                  fmt::format("{:.3g}", tube.one_radius.loop_gain)});
  for (const TubeRow& row : tube.rows) {
    rows.push_back({row.name + " Lipschitz bound alone", radius_text(row.tube),
                    fmt::format("{:.3g}", row.tube.loop_gain)});
  }
  report.table({"force error from", "radius", "loop gain"}, rows);
  if (!tube.proved) return;
  std::string data = "# until_s, then least and largest e_z per vehicle, m\n";
  for (const Curve& curve : curves_of(tube)) {
    data += fmt::format("{:.6g}", curve.until_s);
    for (const auto& range : curve.error_xyz_m)
      data += fmt::format(" {:.6g} {:.6g}", range[2].lower, range[2].upper);
    data += "\n";
  }
  std::string script = "set xlabel 'time [s]'\nset ylabel 'height error [m]'\nplot ";
  for (std::size_t i = 0; i < tube.slices.front().size(); ++i) {
    script += fmt::format(
        "{}'local_tube.dat' using 1:{} with fsteps linetype {} title 'cf{}', '' using 1:{} with "
        "fsteps linetype {} notitle",
        i == 0 ? "" : ", ", 2 * i + 2, i + 1, i + 1, 2 * i + 3, i + 1);
  }
  report.figure("local_tube", data, script + "\n",
                fmt::format("Proved range of the height error of each vehicle at each time, within {:.4g} m "
                            "over the whole flight.",
                            tube.tube.radius_m(2)));
}

}  // namespace swarmcert::analysis
