#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

#include "analysis/cli/command_line.h"
#include "analysis/cli/counted.h"
#include "analysis/cli/progress.h"
#include "analysis/commands/commands.h"
#include "analysis/report/report.h"
#include "nn/base/file_io.h"
#include "nn/base/input_error.h"
#include "nn/base/pi.h"
#include "nn/base/suggest.h"
#include "stability/simulation/simulate.h"

namespace swarmcert::analysis {
namespace {

/// Longest simulated flight: its log still fits into memory, and no battery lasts longer.
constexpr double kLongestFlight_s = 86400;

struct SimulateOptions {
  std::string task;
  std::vector<std::string> models;
  std::string gains, output, report, torque_network;
  files::NetworkArguments network;
  int vehicles = 1;
  int run = 0;
  double duration_s = 0;
  std::uint64_t seed = 0;
  bool no_noise = false;
  stability::RadioOptions radio;
};

bool has_force_network(const SimulateOptions& options) {
  return !options.network.file.empty() || !options.network.phi.empty();
}

std::string log_name(int vehicle, int run) { return fmt::format("cf{}_{:02}", vehicle + 1, run); }

/// A flown task. The description reads no log, so they may have been moved away.
struct SimulateResult {
  SimulateOptions options;
  double duration_s = 0;
  stability::Simulation flown;
};

files::AxesAndTotal axes_of(const std::array<double, 4>& v) { return {v[0], v[1], v[2], v[3]}; }

struct NamedVehicle {
  std::string name;
  stability::SimulatedVehicle vehicle;
};

std::vector<NamedVehicle> named(const std::vector<stability::SimulatedVehicle>& vehicles) {
  std::vector<NamedVehicle> all;
  for (const stability::SimulatedVehicle& vehicle : vehicles)
    all.push_back({fmt::format("cf{}", all.size() + 1), vehicle});
  return all;
}

void describe_vehicle(files::Record& record, const NamedVehicle& named) {
  const stability::SimulatedVehicle& vehicle = named.vehicle;
  record.field("name", named.name, "Of the vehicle, as in the name of its log.");
  record.field("kind", vehicle.kind, "Of its model.");
  record.field("max", axes_of(vehicle.error.max_m), "Largest position error.", "m", "of this run");
  record.field("rms", axes_of(vehicle.error.rms_m), "Root mean square of the position error.", "m");
  record.field("saturated_share", vehicle.saturated_share,
               "Share of the flight with the thrust at its limit.");
  record.field("largest_tilt_deg", vehicle.largest_tilt_rad * 180 / kPi, "Largest tilt.", "deg");
  record.field("smallest_height_m", vehicle.smallest_height_m, "Smallest height.", "m");
}

void describe(files::Record& record, const SimulateResult& result) {
  const SimulateOptions& options = result.options;
  record.field("task", options.task, "The task that was flown.");
  record.constant("loop", "sampled", "The loop that was integrated: Runge-Kutta per control period.");
  record.field("duration_s", result.duration_s, "Of the task.", "s");
  record.field("noise", !options.no_noise, "Whether the controller gets the noise of the sensors.");
  record.may_object(has_force_network(options) || !options.torque_network.empty(), "radio",
                    "How positions of neighbours reach the network.", [&](files::Record& radio) {
                      radio.field("latency_s", options.radio.latency_s, "Until they arrive.", "s");
                      radio.field("loss", options.radio.loss, "Share that is lost.");
                    });
  record.field("diverged", result.flown.diverged, "Whether a vehicle left all bounds.");
  record.constant("unit", "m", "Of the errors.");
  record.list("vehicles", named(result.flown.vehicles), "Tracking error and extremes of each vehicle.",
              describe_vehicle);
}

Table error_table(const files::Node& result) {
  return table(*result.find("vehicles"), {{"name", "vehicle"},
                                          {"kind"},
                                          {"max.x", "max x", "{:.4f}"},
                                          {"max.y", "max y", "{:.4f}"},
                                          {"max.z", "max z", "{:.4f}"},
                                          {"rms.x", "rms x", "{:.4f}"},
                                          {"rms.y", "rms y", "{:.4f}"},
                                          {"rms.z", "rms z", "{:.4f}"},
                                          {"saturated_share", "thrust at its limit", "{:.1f}", 100, "%"}});
}

void print(const SimulateResult& result, const files::Node& described) {
  fmt::print("{}: {}, {:g} s in the sampled loop (Runge-Kutta per control period, float32 control)\n",
             result.options.task, counted(result.flown.vehicles.size(), "vehicle"), result.duration_s);
  fmt::print("{}", to_text(error_table(described)));
  if (result.flown.diverged)
    fmt::print("  DIVERGED at {:.2f} s: the flight ends there\n", result.flown.end_s);
}

void write_report(const SimulateResult& result, const files::Node& described, bool overwrite) {
  const stability::Simulation& flown = result.flown;
  Report report(fmt::format("{} with {}", result.options.task, counted(flown.vehicles.size(), "vehicle")));
  report.made_by(command_to_copy());
  report.result(described);
  report.paragraph(
      "Simulated in the sampled loop: controllers at their own rates, forces held between, Runge-Kutta per "
      "control period. One run shows its own errors, not the largest possible error.");
  report.table(error_table(described));
  std::string data;
  for (const auto& errors : flown.errors) {
    for (const auto& e : errors) {
      data += fmt::format("{:.3f} {:.6g} {:.6g} {:.6g} {:.6g} {:.6g} {:.6g}\n", e[0], e[1], e[2], e[3], e[4],
                          e[5], e[6]);
    }
    data += "\n\n";
  }
  report.figure("height_error", data,
                fmt::format("set xlabel 'time [s]'\nset ylabel 'height error [m]'\n"
                            "plot for [i=0:{}] 'height_error.dat' index i using 1:4 with lines "
                            "title sprintf('cf%d', i + 1)\n",
                            flown.errors.size() - 1),
                "Height error p_z - p_d,z of each vehicle.");
  report.write(result.options.report, overwrite);
}

bool has_model_each(const SimulateOptions& options) {
  return static_cast<int>(options.models.size()) == options.vehicles;
}

void require_task_and_models(const SimulateOptions& options) {
  const std::vector<std::string> tasks = stability::task_names();
  if (std::find(tasks.begin(), tasks.end(), options.task) == tasks.end()) {
    throw UsageError("unknown task " + options.task + ": " + files::did_you_mean(options.task, tasks));
  }
  if (!has_model_each(options) && options.models.size() != 1) {
    throw UsageError(fmt::format("{} models for {} vehicles: give one for all, or one for each",
                                 options.models.size(), options.vehicles));
  }
}

/// @param inputs receives the paths of the models.
stability::Swarm read_swarm(const SimulateOptions& options, std::vector<std::string>& inputs) {
  std::vector<stability::Model> models;
  std::vector<int> kind_of;
  for (int i = 0; i < options.vehicles; ++i) {
    const std::string& path = options.models[has_model_each(options) ? static_cast<std::size_t>(i) : 0];
    const auto known = std::find(inputs.begin(), inputs.end(), path);
    kind_of.push_back(static_cast<int>(known - inputs.begin()));
    if (known != inputs.end()) continue;
    models.push_back(stability::read_model(path));
    inputs.push_back(path);
  }
  return stability::Swarm(std::move(models), std::move(kind_of));
}

/// @param inputs receives the paths of the network's files.
std::unique_ptr<files::Network> read_network(const files::NetworkArguments& arguments,
                                             std::vector<std::string>& inputs) {
  auto network = std::make_unique<files::Network>(load_net(arguments));
  for (const std::string& path : input_files(*network)) inputs.push_back(path);
  return network;
}

void write_logs(const SimulateOptions& options, const stability::Simulation& flown, bool overwrite) {
  std::filesystem::create_directories(options.output);
  for (std::size_t i = 0; i < flown.logs.size(); ++i) {
    const auto path = std::filesystem::path(options.output) / log_name(static_cast<int>(i), options.run);
    files::write_file(path.string(), stability::to_usd_log(flown.logs[i]), overwrite);
  }
}

int run_simulate(SimulateOptions options, const CommonOptions& common) {
  require_task_and_models(options);
  refuse_folder(common, options.output);
  refuse_folder(common, options.report);
  refuse_to_replace(common, common.json);
  std::vector<std::string> inputs;
  stability::Swarm swarm = read_swarm(options, inputs);
  const stability::Gains gains = stability::load_gains(options.gains);
  inputs.push_back(options.gains);
  const std::unique_ptr<files::Network> network =
      has_force_network(options) ? read_network(options.network, inputs) : nullptr;
  const std::unique_ptr<files::Network> torque_network =
      options.torque_network.empty() ? nullptr : read_network({{}, options.torque_network, "", ""}, inputs);
  const std::unique_ptr<stability::Task> task =
      stability::make_task(options.task, {options.vehicles, options.duration_s, options.seed});
  swarm.assume_lag(gains.motor_lag_s, gains.delay_s);

  Progress progress(common.quiet);
  stability::SimulationOptions how;
  how.loop.noise = !options.no_noise;
  how.loop.seed = options.seed;
  how.loop.radio = options.radio;
  how.loop.torque_network = torque_network.get();
  how.progress = [&progress](double time_s, double duration_s) {
    progress.show(static_cast<int>(time_s), std::max(static_cast<int>(duration_s), 1), "seconds flown");
  };
  stability::Simulation flown;
  try {
    flown = stability::simulate(swarm, gains, *task, how, network.get());
  } catch (const std::invalid_argument& error) {
    throw files::InputError(
        {options.gains, "", "rate_hz", "", error.what(), "choose rates that divide 500 Hz"});
  }

  write_logs(options, flown, common.force);
  const SimulateResult result{options, task->duration_s(), std::move(flown)};
  const files::Node described = result_of("simulate", inputs, options.seed, result);
  if (!options.report.empty()) write_report(result, described, common.force);
  write_result(common, described);
  if (common.prints_text()) {
    print(result, described);
    fmt::print("Logs: {}\n", (std::filesystem::path(options.output) / log_name(0, options.run)).string());
  }
  std::vector<std::string> next = options.models;
  next.insert(next.begin(), "compare");
  next.push_back(options.output);
  print_next(common, next);
  return kDone;
}

/// Empty if a simulation may last that long.
std::string refusal_of_duration(const std::string& seconds) {
  const double value_s = std::strtod(seconds.c_str(), nullptr);
  if (value_s <= kLongestFlight_s) return {};
  if (std::isnan(value_s)) return seconds + " is not a number of seconds";
  return fmt::format(
      "{} s is longer than a day ({:g} s); batteries last minutes, and the duration is in seconds", seconds,
      kLongestFlight_s);
}

void declare_swarm(CLI::App& app, SimulateOptions& options) {
  app.add_option("TASK", options.task, "Task to fly, see Tasks below")
      ->type_name(fmt::format("{{{}}}", fmt::join(stability::task_names(), ",")))
      ->required();
  app.add_option("--vehicles", options.vehicles, "Number of vehicles (default 1)")
      ->check(CLI::Range(1, 1000));
  app.add_option("--model", options.models, "model.toml: one for all vehicles, or one for each")->required();
  app.add_option("--gains", options.gains, "gains.toml")->required();
  app.add_option("--network", options.network.file, "network.toml whose prediction the controller uses");
  app.add_option("--torque-network", options.torque_network,
                 "network.toml made by train --quantity torque; its prediction is subtracted "
                 "from the torque that the attitude law commands");
  auto* phi = app.add_option("--phi", options.network.phi, "Weight file of phi, in place of --network");
  auto* rho = app.add_option("--rho", options.network.rho, "Weight file of rho, in place of --network");
  phi->needs(rho);
  rho->needs(phi);
  declare_order(app, options.network);
}

void declare_flight(CLI::App& app, SimulateOptions& options) {
  add_output(app, "-o,--output", options.output, "Folder for the logs")->required();
  add_output(app, "--report", options.report, "Folder for an HTML report with plots");
  app.add_option("--duration", options.duration_s, "Seconds, at most a day (default: the task's own)")
      ->check(CLI::PositiveNumber)
      ->check(CLI::Validator(refusal_of_duration, ""));
  app.add_option("--seed", options.seed, "Seed of noise, clocks and random goals (default 0)");
  app.add_option("--run", options.run, "Number of the run in the logs' names (default 0)")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--radio-latency", options.radio.latency_s,
                 "Seconds until neighbours' positions arrive at the network (default 0)")
      ->check(CLI::Range(0.0, 10.0));
  app.add_option("--radio-loss", options.radio.loss,
                 "Fraction of neighbours' positions that are lost (default 0); a neighbour that "
                 "has not been heard for 500 ms is ignored")
      ->check(CLI::Range(0.0, 1.0));
  app.add_flag("--no-noise", options.no_noise, "No noise: the controller gets the true state");
}

}  // namespace

Command simulate_command() {
  std::string tasks;
  for (const std::string& name : stability::task_names()) {
    tasks += fmt::format("  {:<12} {}\n", name, stability::task_summary(name));
  }
  return {"simulate", "Fly a task in simulation and write flight logs",
          "Tasks\n" + tasks +
              "\nWrites one log per vehicle, DIR/cf<vehicle>_<run>, in the binary format of the published "
              "flights.\n"
              "Example\n"
              "  swarmcert simulate swap --vehicles 2 --model stability/models/crazyflie-small.toml \\\n"
              "      --gains controller/gains/crazyflie-small.toml -o flights",
          [](CLI::App& app) {
            auto options = std::make_shared<SimulateOptions>();
            declare_swarm(app, *options);
            declare_flight(app, *options);
            return [options](const CommonOptions& common) { return run_simulate(*options, common); };
          },
          fields_of<SimulateResult>()};
}

}  // namespace swarmcert::analysis
