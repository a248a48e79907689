#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "analysis/reproduction/experiments.h"
#include "analysis/reproduction/recorded.h"
#include "analysis/reproduction/stages.h"

namespace swarmcert::reproduction {
namespace {

namespace fs = std::filesystem;

/// How a network comes to say the same after a turn about the vertical.
struct Symmetry {
  const char* name;
  bool turns, invariants;  ///< samples are turned; phi sees invariants
};
constexpr Symmetry kNone = {"none", false, false}, kTurned = {"turned samples", true, false},
                   kExact = {"exact", false, true};

/// Flights that are learned from, all or half of them, and the options that are common to all networks.
struct Source {
  std::string name;
  std::map<bool, Recorded> flights;  ///< by whether it is half
  LearnOptions options;
};

/// Of each scenario every other flight to fit; those that select and test stay.
Recorded halved(Recorded flights) {
  auto& fit = flights.fit.found.flights;
  std::map<std::string, int> seen;
  fit.erase(std::remove_if(fit.begin(), fit.end(),
                           [&seen](const auto& flight) { return seen[flight.scenario]++ % 2 == 1; }),
            fit.end());
  return flights;
}

/// Three vehicles, half of the time in a random walk, half in swaps. Half of the flights: both half as long.
Source simulated(const Setting& setting) {
  const Truth truth = truths(setting).front();
  const std::string root = (fs::path(setting.work) / "symmetry/flights").string();
  const double whole_s = setting.full ? 60 : 20;
  std::uint64_t number = 0;
  const auto fly_into = [&](const std::string& folder, double seconds) {
    for (const char* const task : {"random-walk", "swap"}) {
      fly_logged(setting, truth, {task, 3, seconds, seed_of(setting.seed, "symmetry", ++number)}, nullptr,
                 root + "/" + folder + "/" + task);
    }
  };
  fly_into("all", whole_s / 2);
  fly_into("half", whole_s / 4);
  fly_into("select", 15);
  fly_into("test", 30);
  const auto read = [&](const std::string& folder) { return read_simulated(truth, {root + "/" + folder}); };
  Source source{"simulated", {}, {}};
  for (const bool half : {false, true})
    source.flights[half] = {read(half ? "half" : "all"), read("select"), read("test")};
  source.options.sizes.ground = false;
  source.options.gamma.value = 3;
  source.options.steps = setting.full ? 4000 : 400;
  return source;
}

Source recorded(const Setting& setting) {
  const Recorded all = recorded_flights(setting, true);
  return {"recorded", {{false, all}, {true, halved(all)}}, recorded_options(setting)};
}

/// Networks that differ in their seeds only.
struct Group {
  std::vector<double> test_gf, bounds;
  double mean_test_gf() const { return mean(test_gf); }
  double mean_bound() const { return mean(bounds); }
  /// Standard error of the mean, over seeds; NaN of one.
  double standard_error_gf() const {
    double squares = 0;
    for (const double x : test_gf) squares += (x - mean_test_gf()) * (x - mean_test_gf());
    const auto n = static_cast<double>(test_gf.size());
    return std::sqrt(squares / (n - 1) / n);
  }

 private:
  static double mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double x : values) sum += x;
    return sum / static_cast<double>(values.size());
  }
};

Group train(const Setting& setting, const Source& source, const Symmetry& symmetry, bool half,
            LearnOptions options, int seeds) {
  if (!setting.full) options.sizes = {{12, 12}, {12}, 8, options.sizes.ground};
  options.turns = symmetry.turns;
  options.sizes.invariants = symmetry.invariants;
  options.tight_bounds = true;
  Group group;
  for (int s = 0; s < seeds; ++s) {
    options.seed = seed_of(setting.seed, "symmetry", static_cast<std::uint64_t>(s));
    const std::string name = fmt::format("symmetry/{}-{}-{}-{:g}-{:g}-{}", source.name, half ? "half" : "all",
                                         symmetry.name, options.gamma.value, options.max_lipschitz, s);
    const Learned learned = train_recorded(setting, source.flights.at(half), options, name, source.name);
    group.test_gf.push_back(learned.test_gf);
    group.bounds.push_back(learned.bound);
  }
  return group;
}

files::Json json_of(const Group& group) {
  return {{"test_rmse_gf", group.test_gf},
          {"mean_test_rmse_gf", group.mean_test_gf()},
          {"bound_gf_per_unit", group.bounds},
          {"mean_bound_gf_per_unit", group.mean_bound()}};
}

/// Test errors of each symmetry, learned from all flights and from half of them.
void add_data(const Setting& setting, const Source& source, Finding& finding) {
  const int seeds = setting.full ? 5 : 1;
  Table table = {fmt::format("{} flights: RMSE on flights not seen [gf], mean of {} seeds (standard error)",
                             source.name, seeds),
                 {"symmetry", "all flights", "half of them"},
                 {}};
  for (const Symmetry& symmetry : {kNone, kTurned, kExact}) {
    std::vector<std::string> row = {symmetry.name};
    for (const bool half : {false, true}) {
      const Group group = train(setting, source, symmetry, half, source.options, seeds);
      row.push_back(seeds > 1
                        ? fmt::format("{:.3f} ({:.3f})", group.mean_test_gf(), group.standard_error_gf())
                        : fmt::format("{:.3f}", group.mean_test_gf()));
      files::Json json = json_of(group);
      json.update({{"flights", source.name}, {"symmetry", symmetry.name}, {"half", half}});
      finding.json["by_data"].push_back(std::move(json));
    }
    table.rows.push_back(std::move(row));
  }
  finding.tables.push_back(std::move(table));
}

/// Test error over the largest joint bound: what limits it, with turned samples and with exact symmetry.
void add_bounds(const Setting& setting, const Source& source, Finding& finding) {
  const int seeds = setting.full ? 3 : 1;
  const std::vector<double> gammas =
      setting.full ? std::vector<double>{1, 1.25, 1.5, 2, 3} : std::vector<double>{1, 2};
  const std::vector<double> limits =
      setting.full ? std::vector<double>{25, 50, 100, 200, 373} : std::vector<double>{25, 100};
  Table table = {
      fmt::format("{} flights: error over the proved joint bound, mean of {} seeds", source.name, seeds),
      {"what is limited", "symmetry", "limit", "joint bound [gf/unit]", "test RMSE [gf]"},
      {}};
  std::string data;
  for (const bool joint : {false, true}) {
    const char* const method = joint ? "joint bound" : "norm of each layer";
    for (const Symmetry& symmetry : {kTurned, kExact}) {
      for (const double limit : joint ? limits : gammas) {
        LearnOptions options = source.options;
        options.max_lipschitz = joint ? limit : 0;
        if (!joint) options.gamma.value = limit;
        const Group group = train(setting, source, symmetry, false, options, seeds);
        table.rows.push_back({method, symmetry.name, fmt::format("{:g}", limit),
                              fmt::format("{:.1f}", group.mean_bound()),
                              fmt::format("{:.3f}", group.mean_test_gf())});
        files::Json json = json_of(group);
        json.update(
            {{"flights", source.name}, {"limited", method}, {"symmetry", symmetry.name}, {"limit", limit}});
        finding.json["by_bound"].push_back(std::move(json));
        data += fmt::format("{} {}\n", group.mean_bound(), group.mean_test_gf());
      }
      data += "\n\n";
    }
  }
  finding.tables.push_back(std::move(table));
  const std::string name = "symmetry_" + source.name;
  finding.figures.push_back(
      {name, data,
       fmt::format(
           "set logscale x\nset grid\nset key top right\n"
           "set xlabel 'proved joint Lipschitz bound [gf per m or m/s]'\nset ylabel 'test RMSE [gf]'\n"
           "t = \"'norm of each layer' 'norm of each layer, exact' 'joint bound' 'joint bound, exact'\"\n"
           "plot for [i=0:3] '{}.dat' index i with linespoints lw 2 title word(t, i + 1)\n",
           name),
       "Test error over the proved joint bound, " + source.name + " flights."});
}

void add_inputs(const Recorded& recorded, Finding& finding) {
  for (const residuals::Inputs* inputs : {&recorded.fit, &recorded.select, &recorded.test})
    for (const residuals::FlightFiles& flight : inputs->found.flights)
      for (const auto& [vehicle, path] : flight.logs) finding.inputs.push_back(path);
}

}  // namespace

Finding symmetry(const Setting& setting) {
  Finding finding;
  finding.json["by_data"] = finding.json["by_bound"] = files::Json::array();
  std::vector<Source> sources = {simulated(setting)};
  if (!setting.recorded.empty()) sources.push_back(recorded(setting));
  for (const Source& source : sources) {
    add_data(setting, source, finding);
    add_bounds(setting, source, finding);
  }
  if (!setting.recorded.empty()) add_inputs(sources.back().flights.at(false), finding);
  finding.notes.push_back(
      "Epochs are chosen on the selecting flights, and nothing on those that test. Exact: every phi sees "
      "invariants under turns about the vertical, and the slope of the map to them is in the bound.");
  return finding;
}

}  // namespace swarmcert::reproduction
