#include "nn/weights/record_samples.h"

#include <algorithm>
#include <memory>

#include "nn/base/random.h"
#include "nn/weights/functions.h"

namespace swarmcert::files {
namespace {

constexpr double kReach = 2;        ///< range of the inputs if nothing limits them
constexpr double kFarthest = 1000;  ///< range of the inputs if a clamp is wider than this

}  // namespace

std::map<std::string, Samples> record_samples(const Network& network, const PartOutput& output, int count,
                                              std::uint64_t seed) {
  std::map<std::string, Samples> result;
  Random random(seed);
  for (const auto& [part, weights] : parts(network)) {
    Samples& samples = result[part.name()];
    samples.inputs = weights->inputs();
    samples.outputs = weights->outputs();
    const bool has_clamp = network.clamp && is_clamped(part);
    for (int i = 0; i < count; ++i) {
      std::vector<float> input;
      for (std::size_t k = 0; k < static_cast<std::size_t>(samples.inputs); ++k) {
        const double lower = has_clamp ? std::max(network.clamp->lower[k], -kFarthest) : -kReach;
        const double upper = has_clamp ? std::min(network.clamp->upper[k], kFarthest) : kReach;
        // Slightly inside the range, so that rounding to float32 does not leave the clamp.
        const double share = 0.5 + 0.499 * random.symmetric();
        input.push_back(static_cast<float>(lower + share * (upper - lower)));
      }
      samples.x.insert(samples.x.end(), input.begin(), input.end());
      const std::vector<double> y = output(part.name(), input);
      samples.y.insert(samples.y.end(), y.begin(), y.end());
    }
  }
  return result;
}

PartOutput float32_output(const Network& network) {
  const auto evaluators = std::make_shared<std::map<std::string, Evaluator<float>>>();
  for (const auto& [part, weights] : parts(network))
    evaluators->emplace(part.name(), Evaluator<float>(*weights));
  return [evaluators](const std::string& part, const std::vector<float>& input) {
    const std::vector<float> y = evaluators->at(part)(input);
    return std::vector<double>(y.begin(), y.end());
  };
}

}  // namespace swarmcert::files
