#include "nn/weights/samples.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "nn/base/file_keys.h"
#include "nn/base/input_error.h"
#include "nn/weights/functions.h"

namespace swarmcert::files {
namespace {

std::string short_text(double value) {
  std::ostringstream text;
  text.precision(9);
  text << value;
  return text.str();
}

/// Returns "(0.1, 0.2)", with at most eight numbers.
std::string listed(const std::vector<double>& values) {
  constexpr std::size_t kMost = 8;
  std::string text = "(";
  for (std::size_t k = 0; k < values.size() && k < kMost; ++k)
    text += (k == 0 ? "" : ", ") + short_text(values[k]);
  return text + (values.size() > kMost ? ", ...)" : ")");
}

double tolerance_of(const Samples& samples, double relative) {
  const auto outputs = static_cast<std::size_t>(samples.outputs);
  double spread = 0, magnitude = 0;
  for (std::size_t k = 0; k < outputs; ++k) {
    double least = samples.y[k], most = samples.y[k];
    for (std::size_t i = k; i < samples.y.size(); i += outputs) {
      least = std::min(least, samples.y[i]);
      most = std::max(most, samples.y[i]);
    }
    spread = std::max(spread, most - least);
    magnitude = std::max({magnitude, std::abs(least), std::abs(most)});
  }
  return relative * (spread > 0 ? spread : magnitude) + 0x1p-20 * magnitude;
}

struct Worst {
  std::size_t sample = 0, output = 0;
  double deviation = 0, computed = 0;
};

[[noreturn]] void refuse_samples(const Samples& samples, const Worst& worst, const std::vector<double>& input,
                                 double tolerance, bool is_clamped_there) {
  const auto outputs = static_cast<std::size_t>(samples.outputs);
  throw InputError(
      {samples.path, samples.place(worst.sample), "output " + std::to_string(worst.output),
       short_text(samples.y[worst.sample * outputs + worst.output]),
       "the function of the weight file gives " + short_text(worst.computed) + " at the inputs " +
           listed(input) + ", the worst of " + std::to_string(samples.count()) + " samples (tolerance " +
           short_text(tolerance) + ")",
       is_clamped_there
           ? "this input lies outside input.clamp: record inputs inside it"
           : "the file is not the recorded network: it may differ in the order of its layers (--order), an "
             "activation (--activation), a skip connection, or its weights"});
}

}  // namespace

std::string Samples::place(std::size_t i) const {
  return i < lines.size() ? "line " + std::to_string(lines[i]) : "sample " + std::to_string(i);
}

void describe_samples_file(Keys& keys) {
  const KeysOfTable recorded = [](Keys& table) {
    using Row = std::vector<double>;
    table.may<std::vector<Row>>("inputs", "One row per sample.");
    table.may<std::vector<std::variant<double, Row>>>("outputs", "One number or row per sample.");
  };
  keys.schema(kSamplesSchema);
  keys.may_named_tables("networks", "By name of a part: its recorded inputs and outputs.", recorded);
  recorded(keys);
}

Json samples_json(const std::map<std::string, Samples>& samples) {
  Json networks = Json::object();
  for (const auto& [part, recorded] : samples) {
    const auto rows = [](const std::vector<double>& numbers, int columns) {
      Json list = Json::array();
      for (std::size_t i = 0; i < numbers.size(); i += static_cast<std::size_t>(columns))
        list.push_back(std::vector<double>(numbers.begin() + static_cast<std::ptrdiff_t>(i),
                                           numbers.begin() + static_cast<std::ptrdiff_t>(i) + columns));
      return list;
    };
    networks[part] = {{"inputs", rows(recorded.x, recorded.inputs)},
                      {"outputs", rows(recorded.y, recorded.outputs)}};
  }
  return {{"schema", kSamplesSchema}, {"networks", std::move(networks)}};
}

SampleAgreement hold_against(const Network& network, const FunctionId& part, const Samples& samples,
                             double relative) {
  const Evaluator<double> evaluator(*parts(network).at(part));
  const bool has_clamp = network.clamp && is_clamped(part);
  const double tolerance = tolerance_of(samples, relative);
  const auto inputs = static_cast<std::size_t>(samples.inputs),
             outputs = static_cast<std::size_t>(samples.outputs);
  Worst worst;
  const auto input_of = [&](std::size_t i) {
    const auto first = samples.x.begin() + static_cast<std::ptrdiff_t>(i * inputs);
    return std::vector<double>(first, first + static_cast<std::ptrdiff_t>(inputs));
  };
  const auto clamped = [&](std::vector<double> input) {
    for (std::size_t k = 0; has_clamp && k < inputs; ++k)
      input[k] = std::min(std::max(input[k], network.clamp->lower[k]), network.clamp->upper[k]);
    return input;
  };
  for (std::size_t i = 0; i < samples.count(); ++i) {
    const std::vector<double> computed = evaluator(clamped(input_of(i)));
    for (std::size_t k = 0; k < outputs; ++k) {
      const double deviation = std::abs(computed[k] - samples.y[i * outputs + k]);
      if (std::isnan(worst.deviation) || deviation <= worst.deviation) continue;  // an overflow gives NaN
      worst = {i, k, deviation, computed[k]};
    }
  }
  if (!(worst.deviation <= tolerance)) {
    const std::vector<double> input = input_of(worst.sample);
    refuse_samples(samples, worst, input, tolerance, clamped(input) != input);
  }
  return {samples.path, samples.sha256, samples.count(), tolerance, worst.deviation};
}

}  // namespace swarmcert::files
