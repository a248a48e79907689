#include "analysis/reproduction/sources.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "analysis/reproduction/stages.h"

namespace swarmcert::reproduction {
namespace {

namespace fs = std::filesystem;

/// Keeps every other flight to fit of each scenario; selecting and test flights are unchanged.
Recorded halved(Recorded flights) {
  auto& fit = flights.fit.found.flights;
  std::map<std::string, int> seen;
  fit.erase(std::remove_if(fit.begin(), fit.end(),
                           [&seen](const auto& flight) { return seen[flight.scenario]++ % 2 == 1; }),
            fit.end());
  return flights;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double x : values) sum += x;
  return sum / static_cast<double>(values.size());
}

}  // namespace

Source simulated_source(const Setting& setting) {
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
  Source source{"simulated", {read("all"), read("select"), read("test")}, {}, {}};
  source.half = {read("half"), source.all.select, source.all.test};
  source.options.sizes.ground = false;
  source.options.gamma.value = 3;
  source.options.steps = setting.full ? 4000 : 400;
  return source;
}

Source recorded_source(const Setting& setting) {
  const Recorded all = recorded_flights(setting, true);
  return {"recorded", all, halved(all), recorded_options(setting)};
}

double Group::mean_select_gf() const { return mean(select_gf); }
double Group::mean_test_gf() const { return mean(test_gf); }
double Group::mean_bound() const { return mean(bounds); }

Group train_group(const Setting& setting, const Source& source, const Recorded& flights, LearnOptions options,
                  const std::string& name, int seeds) {
  if (!setting.full) options.sizes = {{12, 12}, {12}, 8, options.sizes.ground};
  options.tight_bounds = true;
  Group group;
  for (int s = 0; s < seeds; ++s) {
    options.seed = seed_of(setting.seed, "symmetry", static_cast<std::uint64_t>(s));
    const Learned learned =
        train_recorded(setting, flights, options, fmt::format("{}-{}", name, s), source.name);
    group.select_gf.push_back(learned.scores.back().second);
    group.test_gf.push_back(learned.test_gf);
    group.bounds.push_back(learned.bound);
  }
  return group;
}

void describe_group(files::Record& record, const Group& group) {
  record.field("select_rmse_gf", group.select_gf, "On the selecting flights, by seed.", "gf");
  record.field("test_rmse_gf", group.test_gf, "On flights not seen, by seed.", "gf");
  record.field("mean_test_rmse_gf", group.mean_test_gf(), "Over seeds.", "gf");
  record.field("bound_gf_per_unit", group.bounds, "Joint Lipschitz bound, by seed.", "gf/unit",
               "proved upper bound");
  record.field("mean_bound_gf_per_unit", group.mean_bound(), "Over seeds.", "gf/unit");
}

}  // namespace swarmcert::reproduction
