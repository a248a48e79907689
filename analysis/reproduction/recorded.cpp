#include "analysis/reproduction/recorded.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "nn/base/file_io.h"

namespace swarmcert::reproduction {
namespace {

namespace fs = std::filesystem;

/// Limit in gf per unit of input. The joint bounds of the published networks are 417.6 for the large pair and 373.7
/// for the small one, with gamma 3 in every layer, which our networks keep as well.
constexpr double kMaxLipschitz = 373;

bool is_fitted(const residuals::FlightFiles& flight) {
  return flight.scenario.rfind("23_", 0) == 0 || flight.run % 3 == 0;
}

template <typename Keep>
residuals::Inputs some_flights(const residuals::Inputs& all, const Keep& keep) {
  residuals::Inputs some = all;
  auto& flights = some.found.flights;
  flights.erase(std::remove_if(flights.begin(), flights.end(), [&](const auto& f) { return !keep(f); }),
                flights.end());
  return some;
}

/// The small size uses the flights of one or two small vehicles.
bool is_small(const residuals::FlightFiles& flight) {
  return flight.scenario == "21_randomwalk_s" || flight.scenario == "21_randomwalk_ss" ||
         flight.scenario == "21_swap_ss";
}

}  // namespace

Recorded recorded_flights(const Setting& setting, bool published_signals) {
  const auto read = [&](const std::string& folder) {
    residuals::InputArguments arguments;
    arguments.flights = {(fs::path(setting.recorded) / "flights" / folder).string()};
    arguments.fleet = setting.fleet;
    arguments.rules.published_signals = arguments.rules.keep_impacts = published_signals;
    const residuals::Inputs inputs = residuals::read_inputs(arguments);
    return some_flights(inputs, [&](const auto& flight) { return setting.full || is_small(flight); });
  };
  const residuals::Inputs development = read("development");
  return {some_flights(development, is_fitted),
          some_flights(development, [](const auto& flight) { return !is_fitted(flight); }),
          read("visible_test")};
}

Recorded of_small_vehicles(const Recorded& recorded) {
  const auto some = [](const residuals::Inputs& inputs) {
    return some_flights(inputs, [&](const residuals::FlightFiles& flight) {
      return std::all_of(flight.logs.begin(), flight.logs.end(), [&](const auto& log) {
        const auto found = inputs.fleet.find(log.first);
        return found != inputs.fleet.end() && found->second.kind == "small";
      });
    });
  };
  return {some(recorded.fit), some(recorded.select), some(recorded.test)};
}

void add_inputs(const Recorded& recorded, Finding& finding) {
  for (const residuals::Inputs* inputs : {&recorded.fit, &recorded.select, &recorded.test})
    for (const residuals::FlightFiles& flight : inputs->found.flights)
      for (const auto& [vehicle, path] : flight.logs) finding.inputs.push_back(path);
}

residuals::Inputs with_network(residuals::Inputs inputs, const std::string& network) {
  stability::EffectSpec spec;
  spec.name = "deep_set";
  spec.network = fs::absolute(network).string();
  for (stability::Model& model : inputs.models) model.effects.push_back(spec);
  for (auto& [vehicle, model] : inputs.vehicle_models) model.effects.push_back(spec);
  return inputs;
}

std::string published_network(const Setting& setting) {
  const fs::path weights = fs::absolute(fs::path(setting.recorded) / "weights/zip_f32");
  std::string text =
      "schema = \"swarmcert/network/1\"\noutput = { quantity = \"force_z\", unit = \"gf\" }\n"
      "gamma = { value = 3.0, scope = \"layer\", mode = \"clip\" }\n";
  for (const char* const part :
       {"phi.small phi_S", "phi.large phi_L", "phi.ground phi_G", "rho.small rho_S", "rho.large rho_L"}) {
    const std::string words = part;
    const std::size_t space = words.find(' ');
    text += fmt::format("[{}]\nweights = {}\n", words.substr(0, space),
                        files::Json((weights / (words.substr(space + 1) + ".pth")).string()).dump());
  }
  const std::string path = (fs::path(setting.work) / "published/network.toml").string();
  fs::create_directories(fs::path(path).parent_path());
  files::write_file(path, text, true);
  return path;
}

learning::Certified certified_published(const Setting& setting) {
  lipschitz::CertifyOptions certify;
  certify.jobs = setting.jobs;
  certify.lower.rounds = 0;
  if (!setting.full) certify.method = lipschitz::UpperMethod::kProduct;
  return learning::write_certificate(files::load_network({{}, published_network(setting), "", ""}),
                                     (fs::path(setting.work) / "published").string(), certify);
}

std::string recorded_key(const Setting& setting, const Recorded& recorded) {
  std::string key = setting.full ? "full" : "small";
  for (const residuals::Inputs* inputs : {&recorded.fit, &recorded.select, &recorded.test}) {
    for (const residuals::FlightFiles& flight : inputs->found.flights) {
      for (const auto& [vehicle, path] : flight.logs) key += files::sha256_of_file(path);
    }
    key += ";";
  }
  return key;
}

LearnOptions recorded_options(const Setting& setting) {
  LearnOptions options;
  options.sizes.features = 20;
  options.gamma.value = 3;
  options.max_lipschitz = kMaxLipschitz;
  options.begins_within = false;  // makes no difference for such a large limit
  options.turns = true;
  options.rate = 2e-3;
  options.batch = 1024;
  options.epochs = setting.full ? 9 : 6;
  options.seed = setting.seed;
  return options;
}

learning::LearningData load_recorded(const Setting& setting, const Recorded& recorded,
                                     const LearnOptions& options) {
  return learning::load_learning_data(recorded.flights(), options.sizes, learning::SplitBy::kFlights,
                                      setting.jobs,
                                      [&](int done, int total) { setting.progress(done, total, "flights"); });
}

LearnOptions folds_options(const Setting& setting) {
  LearnOptions options;
  options.gamma.value = 3;
  options.rate = 1e-3;
  options.batch = 1024;
  options.epochs = setting.full ? 6 : 2;
  options.patience = 2;
  options.folds = setting.full ? 4 : 2;
  options.seed = setting.seed;
  return options;
}

Learned train_recorded(const Setting& setting, const Recorded& recorded, const LearnOptions& options,
                       const std::string& name, const std::string& what) {
  return learn(setting, options, (fs::path(setting.work) / name).string(),
               what + " " + recorded_key(setting, recorded),
               [&] { return load_recorded(setting, recorded, options); });
}

}  // namespace swarmcert::reproduction
