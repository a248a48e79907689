/// How long diagnose takes, and whether its 90 % intervals hold 90 %. In one process, on flights of the tests' own
/// simulator (hidden_effect/other_simulator.h).
///   benchmark_identification [speed|coverage] [count]
/// speed: one flight of 40 s, then `count` flights of two vehicles (default 240: 1.9 million records). Goals: 1 s of
/// the processor; 60 s on two cores and 2 GiB.
/// coverage: `count` flights (default 40) with drag, motor lag and ground, under a gust that no column explains.
#include <fmt/core.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>

#include "analysis/identification/diagnose.h"
#include "data.h"
#include "hidden_effect/other_simulator.h"
#include "nn/files/file_io.h"

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

residuals::Inputs inputs_of(const std::string& model, const std::string& flights) {
  residuals::InputArguments arguments;
  arguments.models = {model};
  arguments.flights = {flights};
  return residuals::read_inputs(arguments);
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

void time_diagnosis(const std::string& name, const std::string& folder) {
  const residuals::Inputs inputs =
      inputs_of(tests::source_path("stability/models/crazyflie-small.toml"), folder);
  const double before_s = processor_s();
  const auto begin = std::chrono::steady_clock::now();
  const auto diagnosis =
      identification::diagnose(inputs, "small", identification::every_flight(inputs), 2, kSilent);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::string named;
  for (const identification::Missing& missing : diagnosis.ranking) named += " " + missing.effect;
  fmt::print(
      "{}: {} records, {} blocks: {:.2f} s of the processor, {:.2f} s on the clock, peak {:.0f} MiB;{}\n",
      name, diagnosis.records, diagnosis.blocks, processor_s() - before_s, wall_s, peak_MiB(), named);
}

void speed(const std::string& folder, int count) {
  tests::fly(drag_lag_ground(), {tests::Program::kRich, 1, 40, 1}, folder + "/one");
  time_diagnosis("one flight of 40 s", folder + "/one");
  for (int i = 0; i < count; ++i)
    tests::fly(drag_lag_ground(), {tests::Program::kRich, 2, 40, static_cast<std::uint64_t>(i)},
               fmt::format("{}/many/flight{:03}", folder, i));
  time_diagnosis("many flights", folder + "/many");
}

void coverage(const std::string& folder, int count) {
  struct Count {
    int hits = 0, runs = 0;
    double sum = 0, squares = 0, half_widths = 0;  ///< of the errors; of the intervals
  };
  std::map<std::string, Count> counts;
  tests::Truth truth = drag_lag_ground();
  truth.gust_N = 0.006;
  const std::map<std::string, double> values = {
      {"drag_N_s_m", 0.02}, {"tau_s", 0.06}, {"decay_m", 0.05}, {"amplitude", 0.16}};
  for (int i = 0; i < count; ++i) {
    const std::string flight = fmt::format("{}/{}", folder, i);
    tests::fly(truth, {tests::Program::kRich, 1, 40, static_cast<std::uint64_t>(100 + i)}, flight);
    const residuals::Inputs inputs =
        inputs_of(tests::source_path("stability/models/crazyflie-small.toml"), flight);
    for (const identification::Missing& missing : identification::fit_effects(
             inputs, "small", {"drag_linear", "motor_lag", "ground"}, {0}, 2, kSilent)) {
      for (const auto& [name, interval] : missing.intervals) {
        const auto value = values.find(name);
        if (value == values.end()) continue;
        Count& c = counts[name];
        ++c.runs;
        c.hits += interval.first <= value->second && value->second <= interval.second;
        const double error = missing.parameters.at(name) - value->second;
        c.sum += error;
        c.squares += error * error;
        c.half_widths += (interval.second - interval.first) / 2;
      }
    }
  }
  fmt::print("nominal 90 % intervals under a gust of 0.006 N rms and 0.5 s:\n");
  for (const auto& [name, c] : counts)
    fmt::print(
        "  {:<12} {:>3} of {} hold the true value ({:.2f}); mean error {:.4f}, scatter {:.4f}, mean half "
        "{:.4f}\n",
        name, c.hits, c.runs, double(c.hits) / c.runs, c.sum / c.runs,
        std::sqrt(std::max(0.0, c.squares / c.runs - c.sum * c.sum / c.runs / c.runs)),
        c.half_widths / c.runs);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "speed";
  const int count = argc > 2 ? std::atoi(argv[2]) : what == "coverage" ? 40 : 240;
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("swarmcert-identification-{}", getpid());
  std::filesystem::create_directories(folder);
  if (what == "coverage")
    coverage(folder.string(), count);
  else
    speed(folder.string(), count);
  std::filesystem::remove_all(folder);
  return 0;
}
