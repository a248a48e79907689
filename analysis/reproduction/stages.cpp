#include "analysis/reproduction/stages.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <numeric>

#include "nn/base/file_io.h"
#include "nn/base/parallel.h"
#include "nn/base/shard.h"

namespace swarmcert::reproduction {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStagesSchema = "swarmcert/flown/1";

std::string weights_of(const files::Network& network) {
  std::string text;
  for (const auto& [kind, weights] : network.phi) text += weights.sha256;
  for (const auto& [kind, weights] : network.rho) text += weights.sha256;
  return text;
}

}  // namespace

Flown fly_logged(const Setting& setting, const Truth& truth, const Plan& plan, const files::Network* network,
                 const std::string& folder) {
  Flown flown = fly(setting, truth, plan, network, true);
  fs::create_directories(folder);
  for (std::size_t i = 0; i < flown.logs.size(); ++i) {
    files::write_file((fs::path(folder) / fmt::format("cf{}_00", i + 1)).string(),
                      stability::to_usd_log(flown.logs[i]), true);
  }
  return flown;
}

residuals::Inputs read_simulated(const Truth& truth, const std::vector<std::string>& folders) {
  const fs::path model = fs::path(folders.front()).parent_path() / "nominal.toml";
  files::write_file(model.string(), stability::to_toml(nominal(truth)), true);
  residuals::InputArguments arguments;
  arguments.models = {model.string()};
  arguments.flights = folders;
  return residuals::read_inputs(arguments);
}

Stages::Stages(const Setting& setting, const Truth& truth, int training_seed)
    : setting_(setting),
      truth_(truth),
      folder_((fs::path(setting.work) /
               fmt::format("{}{}-{}", truth.name, setting.updraft ? "-updraft" : "", training_seed))
                  .string()),
      training_seed_(training_seed) {}

std::uint64_t Stages::seed(const std::string& use, std::uint64_t number) const {
  return seed_of(setting_.seed, fmt::format("{} {} {}", truth_.name, training_seed_, use), number);
}

LearnOptions Stages::learn_options() const {
  LearnOptions options;
  options.sizes.ground = false;  // the networks of the paper have neighbours as their only inputs
  options.gamma.value = 3;       // per layer, as in the published code
  options.steps = scale_of(setting_).steps;
  options.seed = seed("weights");
  return options;
}

std::optional<files::Network> Stages::flown_network(int stage) {
  if (stage == 0) return std::nullopt;
  return learned(stage - 1).network;
}

std::string Stages::key(int stage) {
  const std::optional<files::Network> network = flown_network(stage);
  return files::sha256(stability::to_toml(truth_.model) + files::read_file(setting_.gains) +
                       fmt::format("{} {} {} {} {} {} ", truth_.battery_V, stage, scale_of(setting_).task_s,
                                   kStages[stage].drawn_in, scale_of(setting_).walks, seed("flights")) +
                       (network ? weights_of(*network) : ""));
}

StageFlights Stages::flights(int stage) {
  const std::string folder = (fs::path(folder_) / fmt::format("stage{}", stage)).string();
  const std::string done = (fs::path(folder) / "flown.json").string();
  const std::string own_key = key(stage);
  const files::Json flown =
      files::kept_unit(done, kStagesSchema, own_key, [&] { return fly_stage(stage, folder); });
  return {folder, flown.at("least_distance_m").get<double>(),
          flown.at("percentile_distance_m").get<double>()};
}

files::Json Stages::fly_stage(int stage, const std::string& folder) {
  const std::optional<files::Network> network = flown_network(stage);
  const double task_s = scale_of(setting_).task_s;
  const int vehicles = kStages[stage].vehicles;
  const double drawn_in = kStages[stage].drawn_in;
  const std::uint64_t number = static_cast<std::uint64_t>(vehicles);
  const std::vector<std::pair<std::string, Plan>> plans = {
      {"fit/random-walk", {"random-walk", vehicles, task_s, seed("fit", number), 0, drawn_in}},
      {"fit/swap", {"swap", vehicles, task_s, seed("fit swap", number)}},
      {"select/random-walk", {"random-walk", vehicles, task_s / 3, seed("select", number), 0, drawn_in}},
      {"test/random-walk", {"random-walk", vehicles, task_s / 2, seed("test", number), 0, drawn_in}},
      {"test/swap", {"swap", vehicles, 13.5, seed("test swap", number)}}};
  for (std::size_t k = 0; k < plans.size(); ++k) {
    setting_.progress(static_cast<int>(k), static_cast<int>(plans.size()),
                      fmt::format("flights of {} vehicles", vehicles));
    fly_logged(setting_, truth_, plans[k].second, network ? &*network : nullptr,
               (fs::path(folder) / plans[k].first).string());
  }
  // The least distance in a single walk depends on its seed as much as on the stage.
  const int walks = scale_of(setting_).walks;
  std::vector<double> least_m(static_cast<std::size_t>(walks)), percentile_m(least_m.size());
  files::parallel_for(walks, setting_.jobs, [&](int w) {
    const Plan plan = {"random-walk", vehicles, task_s, seed(fmt::format("walk {}", w), number), 0, drawn_in};
    const std::vector<float> distances =
        nearest_distances_m(fly(setting_, truth_, plan, network ? &*network : nullptr, false));
    least_m[static_cast<std::size_t>(w)] = static_cast<double>(distances.front());
    percentile_m[static_cast<std::size_t>(w)] = static_cast<double>(distances[distances.size() / 100]);
  });
  const auto mean = [](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  };
  return {{"least_distance_m", mean(least_m)}, {"percentile_distance_m", mean(percentile_m)}};
}

residuals::Inputs Stages::inputs(const std::vector<int>& stages, const std::string& use) {
  std::vector<std::string> folders;
  for (const int stage : stages) folders.push_back((fs::path(flights(stage).folder) / use).string());
  return read_simulated(truth_, folders);
}

std::string Stages::data_key(int stage) {
  std::string all;
  for (int k = 0; k <= stage; ++k) all += key(k);
  return all;
}

learning::LearningData Stages::data(int stage, const learning::NetworkSizes& sizes) {
  std::vector<int> from(static_cast<std::size_t>(stage) + 1);
  std::iota(from.begin(), from.end(), 0);
  const residuals::Inputs fit = inputs(from, "fit"), select = inputs(from, "select"),
                          test = inputs({stage}, "test");
  return learning::load_learning_data({&fit, &select, &test}, sizes, learning::SplitBy::kFlights,
                                      setting_.jobs, [](int, int) {});
}

Learned Stages::learned(int stage) {
  flights(stage);
  const LearnOptions options = learn_options();
  const std::string folder = (fs::path(folder_) / fmt::format("stage{}", stage) / "network").string();
  return learn(setting_, options, folder, data_key(stage), [&] { return data(stage, options.sizes); });
}

}  // namespace swarmcert::reproduction
