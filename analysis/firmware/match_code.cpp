#include "analysis/firmware/match_code.h"

#include <fmt/core.h>

#include <cstring>

#include "analysis/firmware/app_in_image.h"
#include "analysis/firmware/float_blocks.h"
#include "analysis/firmware/golden_vectors.h"
#include "analysis/firmware/image_checks.h"
#include "nn/base/random.h"
#include "nn/weights/compositions.h"

namespace swarmcert::firmware {
namespace {

/// swarmcert_network::predict_force_z(int, const float*, const swarmcert::nn::Neighbour<float>*, int, float*)
constexpr char kPredict[] = "_ZN17swarmcert_network15predict_force_zEiPKfPKN9swarmcert2nn9NeighbourIfEEiPf";

std::string words_of(const std::vector<std::uint32_t>& words) {
  std::string bytes(4 * words.size(), '\0');
  std::memcpy(bytes.data(), words.data(), bytes.size());
  return bytes;
}

/// Addresses from kArguments on: own state, force, neighbours {pointer, kind} and their inputs.
struct Arguments {
  std::uint32_t own = CortexM::kArguments, force = 0, neighbours = 0;
  std::vector<std::uint32_t> words;

  explicit Arguments(const GoldenVector& vector) {
    for (const float x : vector.own) words.push_back(float_bits(x));
    force = next();
    words.push_back(float_bits(-1.0f));  // detects a result that is not written
    neighbours = next();
    const auto count = static_cast<std::uint32_t>(vector.inputs.size());
    std::uint32_t input = neighbours + 8 * count;
    for (std::size_t j = 0; j < vector.inputs.size(); ++j) {
      words.push_back(input);
      words.push_back(static_cast<std::uint32_t>(vector.kinds[j]));
      input += 4 * static_cast<std::uint32_t>(vector.inputs[j].size());
    }
    for (const std::vector<float>& one : vector.inputs)
      for (const float x : one) words.push_back(float_bits(x));
    if (4 * words.size() > CortexM::kArgumentsSize) throw NotRun("the inputs of a call are too many");
  }

 private:
  std::uint32_t next() const { return CortexM::kArguments + 4 * static_cast<std::uint32_t>(words.size()); }
};

/// Runs predict_force_z() on golden vectors. Returns the first difference; empty if there is none.
std::string run_vectors(const files::Network& network, int count, int most_neighbours, CortexM& target,
                        std::uint32_t function, const std::string& whose) {
  int index = 0;
  for (const GoldenVector& vector : golden_vectors(network, count, most_neighbours, 1)) {
    const Arguments arguments(vector);
    target.write(CortexM::kArguments, words_of(arguments.words));
    const auto status = target.call(function,
                                    {static_cast<std::uint32_t>(vector.own_kind), arguments.own,
                                     arguments.neighbours, static_cast<std::uint32_t>(vector.inputs.size())},
                                    arguments.force) &
                        0xffu;
    const std::uint32_t force = target.read_word(arguments.force);
    const std::uint32_t expected = float_bits(vector.force_N);
    if (status != static_cast<std::uint32_t>(vector.status) || force != expected) {
      float found_N = 0;
      std::memcpy(&found_N, &force, sizeof found_N);
      return fmt::format(
          "predict_force_z gives {:.9g} N (bits {:#010x}, status {}) for golden vector {} with {} "
          "neighbours, {} gives {:.9g} N (bits {:#010x}, status {})",
          found_N, force, status, index, vector.inputs.size(), whose, vector.force_N, expected,
          static_cast<int>(vector.status));
    }
    ++index;
  }
  return "";
}

/// The network with other weights, all of them large enough to count.
files::Network with_other_weights(files::Network network, std::uint64_t seed) {
  files::Random random(seed);
  const auto renew = [&random](files::Weights& weights) {
    for (files::Layer& layer : weights.layers) {
      const float size = 2.0f / static_cast<float>(layer.inputs);
      for (std::vector<double>* const values : {&layer.weights, &layer.biases})
        for (double& x : *values) x = static_cast<double>(size * static_cast<float>(random.symmetric()));
    }
  };
  for (auto& [kind, weights] : network.phi) renew(weights);
  for (auto& [kind, weights] : network.rho) renew(weights);
  return network;
}

constexpr std::uint64_t kOtherWeightsSeed = 2;
constexpr int kVectorsOfOtherWeights = 16;

void write_weights(const files::Network& network, const ElfImage& image, CortexM& target) {
  for (const WeightsObject& object : weights_objects(network, image)) {
    if (object.symbol == nullptr) throw NotRun("it has no symbol of " + object.name);
    target.write(object.symbol->address, object.bytes);
  }
}

constexpr char kFromElsewhere[] =
    "with other weights in the objects that hold the network's, {}: some of the weights that it uses are "
    "elsewhere";

void match_function(const files::Network& network, const ElfImage& image, int most_neighbours,
                    std::uint32_t function, CodeMatch& result) {
  CortexM target;
  load(target, image);
  result.difference = run_vectors(network, kVectorsOfMatch, most_neighbours, target, function, "the network");
  if (!result.difference.empty()) return;
  result.compared.push_back(fmt::format(
      "evaluator, clamp and scale, by predict_force_z() on QEMU's Cortex-M4 for {} golden vectors, bit for "
      "bit",
      golden_vectors(network, kVectorsOfMatch, most_neighbours, 1).size()));
  const files::Network other = with_other_weights(network, kOtherWeightsSeed);
  write_weights(other, image, target);
  const std::string elsewhere =
      run_vectors(other, kVectorsOfOtherWeights, most_neighbours, target, function, "the network with these");
  if (!elsewhere.empty()) {
    result.difference = fmt::format(kFromElsewhere, elsewhere);
    return;
  }
  result.compared.emplace_back(
      "that predict_force_z() takes every weight from the objects compared, by writing other weights into "
      "them");
}

constexpr int kPeriodsOfFlight = 144, kPeriodsWithOtherWeights = 48;

/// Flies the app on both sides. Returns the first difference; empty if there is none.
std::string fly(const files::Network& network, const std::vector<Tick>& flight, int most_neighbours,
                AppInImage& image) {
  const char* const names[] = {"motor 1",     "motor 2",    "motor 3",     "motor 4", "control mode",
                               "self-test",   "prediction", "neighbours",  "faults",  "network_us",
                               "predicted_N", "applied_N",  "predicted_ms"};
  AppOnHost host(network, most_neighbours);
  int call = 0;
  for (const Tick& tick : flight) {
    const TickResult expected = host.run(tick), found = image.run(tick);
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (found[i] == expected[i]) continue;
      return fmt::format(
          "{} gives {} = {:#010x} in call {} of the golden flight, the network and the app's source {:#010x}",
          tick.is_of_network ? "appMain" : "controllerOutOfTree", names[i], found[i], call, expected[i]);
    }
    ++call;
  }
  return "";
}

/// Compares what the app starts with. Returns the first difference; empty if there is none.
std::string different_start(const AppExpectation& expected, AppInImage& image) {
  const AppParameters found = image.parameters_at_start();
  const AppParameters& wanted = expected.parameters;
  const char* const names[] = {"kp_xy", "kp_z", "kd_xy", "kd_z", "ki_xy", "ki_z"};
  const auto differ = [](const std::string& name, double is, double should) {
    return fmt::format("swarmcert_parameters.{} is {:.9g} in the image, {:.9g} expected", name, is, should);
  };
  if (found.enable != wanted.enable) return differ("enable", found.enable, wanted.enable);
  if (found.own_kind != wanted.own_kind) return differ("own_kind", found.own_kind, wanted.own_kind);
  if (float_bits(found.mass_kg) != float_bits(wanted.mass_kg))
    return differ("mass_kg", static_cast<double>(found.mass_kg), static_cast<double>(wanted.mass_kg));
  for (std::size_t i = 0; i < wanted.gains.size(); ++i)
    if (float_bits(found.gains[i]) != float_bits(wanted.gains[i]))
      return differ(names[i], static_cast<double>(found.gains[i]), static_cast<double>(wanted.gains[i]));
  const std::vector<std::uint32_t> settings = AppOnHost::settings(),
                                   of_image = image.settings(settings.size());
  for (std::size_t i = 0; i < settings.size(); ++i)
    if (of_image[i] != settings[i])
      return fmt::format(
          "word {} of the controller's settings (thrust map, limits, gains of the attitude) is {:#010x} in "
          "the image, {:#010x} in the app's source",
          i, of_image[i], settings[i]);
  const AppConstants constants = AppOnHost::constants();
  for (std::size_t i = 0; i < expected.constants.size(); ++i)
    if (constants[i] != expected.constants[i])
      return fmt::format("the app has {} = {:.9g}, gains and model {:.9g}", constants[i].first,
                         constants[i].second, expected.constants[i].second);
  return "";
}

void match_app(const files::Network& network, const ElfImage& image, int most_neighbours,
               const AppExpectation& expected, CodeMatch& result) {
  const std::vector<std::string> path = call_path(image, "appMain", kPredict);
  if (path.empty()) {
    result.difference = "no calls lead from appMain() to predict_force_z(): the app flies another evaluation";
    return;
  }
  AppInImage app(image);
  result.difference = different_start(expected, app);
  if (result.difference.empty() && !app.passes_test()) result.difference = "the app's self-test fails";
  if (!result.difference.empty()) return;
  result.compared.push_back(fmt::format(
      "the app's parameters and constants at start: mass, gains, thrust map, limits; expected from {}",
      expected.constants.empty() ? "the app's source" : "gains and model"));
  const AppParameters& normal = expected.parameters;
  result.difference = fly(network, golden_flight(normal, kPeriodsOfFlight, 1), most_neighbours, app);
  if (!result.difference.empty()) return;
  const files::Network other = with_other_weights(network, kOtherWeightsSeed);
  AppInImage with_others(image);
  write_weights(other, image, with_others.machine());
  if (with_others.passes_test()) {
    result.difference = "the self-test passes with other weights in flash";
    return;
  }
  const std::string elsewhere =
      fly(other, golden_flight(normal, kPeriodsWithOtherWeights, 2), most_neighbours, with_others);
  if (!elsewhere.empty()) {
    result.difference = fmt::format(kFromElsewhere, elsewhere);
    return;
  }
  result.compared.push_back(
      fmt::format("the app: {} periods of appMain() and {} calls of controllerOutOfTree() in two golden "
                  "flights, the second with other "
                  "weights, bit for bit; calls lead from appMain() to predict_force_z() through {} "
                  "functions; the self-test finds "
                  "other weights",
                  kPeriodsOfFlight + kPeriodsWithOtherWeights,
                  5 * (kPeriodsOfFlight + kPeriodsWithOtherWeights), path.size() - 2));
  result.not_covered.emplace_back(
      "the firmware around the app: its start-up code, what it passes to controllerOutOfTree(), and what it "
      "does "
      "with the result");
  result.not_covered.emplace_back(
      "inputs other than those of the golden flights, and code that recognises the test by its addresses");
  result.not_covered.emplace_back("the kinds of vehicles listed in vehicles.h");
}

}  // namespace

CodeMatch match_code(const files::Network& network, const ElfImage& image, int most_neighbours,
                     const ExpectApp& expect_app) {
  CodeMatch result;
  if (network.plain || files::neighbour_kinds(network).empty()) {
    result.why_not = "swarmcert exports deep sets, and this is another network";
    return result;
  }
  result.why_not = image.why_not;
  if (!result.why_not.empty()) return result;
  const Symbol* const predict = image.find(kPredict);
  if (predict == nullptr) {
    result.why_not =
        "it has no symbol of swarmcert_network::predict_force_z(): link without stripping symbols";
    return result;
  }
  if (!predict->is_thumb) {
    result.why_not = "predict_force_z() is not Thumb code";
    return result;
  }
  result.holds_app = holds_app(image);
  try {
    match_function(network, image, most_neighbours, predict->address, result);
    if (result.difference.empty() && result.holds_app)
      match_app(network, image, most_neighbours, expect_app(), result);
    if (!result.holds_app)
      result.not_covered.emplace_back(
          "which code calls predict_force_z(), and with what inputs: the image does not hold the Crazyflie "
          "app");
    result.outcome = result.difference.empty() ? CodeMatch::Outcome::kSame : CodeMatch::Outcome::kDifferent;
  } catch (const NotRun& error) {
    result.why_not = error.what();
  }
  return result;
}

}  // namespace swarmcert::firmware
