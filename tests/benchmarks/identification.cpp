/// Run time of diagnose, and coverage of its 90 % confidence intervals. Runs in one process, on flights of the tests'
/// own simulator (hidden_effect/other_simulator.h).
///   benchmark_identification speed [count] [gust_N]
///   benchmark_identification recorded MODEL FLIGHTS...
///   benchmark_identification coverage [count] [gust_N] [gust_time_s] [parameter]
/// speed: one flight of 40 s, then `count` flights of two vehicles (default 240: 1.9 million records), optionally in
/// gusts. Goals: 1 s of processor time; 60 s on two cores and 2 GiB.
/// recorded: the same for logs. Both print the ratio to a search of all blocks instead of kMostSearched of them.
/// coverage: for each effect, `count` flights (default 100) under a gust (default 0.006 N rms and 0.5 s) that no column
/// of the regression explains; with the name of a parameter, only the cases that have it.
#include <fmt/core.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>

#include "analysis/identification/diagnose.h"
#include "data.h"
#include "hidden_effect/truths.h"
#include "nn/base/file_io.h"

namespace {

using namespace swarmcert;

double processor_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double peak_MiB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

const auto kSilent = [](int, int) {};

tests::Truth drag_lag_ground() {
  tests::Truth truth;
  truth.motor_lag_s = 0.06;
  truth.force_N = [](const tests::Moment& now) {
    return Eigen::Vector3d(-0.02 * now.v_m_s +
                           now.thrust_N * 0.16 * std::exp(-(now.p_m.z() - 0.06) / 0.05) * now.b3);
  };
  return truth;
}

struct Timed {
  double processor_s = 0, wall_s = 0;
};

Timed time_diagnosis(const residuals::InputArguments& arguments, const std::string& name,
                     std::size_t most_searched) {
  const residuals::Inputs inputs = residuals::read_inputs(arguments);
  const double before_s = processor_s();
  const auto begin = std::chrono::steady_clock::now();
  const auto diagnosis = identification::diagnose(
      inputs, inputs.models.at(0).kind, identification::every_flight(inputs), 2, kSilent, most_searched);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double used_s = processor_s() - before_s;
  fmt::print(
      "{}: {} records, {} of {} blocks searched: {:.2f} s processor time, {:.2f} s wall-clock time, peak "
      "{:.0f} MiB; RMSE {:.5f} -> {:.5f} N\n",
      name, diagnosis.records, diagnosis.searched_blocks, diagnosis.blocks, used_s, wall_s, peak_MiB(),
      diagnosis.rmse_before_N, diagnosis.rmse_after_N);
  for (const identification::Missing& missing : diagnosis.ranking) {
    fmt::print("  {}", missing.effect);
    for (const auto& [parameter, interval] : missing.intervals)
      fmt::print("; {} {:.5f} ({:.5f} .. {:.5f})", parameter, missing.parameters.at(parameter),
                 interval.lower, interval.upper);
    fmt::print("\n");
  }
  return {used_s, wall_s};
}

/// Compares the diagnosis with and without an excerpt. The peak memory of the second run includes the first.
void compare_searches(const residuals::InputArguments& arguments, const std::string& name) {
  const Timed excerpt = time_diagnosis(arguments, name, identification::kMostSearched);
  std::fflush(stdout);
  const Timed whole = time_diagnosis(arguments, name + ", all searched", SIZE_MAX);
  fmt::print("  ratio: {:.2f} of processor time, {:.2f} of wall-clock time\n",
             whole.processor_s / excerpt.processor_s, whole.wall_s / excerpt.wall_s);
}

residuals::InputArguments small_flights(const std::string& folder) {
  residuals::InputArguments arguments;
  arguments.models = {tests::source_path("stability/models/crazyflie-small.toml")};
  arguments.flights = {folder};
  return arguments;
}

void speed(const std::string& folder, int count, double gust_N) {
  tests::Truth truth = drag_lag_ground();
  truth.gust_N = gust_N;
  tests::fly(truth, {tests::Program::kRich, 1, 40, 1}, folder + "/one");
  time_diagnosis(small_flights(folder + "/one"), "one flight of 40 s", identification::kMostSearched);
  for (int i = 0; i < count; ++i)
    tests::fly(truth, {tests::Program::kRich, 2, 40, static_cast<std::uint64_t>(i)},
               fmt::format("{}/many/flight{:03}", folder, i));
  compare_searches(small_flights(folder + "/many"), "many flights");
}

/// Effects that are fitted together, and true values of their parameters.
struct Case {
  std::vector<std::string> effects;
  tests::Truth truth;
  int vehicles = 1;
  std::map<std::string, double> values;  ///< by parameter
};

/// Returns drag, lag and ground together, then every effect of the campaigns that has the form of the library.
std::vector<Case> cases() {
  std::vector<Case> all = {{{"drag_linear", "motor_lag", "ground"},
                            drag_lag_ground(),
                            1,
                            {{"drag_N_s_m", 0.02}, {"tau_s", 0.06}, {"decay_m", 0.05}, {"amplitude", 0.16}}}};
  for (const tests::Hidden& hidden : tests::single_effects()) {
    if (!hidden.parameter.empty())
      all.push_back(
          {{*hidden.answers.begin()}, hidden.truth, hidden.vehicles, {{hidden.parameter, hidden.value}}});
  }
  return all;
}

/// Errors of one parameter over the flights of a case.
struct Count {
  int below = 0, above = 0, runs = 0;  ///< intervals that end below, or begin above, the true value
  double sum = 0, squares = 0, half_widths = 0;
};

void coverage(const std::string& folder, int count, double gust_N, double gust_time_s,
              const std::string& only) {
  fmt::print("nominal 90 % intervals under a gust of {} N rms and {} s\n", gust_N, gust_time_s);
  fmt::print("  {:<34}{:>12}{:>8}{:>8}{:>12}{:>10}{:>10}\n", "", "true", "hold", "too low/high", "mean error",
             "scatter", "half");
  for (const Case& c : cases()) {
    if (!only.empty() && c.values.count(only) == 0) continue;
    std::map<std::string, Count> counts;
    tests::Truth truth = c.truth;
    truth.gust_N = gust_N;
    truth.gust_time_s = gust_time_s;
    for (int i = 0; i < count; ++i) {
      const std::string flight = folder + "/flight";
      std::filesystem::remove_all(flight);
      tests::fly(truth, {tests::Program::kRich, c.vehicles, 40, static_cast<std::uint64_t>(100 + i)}, flight);
      const residuals::Inputs inputs = residuals::read_inputs(small_flights(flight));
      for (const identification::Missing& missing :
           identification::fit_effects(inputs, "small", c.effects, {0}, 2, kSilent)) {
        for (const auto& [name, interval] : missing.intervals) {
          const auto value = c.values.find(name);
          if (value == c.values.end()) continue;
          Count& to = counts[name];
          ++to.runs;
          to.below += interval.upper < value->second;
          to.above += interval.lower > value->second;
          const double error = missing.parameters.at(name) - value->second;
          to.sum += error;
          to.squares += error * error;
          to.half_widths += (interval.upper - interval.lower) / 2;
        }
      }
    }
    for (const auto& [name, n] : counts) {
      const double mean = n.sum / n.runs;
      fmt::print("  {:<34}{:>12.4f}{:>8.3f}{:>6}/{:<6}{:>11.5f}{:>10.5f}{:>10.5f}\n",
                 fmt::format("{} {}", fmt::join(c.effects, "+"), name), c.values.at(name),
                 1 - double(n.below + n.above) / n.runs, n.below, n.above, mean,
                 std::sqrt(std::max(0.0, n.squares / n.runs - mean * mean)), n.half_widths / n.runs);
    }
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "speed";
  if (what == "recorded" && argc > 3) {
    residuals::InputArguments arguments;
    arguments.models = {argv[2]};
    arguments.flights.assign(argv + 3, argv + argc);
    compare_searches(arguments, "recorded flights");
    return 0;
  }
  const int count = argc > 2 ? std::atoi(argv[2]) : what == "coverage" ? 100 : 240;
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("swarmcert-identification-{}", getpid());
  std::filesystem::create_directories(folder);
  if (what == "coverage")
    coverage(folder.string(), count, argc > 3 ? std::atof(argv[3]) : 0.006,
             argc > 4 ? std::atof(argv[4]) : 0.5, argc > 5 ? argv[5] : "");
  else
    speed(folder.string(), count, argc > 3 ? std::atof(argv[3]) : 0);
  std::filesystem::remove_all(folder);
  return 0;
}
