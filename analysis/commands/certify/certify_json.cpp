#include <algorithm>

#include "analysis/cli/command.h"
#include "analysis/commands/certify/branch_outlook.h"
#include "analysis/commands/certify/certify_output.h"
#include "nn/weights/chain.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {
namespace {

using files::Json;
using lipschitz::Attained;
using lipschitz::Certification;
using lipschitz::CertifiedBound;
using lipschitz::CertifiedLayer;
using lipschitz::Verdict;

Json attained_json(const Attained& attained) {
  Json points = Json::array();
  for (std::size_t j = 0; j < attained.points.size(); ++j)
    points.push_back({{"network", attained.networks[j].name()}, {"x", attained.points[j]}});
  return {{"value", attained.value}, {"points", std::move(points)}};
}

Json number_or_null(const std::optional<double>& number) { return number ? Json(*number) : Json(); }

Json range_json(const files::Network& network, const CertifyOutput& output,
                const lipschitz::CertifiedRange& range) {
  const auto* const stated = in_certificate(output, range.function, range.neighbours_at_most);
  const auto index = static_cast<std::size_t>(range.output);
  return {{"function", range.function.name()},
          {"output", range.output},
          {"domain", "box"},
          {"neighbours", range.neighbours_at_most},
          {"unit", output_unit(network)},
          {"lower", range.lower},
          {"upper", range.upper},
          {"largest_magnitude", range.largest()},
          {"lower_witness", attained_json(range.least)},
          {"upper_witness", attained_json(range.greatest)},
          {"cut_off_jump", range.jump},
          {"arithmetic", "exact"},
          {"lower_in_certificate", stated != nullptr ? Json(stated->lower[index]) : Json()},
          {"upper_in_certificate", stated != nullptr ? Json(stated->upper[index]) : Json()},
          {"jump_in_certificate", stated != nullptr ? number_or_null(stated->jump) : Json()}};
}

Json comparison_json(const CertifiedBound& bound, const lipschitz::Comparison& comparison) {
  Json stages = Json::array();
  for (const lipschitz::StageLoss& stage : comparison.stages)
    stages.push_back(
        {{"layer", stage.name}, {"norm", stage.norm}, {"gain", stage.gain}, {"loss", stage.loss()}});
  Json json = {
      {"combettes_pesquet_upper", nullptr},
      {"eclipse_fast_upper", nullptr},
      {"pattern_floor_estimate", comparison.floor.slope.value()},
      {"stages", std::move(stages)},
      {"words", explain(comparison, bound.product.value(), bound.upper.value(), slope_found(bound))}};
  if (comparison.combettes_pesquet) json["combettes_pesquet_upper"] = comparison.combettes_pesquet->value();
  if (comparison.eclipse_fast) json["eclipse_fast_upper"] = comparison.eclipse_fast->upper.value();
  return json;
}

Json outlook_json(const CertifiedBound& bound) {
  const std::optional<BranchOutlook> outlook = branch_outlook(bound);
  if (!outlook) return nullptr;
  return {{"ratio", BranchOutlook::kRatio},
          {"boxes_estimate", outlook->boxes ? Json(*outlook->boxes) : Json()},
          {"gap_halfway", outlook->gap_halfway},
          {"undecided", bound.outlook.undecided},
          {"neurons", bound.outlook.neurons},
          {"slope_in_part_estimate", bound.outlook.slope_in_part},
          {"relaxation_share_estimate", outlook->relaxation_share},
          {"words", branch_outlook_words(bound)}};
}

Json witness_json(const lipschitz::FoundSlope& found) {
  if (!found.witness) return nullptr;
  Json others = Json::array();
  for (std::size_t j = 0; j < found.witness->others.size(); ++j) {
    others.push_back({{"network", found.other_networks[j].name()}, {"x", found.witness->others[j]}});
  }
  return {{"x", found.witness->x}, {"y", found.witness->y}, {"others", std::move(others)}};
}

/// The operations of all parts, one after the other.
Json chains_json(const files::Network& network) {
  Json list = Json::array();
  for (const auto& [part, weights] : files::parts(network)) {
    for (Json& step : files::chain_json(files::chain(network, part))) {
      step["network"] = part.name();
      list.push_back(std::move(step));
    }
  }
  return list;
}

/// Where the operation chain of each part comes from, as far as known.
Json chain_sources_json(const files::Network& network) {
  Json sources = Json::object();
  for (const auto& [part, weights] : files::parts(network)) {
    const files::ActivationSource source = weights->activation_source;
    sources[part.name()] = {{"order", files::name(weights->order_source)},
                            {"activation", source == files::ActivationSource::kFile   ? "file"
                                           : source == files::ActivationSource::kUser ? "user"
                                                                                      : "assumed"},
                            {"notes", weights->notes},
                            {"unused", weights->unused},
                            {"rounding_of_slope", files::rounding_of_slope(*weights)}};
  }
  return sources;
}

Json samples_result(const Certification& found) {
  Json list = Json::array();
  for (const auto& [part, agreement] : found.samples) {
    list.push_back({{"network", part.name()},
                    {"file", agreement.path},
                    {"sha256", agreement.sha256},
                    {"count", agreement.count},
                    {"tolerance", agreement.tolerance},
                    {"largest_deviation", agreement.largest_deviation}});
  }
  return list;
}

Json layer_json(const CertifiedLayer& layer) {
  Json respects;
  if (layer.respects_gamma == Verdict::kProved) respects = true;
  if (layer.respects_gamma == Verdict::kRefuted) respects = false;
  return {{"network", layer.network.name()},
          {"name", layer.name},
          {"spectral_norm", {layer.norm.norm.lower.value(), layer.norm.norm.upper.value()}},
          {"respects_gamma", respects}};
}

/// JSON of bound number `i`.
Json bound_json(const files::Network& network, const CertifyOutput& output, std::size_t i) {
  const CertifiedBound& bound = output.found.bounds[i];
  Json json = summary(network, bound);
  json["lower_witness"] = witness_json(bound.lower);
  json["product_upper"] = bound.product.value();
  json["search_rounds"] = bound.lower.rounds;
  if (bound.branch_stop != lipschitz::BranchStop::kNothingRun) json["branch_stop"] = name(bound.branch_stop);
  if (bound.nodes > 0) {
    json["nodes"] = bound.nodes;
    const double slope = slope_found(bound);
    json["gap"] = slope > 0 ? Json(bound.upper.value() / slope - 1) : Json();
    json["outlook"] = outlook_json(bound);
  }
  if (bound.sdp.stop != lipschitz::LipSdpStop::kNothingRun) json["sdp_stop"] = name(bound.sdp.stop);
  if (i < output.comparisons.size() && output.comparisons[i])
    json["comparison"] = comparison_json(bound, *output.comparisons[i]);
  return json;
}

Json float32_error_json(const files::Network& network, const CertifyOutput& output,
                        const lipschitz::Float32Error& error) {
  const auto* const stated = in_certificate(output, error.function, error.neighbours_at_most);
  return {{"function", error.function.name()},
          {"neighbours", error.neighbours_at_most},
          {"unit", output_unit(network)},
          {"bound", error.total.value()},
          {"evaluation", error.evaluation.value()},
          {"inputs", error.inputs.value()},
          {"arithmetic", "float32 against exact"},
          {"bound_in_certificate", stated != nullptr ? number_or_null(stated->float32_error) : Json()}};
}

/// The files on which the result depends, without duplicates.
std::vector<std::string> files_read(const files::Network& network, const CertifyOutput& output) {
  std::vector<std::string> inputs = input_files(network);
  if (!output.domain_file.empty()) inputs.push_back(output.domain_file);
  for (const auto& [part, agreement] : output.found.samples) {
    if (std::find(inputs.begin(), inputs.end(), agreement.path) == inputs.end())
      inputs.push_back(agreement.path);
  }
  return inputs;
}

/// Returns an array with one element per item, as written by `json_of`.
template <class Items, class JsonOf>
Json list_of(const Items& items, const JsonOf& json_of) {
  Json list = Json::array();
  for (const auto& item : items) list.push_back(json_of(item));
  return list;
}

}  // namespace

Json certify_json(const files::Network& network, const CertifyOutput& output) {
  const Certification& found = output.found;
  Json bounds = Json::array();
  for (std::size_t i = 0; i < found.bounds.size(); ++i) bounds.push_back(bound_json(network, output, i));
  for (const lipschitz::CertifiedLaw& law : found.laws) bounds.push_back(summary(network, law));
  Json result = result_head("certify", files_read(network, output));
  result["seed"] = output.seed;
  result["as"] = found.as_float32 ? Json("float32") : Json();
  result["gamma"] = found.gamma ? Json(found.gamma->value) : Json();
  result["max_lipschitz"] = output.max_lipschitz > 0 ? Json(output.max_lipschitz) : Json();
  result["chain"] = chains_json(network);
  result["chain_source"] = chain_sources_json(network);
  result["silent"] = files::silent_compositions(network);
  result["samples"] = samples_result(found);
  result["assumed"] = output.assumed;
  result["layers"] = list_of(stated_norms(network, found), layer_json);
  result["bounds"] = std::move(bounds);
  result["range"] = list_of(output.ranges, [&](const lipschitz::CertifiedRange& range) {
    return range_json(network, output, range);
  });
  result["float32_error"] = list_of(output.float32_errors, [&](const lipschitz::Float32Error& error) {
    return float32_error_json(network, output, error);
  });
  result["status"] = lipschitz::status(output.is_interrupted());
  result["verdict"] = name(output.verdict);
  return result;
}

}  // namespace swarmcert::analysis
