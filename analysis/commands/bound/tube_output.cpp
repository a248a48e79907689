#include "analysis/commands/bound/tube_output.h"

#include <fmt/core.h>

#include <algorithm>
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

Json radii_json(const LeastTube& tube) {
  if (!tube.proved) return Json();
  return {tube.radius_m(0), tube.radius_m(1), tube.radius_m(2)};
}

Json verdict_json(const LeastTube& tube) {
  Json json = {{"verdict", tube.proved ? "proved" : "inconclusive"}};
  if (!tube.proved) json["why"] = tube.why;
  json["radius_m"] = tube.proved ? finite(tube.radius_m()) : Json();
  json["radius_xyz_m"] = radii_json(tube);
  json["loop_gain"] = finite(tube.loop_gain);
  return json;
}

Json tube_row_json(const TubeRow& row) {
  Json json = verdict_json(row.tube);
  ForceConstants worst;
  for (const ForceConstants& c : row.constants) {
    worst.together = std::max(worst.together, c.together);
    worst.position = std::max(worst.position, c.position);
    worst.velocity = std::max(worst.velocity, c.velocity);
    worst.own = std::max(worst.own, c.own);
  }
  json["lipschitz"] = {{"all_N", finite(worst.together)},
                       {"position_N_m", finite(worst.position)},
                       {"velocity_N_s_m", finite(worst.velocity)},
                       {"own_N", finite(worst.own)}};
  return json;
}

Json force_bounds_json(const ForceErrorBounds& b) {
  return {{"vehicle", b.vehicle + 1},
          {"axis", "z"},
          {"force_error",
           {{"amplitude_N", finite(b.amplitude_N)},
            {"rate_N_s", finite(b.rate_N_s)},
            {"variation_N", finite(b.variation_N)},
            {"impulse_N_s", finite(b.impulse_N_s)}}},
          {"rate", finite(b.by_rate_m)},
          {"amplitude", finite(b.by_amplitude_m)},
          {"edges", finite(b.by_edges_m)},
          {"impulse", finite(b.by_impulse_m)},
          {"slices", finite(b.by_slices_m)},
          {"lag", finite(b.lag_m)},
          {"minimum", finite(b.least_m())}};
}

std::string radius_text(const Json& value) {
  return value.is_number() ? fmt::format("{:.4g} m", value.get<double>()) : std::string("none");
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

Json measured_json(const MeasuredTruth& measured, const LocalTube& tube) {
  const ConformalThreshold& promise = measured.promise;
  int with_flights = 0;
  for (const ResidualEnvelope::Cell& cell : measured.envelope.cells) with_flights += cell.flights > 0 ? 1 : 0;
  double widest_N[3] = {0, 0, 0};
  for (const ResidualEnvelope::Cell& cell : measured.envelope.cells)
    for (int k = 0; k < 3; ++k)
      widest_N[k] = std::max(widest_N[k], cell.force_N[static_cast<std::size_t>(k)].mag());
  return {
      {"level", promise.level},
      {"flights", promise.flights},
      {"shape_flights", measured.shape_flights},
      {"interval", {promise.coverage_90.lower, promise.coverage_90.upper}},
      {"factor", finite(promise.threshold)},
      {"largest_residual_N", {finite(widest_N[0]), finite(widest_N[1]), finite(widest_N[2])}},
      {"mean_s", measured.mean_s},
      {"cells_with_flights", with_flights},
      {"cells_in_tube", tube.residual_cells},
      {"cells_in_tube_without_flights", tube.residual_cells_without_flights},
      {"elsewhere", "the hull of all cells with flights"},
      {"like_them",
       "a flight whose residual is drawn from the same distribution as in these flights: same vehicles, task "
       "and model"},
      {"rests_on", fmt::format("forces are means over {:g} s, so that the ranges do not cover faster ones; "
                               "neighbours are at their logged positions",
                               measured.mean_s)}};
}

void print_measured(const Json& measured) {
  fmt::print(
      "  a further flight like the {} that were compared keeps it with probability {:g} "
      "({:.3f} to {:.3f} for these flights, 90 %)\n",
      measured["flights"].get<int>() + measured["shape_flights"].get<int>(), measured["level"].get<double>(),
      measured["interval"][0].get<double>(), measured["interval"][1].get<double>());
  fmt::print(
      "  residual by the place of the neighbour: shape of {} flights, {:.3g} times as wide for {} others\n",
      measured["shape_flights"].get<int>(), measured["factor"].get<double>(), measured["flights"].get<int>());
  fmt::print("  {} of the {} cells that the tube reaches have no such flight and use {}\n",
             measured["cells_in_tube_without_flights"].get<int>(), measured["cells_in_tube"].get<int>(),
             measured["elsewhere"].get<std::string>());
  fmt::print("  like them: {}\n", measured["like_them"].get<std::string>());
  fmt::print("  rests on: {}\n", measured["rests_on"].get<std::string>());
}

}  // namespace

Json local_tube_json(const TubeArguments& arguments, const LocalTube& tube, const MeasuredTruth* measured) {
  Json json = {{"task", arguments.task},
               {"vehicles", arguments.vehicles},
               {"duration_s", tube.duration_s},
               {"loop", tube.is_sampled ? "sampled" : "continuous"},
               {"velocity_error_m_s", tube.estimates.velocity_m_s},
               {"position_error_m", tube.estimates.position_m},
               {"motor_lag_s", {tube.motor_lag_s.lower, tube.motor_lag_s.upper}}};
  LeastTube shown = tube.tube;
  shown.proved = tube.proved;
  shown.why = tube.why;
  json.update(verdict_json(shown));
  json["interrupted"] = tube.cancelled;
  Json radii = Json::array();
  for (std::size_t i = 0; tube.proved && i < tube.tube.radii.position_m.size(); ++i) {
    radii.push_back({{"vehicle", i + 1},
                     {"position_m", tube.tube.radii.position_m[i]},
                     {"velocity_m_s", tube.tube.radii.velocity_m_s[i]}});
  }
  json["radii"] = std::move(radii);
  for (const TubeRow& row : tube.rows) json[row.name] = tube_row_json(row);
  Json bounds = Json::array();
  for (const ForceErrorBounds& b : tube.bounds) bounds.push_back(force_bounds_json(b));
  json["bounds"] = std::move(bounds);
  Json assumptions = Json::array();
  for (const stability::Assumption& a : tube.assumptions)
    assumptions.push_back({{"name", a.name}, {"status", a.status}, {"note", a.note}});
  json["assumptions"] = std::move(assumptions);
  Json at = Json::array();
  Json slices = Json::array();
  const std::size_t count = tube.proved ? tube.slices.size() : 0;
  const std::size_t every = std::max<std::size_t>(1, (count + kCurvePoints - 1) / kCurvePoints);
  for (std::size_t first = 0; first < count; first += every) {
    const std::size_t last = std::min(count, first + every);
    Json largest = Json::array();
    Json vehicles = Json::array();
    for (std::size_t i = 0; i < tube.slices.front().size(); ++i) {
      Json axes = Json::array();
      for (std::size_t k = 0; k < 3; ++k) {
        Interval e = tube.slices[first][i].position_m[k];
        for (std::size_t n = first + 1; n < last; ++n) e = hull(e, tube.slices[n][i].position_m[k]);
        axes.push_back({e.lower, e.upper});
        if (k == 2) largest.push_back(e.mag());
      }
      vehicles.push_back(std::move(axes));
    }
    const double until_s = static_cast<double>(last) * tube.slice_s;
    at.push_back({{"until_s", until_s}, {"error_z_m", std::move(largest)}});
    slices.push_back({{"until_s", until_s}, {"error_xyz_m", std::move(vehicles)}});
  }
  json["slices"] = std::move(slices);
  json["one_radius"] = verdict_json(tube.one_radius);
  if (measured != nullptr) json["measured"] = measured_json(*measured, tube);
  json["at"] = std::move(at);
  return json;
}

void print_local_tube(const Json& tube) {
  const bool proved = tube["verdict"] == "proved";
  fmt::print("\nTube around {} with {}, {:g} s, {} loop: {}\n", tube["task"].get<std::string>(),
             counted(tube["vehicles"].get<std::size_t>(), "vehicle"), tube["duration_s"].get<double>(),
             tube["loop"].get<std::string>(), tube["verdict"].get<std::string>());
  if (proved) {
    const Json& r = tube["radius_xyz_m"];
    fmt::print("  errors stay below x {:.4g} m, y {:.4g} m, z {:.4g} m\n", r[0].get<double>(),
               r[1].get<double>(), r[2].get<double>());
    const Json& one = tube["one_radius"];
    fmt::print("  with one radius for the whole flight: {} (loop gain {:.3g})\n",
               radius_text(one["radius_m"]),
               one["loop_gain"].is_number() ? one["loop_gain"].get<double>() : INFINITY);
    for (const Json& b : tube["bounds"]) {
      const auto number = [](const Json& x) {
        return x.is_number() ? fmt::format("{:.4g}", x.get<double>()) : std::string("-");
      };
      const Json& e = b["force_error"];
      fmt::print(
          "  vehicle {}: |f_hat - f_a| <= {} N, rate {} N/s, int {} N s; error by rate {}, amplitude {}, "
          "edges {}, impulse {}, slices {} m\n",
          b["vehicle"].get<int>(), number(e["amplitude_N"]), number(e["rate_N_s"]), number(e["impulse_N_s"]),
          number(b["rate"]), number(b["amplitude"]), number(b["edges"]), number(b["impulse"]),
          number(b["slices"]));
    }
    if (tube.contains("measured")) print_measured(tube["measured"]);
  } else {
    fmt::print("  {}\n", tube["why"].get<std::string>());
  }
  for (const char* const name : {"product", "global", "local"}) {
    if (!tube.contains(name)) continue;
    const Json& row = tube[name];
    const Json& L = row["lipschitz"];
    const std::string constants =
        L["position_N_m"].is_number()
            ? fmt::format("{:.4g} N/m, {:.4g} N s/m", L["position_N_m"].get<double>(),
                          L["velocity_N_s_m"].get<double>())
            : fmt::format("{:.4g} N per (m, m/s)", L["all_N"].get<double>());
    fmt::print("  {:<8} Lipschitz bound alone, {}: radius {} (loop gain {:.3g})\n", name, constants,
               radius_text(row["radius_m"]),
               row["loop_gain"].is_number() ? row["loop_gain"].get<double>() : INFINITY);
  }
  for (const Json& a : tube["assumptions"]) {
    const std::string note = a["note"].get<std::string>();
    fmt::print("  {:<8} {}{}\n", a["status"].get<std::string>(), a["name"].get<std::string>(),
               note.empty() ? "" : " (" + note + ")");
  }
}

void add_local_tube_plot(Report& report, const LocalTube& tube, const Json& json) {
  report.heading("Tube around the task");
  report.paragraph(fmt::format("{} with {}, {:g} s, {} loop: {}.", json["task"].get<std::string>(),
                               counted(json["vehicles"].get<std::size_t>(), "vehicle"), tube.duration_s,
                               json["loop"].get<std::string>(), json["verdict"].get<std::string>()));
  if (!tube.proved) report.paragraph(tube.why + ".");
  std::vector<std::vector<std::string>> rows;
  rows.push_back({"difference of both forces, slice by slice", radius_text(json["radius_m"]), "any"});
  rows.push_back({"difference of both forces, one radius", radius_text(json["one_radius"]["radius_m"]),
                  fmt::format("{:.3g}", tube.one_radius.loop_gain)});
  for (const TubeRow& row : tube.rows) {
    rows.push_back({row.name + " Lipschitz bound alone", radius_text(json[row.name]["radius_m"]),
                    fmt::format("{:.3g}", row.tube.loop_gain)});
  }
  report.table({"force error from", "radius", "loop gain"}, rows);
  if (!tube.proved) return;
  std::string data = "# until_s, then least and largest e_z per vehicle, m\n";
  for (const Json& at : json["slices"]) {
    data += fmt::format("{:.6g}", at["until_s"].get<double>());
    for (const Json& e : at["error_xyz_m"])
      data += fmt::format(" {:.6g} {:.6g}", e[2][0].get<double>(), e[2][1].get<double>());
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
