#include "nn/weights/chain.h"

#include <utility>

#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::files {

std::vector<ChainStep> chain(const Network& network, const FunctionId& part) {
  const Weights& weights = *parts(network).at(part);
  std::vector<ChainStep> result;
  if (network.clamp && is_clamped(part)) result.push_back({"clamp", "", weights.inputs(), weights.inputs()});
  for (const Layer& layer : weights.layers) {
    result.push_back({"linear", layer.name, layer.inputs, layer.outputs});
    if (&layer != &weights.layers.back())
      result.push_back({op_after(layer), "", layer.outputs, layer.outputs, words_after(layer)});
  }
  return result;
}

Json chain_json(const std::vector<ChainStep>& chain) {
  Json list = Json::array();
  for (const ChainStep& step : chain) {
    list.push_back({{"op", step.op},
                    {"layer", step.op == "linear" ? Json(step.layer) : Json()},
                    {"inputs", step.inputs},
                    {"outputs", step.outputs}});
  }
  return list;
}

std::string chain_words(const std::vector<ChainStep>& chain) {
  std::string text;
  for (const ChainStep& step : chain) {
    if (!text.empty()) text += " - ";
    text += !step.words.empty()  ? step.words
            : step.op == "clamp" ? "clamp"
            : step.layer.empty() ? "linear"
                                 : step.layer;
  }
  return text;
}

std::string chain_words(const Network& network) {
  std::vector<std::pair<std::string, std::string>> chains;  // words, and the parts that have them
  for (const auto& [part, weights] : parts(network)) {
    const std::string words = chain_words(chain(network, part));
    auto same = chains.begin();
    while (same != chains.end() && same->first != words) ++same;
    if (same == chains.end()) {
      chains.emplace_back(words, part.name());
    } else {
      same->second += ", " + part.name();
    }
  }
  if (network.plain) return chains.front().first;
  std::string text;
  for (const auto& [words, names] : chains) text += (text.empty() ? "" : "; ") + names + ": " + words;
  for (const std::string& composition : silent_compositions(network)) text += "; silent: " + composition;
  return text;
}

}  // namespace swarmcert::files
