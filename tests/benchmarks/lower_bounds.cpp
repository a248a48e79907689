// Lower bounds from many seeds: how often the search reaches the best previously known slope, the quality of the bound
// and the run time. Usage: benchmark_lower_bounds [FILE...]; without arguments the recorded networks if they are
// present, else the bundled one. One thread; seconds of processor time; kDefaultSearchRounds rounds.
#include <fmt/core.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "data.h"
#include "lipschitz/lower/slope_search.h"

namespace {

using namespace swarmcert;

constexpr int kSeeds = 20;

struct Case {
  std::string name;
  lipschitz::SlopeFunction function;
  double target = 0;  ///< best previously known slope; 0: none
};

void run(const Case& subject) {
  std::vector<double> slopes, times;
  int reached = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    lipschitz::SlopeSearchOptions options;
    options.seed = static_cast<std::uint64_t>(seed);
    const std::clock_t start = std::clock();
    const double slope = lipschitz::search_slope(subject.function, options).slope.value();
    times.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    slopes.push_back(slope);
    reached += slope >= subject.target;
  }
  std::sort(slopes.begin(), slopes.end());
  std::sort(times.begin(), times.end());
  const std::string rate = subject.target > 0 ? fmt::format("{}/{}", reached, kSeeds) : "-";
  fmt::print("{:<16} {:>9.4f} {:>7} {:>12.7f} {:>12.7f} {:>12.7f} {:>8.2f} {:>8.2f}\n", subject.name,
             subject.target, rate, slopes.front(), slopes[kSeeds / 2], slopes.back(), times[kSeeds / 2],
             times.back());
}

void run_recorded() {
  const auto load = [](const std::string& name) {
    return files::load_weights(tests::data_path("weights/zip_f32/" + name + ".pth"));
  };
  // The targets were found by evolution strategies and branch and bound.
  const std::vector<std::pair<std::string, double>> targets = {
      {"phi_L", 21.88}, {"phi_S", 21.80}, {"phi_G", 14.83}, {"rho_L", 19.55}, {"rho_S", 15.92}};
  for (const auto& [name, target] : targets) {
    const files::Weights weights = load(name);
    run({name, {{&weights, nullptr}, {}, nullptr}, target});
  }
  const files::Weights phi = load("phi_L");
  const files::Weights rho = load("rho_L");
  lipschitz::SlopeFunction set = {{&phi, nullptr}, {}, &rho};
  for (const double target : {251.78, 310.63, 304.47}) {
    run({fmt::format("phi_L:rho_L n={}", set.others.size() + 1), set, target});
    set.others.push_back({&phi, nullptr});
  }
}

}  // namespace

int main(int argc, char** argv) {
  fmt::print("{:<16} {:>9} {:>7} {:>12} {:>12} {:>12} {:>8} {:>8}\n", "network", "target", "reached", "least",
             "median", "best", "med s", "max s");
  std::vector<std::string> paths(argv + 1, argv + argc);
  if (paths.empty() && tests::data_is_present()) {
    run_recorded();
    return 0;
  }
  if (paths.empty()) {
    paths = {tests::source_path("nn/networks/demo/phi.safetensors"),
             tests::source_path("nn/networks/demo/rho.safetensors")};
  }
  for (const std::string& path : paths) {
    const files::Weights weights = files::load_weights(path);
    run({std::filesystem::path(path).stem().string(), {{&weights, nullptr}, {}, nullptr}, 0});
  }
}
