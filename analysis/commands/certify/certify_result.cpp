#include <algorithm>

#include "analysis/cli/command.h"
#include "analysis/commands/certify/branch_outlook.h"
#include "analysis/commands/certify/certify_output.h"
#include "nn/weights/chain.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::analysis {
namespace {

using files::Record;
using lipschitz::Certification;
using lipschitz::CertifiedBound;
using lipschitz::CertifiedLayer;
using lipschitz::Verdict;

/// A point of one network's input.
struct Place {
  std::string network;
  std::vector<float> x;
};

template <class Point>
std::vector<Place> points_of(const std::vector<files::FunctionId>& networks,
                             const std::vector<Point>& points) {
  std::vector<Place> result;
  for (std::size_t j = 0; j < points.size(); ++j)
    result.push_back({networks[j].name(), {points[j].begin(), points[j].end()}});
  return result;
}

void describe_place(Record& record, const Place& place) {
  record.field("network", place.network, "");
  record.field("x", place.x, "");
}

void describe_attained(Record& record, const lipschitz::Attained& attained) {
  record.field("value", attained.value, "");
  record.list("points", points_of(attained.networks, attained.points), "Where; empty: no neighbours.",
              describe_place);
}

/// A range with what the certificate states of it.
struct RangeRow {
  lipschitz::CertifiedRange range;
  std::string unit;
  const lipschitz::CertifiedValues* stated = nullptr;
};

void describe_range(Record& record, const RangeRow& row) {
  const lipschitz::CertifiedRange& range = row.range;
  const auto index = static_cast<std::size_t>(range.output);
  const auto in_certificate = [&row](auto value) {
    return row.stated != nullptr ? std::optional<double>(value(*row.stated)) : std::nullopt;
  };
  record.field("function", range.function.name(), "");
  record.field("output", range.output, "Index, from 0.");
  record.constant("domain", "box", "");
  record.field("neighbours", range.neighbours_at_most, "Most neighbours; 0: a plain network.");
  record.field("unit", row.unit, "");
  record.field("lower", range.lower, "", "", "proved lower bound");
  record.field("upper", range.upper, "", "", "proved upper bound");
  record.field("largest_magnitude", range.largest(), "", "", "proved upper bound");
  record.object("lower_witness", "A value that is attained.",
                [&](Record& r) { describe_attained(r, range.least); });
  record.object("upper_witness", "Likewise.", [&](Record& r) { describe_attained(r, range.greatest); });
  record.field("cut_off_jump", range.jump, "Largest change when a neighbour comes or goes.", "",
               "proved upper bound");
  record.constant("arithmetic", "exact", "The exact function of the stored weights is bounded.");
  record.field("lower_in_certificate", in_certificate([&](const auto& s) { return s.lower[index]; }),
               "What the certificate states; null: nothing.");
  record.field("upper_in_certificate", in_certificate([&](const auto& s) { return s.upper[index]; }),
               "Likewise.");
  record.field("jump_in_certificate", row.stated != nullptr ? row.stated->jump : std::nullopt, "Likewise.");
}

/// A bound of a claim, or of a law, with what is known beside the statement.
struct BoundRow {
  lipschitz::BoundSummary summary;
  std::optional<CertifiedBound> bound;  ///< of a claim
  std::optional<lipschitz::Comparison> comparison;
};

void describe_comparison(Record& record, const BoundRow& row) {
  const CertifiedBound bound = row.bound.value_or(CertifiedBound());
  const lipschitz::Comparison comparison = row.comparison.value_or(lipschitz::Comparison());
  const auto& combettes_pesquet = comparison.combettes_pesquet;
  const auto& eclipse_fast = comparison.eclipse_fast;
  record.field("combettes_pesquet_upper",
               combettes_pesquet ? std::optional(combettes_pesquet->value()) : std::nullopt, "", "",
               "proved upper bound");
  record.field("eclipse_fast_upper", eclipse_fast ? std::optional(eclipse_fast->upper.value()) : std::nullopt,
               "", "", "proved upper bound");
  record.field("pattern_floor_estimate", comparison.floor.slope.value(), "Slope of some ReLU pattern.", "",
               "estimate");
  record.list("stages", comparison.stages, "Where the product of norms is lost.",
              [](Record& r, const lipschitz::StageLoss& stage) {
                r.field("layer", stage.name, "");
                r.field("norm", stage.norm, "Spectral norm.");
                r.field("gain", stage.gain, "Along the steepest pattern.", "", "estimate");
                r.field("loss", stage.loss(), "Their ratio.");
              });
  record.field("words", explain(comparison, bound.product.value(), bound.upper.value(), slope_found(bound)),
               "");
}

void describe_outlook(Record& record, const CertifiedBound& bound) {
  const BranchOutlook outlook = branch_outlook(bound).value_or(BranchOutlook());
  record.field("ratio", BranchOutlook::kRatio, "Of upper and lower bound that is aimed at.");
  record.field("boxes_estimate", outlook.boxes, "Boxes for it; null: not to be foreseen.", "", "estimate");
  record.field("gap_halfway", outlook.gap_halfway, "Gap after half of the boxes.");
  record.field("undecided", bound.outlook.undecided, "Neurons of the dominating box.");
  record.field("neurons", bound.outlook.neurons, "");
  record.field("slope_in_part_estimate", bound.outlook.slope_in_part, "Slope found in it.", "", "estimate");
  record.field("relaxation_share_estimate", outlook.relaxation_share,
               "Of the gap, that slopes found there do not explain.", "", "estimate");
  record.field("words", branch_outlook_words(bound), "");
}

void describe_slope_witness(Record& record, const lipschitz::FoundSlope& found) {
  const lipschitz::SlopeWitness witness = found.witness.value_or(lipschitz::SlopeWitness());
  record.field("x", witness.x, "");
  record.field("y", witness.y, "");
  record.list("others", points_of(found.other_networks, witness.others), "Inputs of the other neighbours.",
              describe_place);
}

void describe_bound(Record& record, const BoundRow& row) {
  describe(record, row.summary);
  const bool is_claim = row.bound.has_value();
  const CertifiedBound bound = row.bound.value_or(CertifiedBound());
  record.may_fields(is_claim, [&](Record& r) {
    r.object_or_null(bound.lower.witness.has_value(), "lower_witness",
                     "Two points with this slope; null: none.",
                     [&](Record& inner) { describe_slope_witness(inner, bound.lower); });
    r.field("product_upper", bound.product.value(), "Product of the spectral norms.", "",
            "proved upper bound");
    r.field("search_rounds", bound.lower.rounds, "Of the search for steep slopes.");
  });
  const auto stop = [](bool has_run, const auto& of) {
    return has_run ? std::optional<std::string>(name(of)) : std::nullopt;
  };
  record.may("branch_stop", stop(bound.branch_stop != lipschitz::BranchStop::kNothingRun, bound.branch_stop),
             "Why branch and bound ended.");
  record.may_fields(bound.nodes > 0, [&](Record& r) {
    const double slope = slope_found(bound);
    r.field("nodes", bound.nodes, "Boxes that were examined.");
    r.field("gap", slope > 0 ? std::optional(bound.upper.value() / slope - 1) : std::nullopt,
            "upper / lower - 1.");
    r.object_or_null(branch_outlook(bound).has_value(), "outlook",
                     "What more boxes would give; null: unknown.",
                     [&](Record& inner) { describe_outlook(inner, bound); });
  });
  record.may("sdp_stop", stop(bound.sdp.stop != lipschitz::LipSdpStop::kNothingRun, bound.sdp.stop),
             "Why the semidefinite program ended.");
  record.may_object(row.comparison.has_value(), "comparison", "Other bounds, and where this one is lost.",
                    [&row](Record& r) { describe_comparison(r, row); });
}

std::vector<BoundRow> bound_rows(const files::Network& network, const CertifyOutput& output) {
  std::vector<BoundRow> rows;
  for (std::size_t i = 0; i < output.found.bounds.size(); ++i) {
    const CertifiedBound& bound = output.found.bounds[i];
    rows.push_back({summary(network, bound), bound,
                    i < output.comparisons.size() ? output.comparisons[i] : std::nullopt});
  }
  for (const lipschitz::CertifiedLaw& law : output.found.laws)
    rows.push_back({summary(network, law), {}, {}});
  return rows;
}

/// A step of the chain of one part.
struct PartStep {
  files::ChainStep step;
  std::string part;
};

/// The operations of all parts, one after the other.
std::vector<PartStep> chain_steps(const files::Network& network) {
  std::vector<PartStep> steps;
  for (const auto& [part, weights] : files::parts(network))
    for (const files::ChainStep& step : files::chain(network, part)) steps.push_back({step, part.name()});
  return steps;
}

/// Where the operation chain of a part comes from, as far as known.
void describe_chain_source(Record& record, const files::Weights* const& of_part) {
  const files::Weights none;
  const files::Weights& weights = of_part != nullptr ? *of_part : none;
  const files::ActivationSource source = weights.activation_source;
  record.field("order", files::name(weights.order_source), "Where the order of the layers comes from.");
  record.field("activation",
               source == files::ActivationSource::kFile   ? "file"
               : source == files::ActivationSource::kUser ? "user"
                                                          : "assumed",
               "Stated by the file, given by the user or network.toml, or assumed.");
  record.field("notes", weights.notes, "What was computed when the file was read.");
  record.field("unused", weights.unused,
               "Tensors and entries that are not part of the network, with the reason.");
  record.field("rounding_of_slope", files::rounding_of_slope(weights), "Of folded weights.", "",
               "upper bound");
}

struct SamplesRow {
  std::string part;
  files::SampleAgreement agreement;
};

void describe_samples(Record& record, const SamplesRow& row) {
  record.field("network", row.part, "");
  record.field("file", row.agreement.path, "");
  record.field("sha256", row.agreement.sha256, "");
  record.field("count", row.agreement.count, "");
  record.field("tolerance", row.agreement.tolerance, "");
  record.field("largest_deviation", row.agreement.largest_deviation, "");
}

void describe_layer(Record& record, const CertifiedLayer& layer) {
  std::optional<bool> respects;
  if (layer.respects_gamma == Verdict::kProved) respects = true;
  if (layer.respects_gamma == Verdict::kRefuted) respects = false;
  record.field("network", layer.network.name(), "");
  record.field("name", layer.name, "");
  record.field("spectral_norm", Interval{layer.norm.norm.lower.value(), layer.norm.norm.upper.value()}, "",
               "", "proved enclosure");
  record.field("respects_gamma", respects, "Null: not stated or not decided.");
}

struct Float32Row {
  lipschitz::Float32Error error;
  std::string unit;
  const lipschitz::CertifiedValues* stated = nullptr;
};

void describe_float32(Record& record, const Float32Row& row) {
  record.field("function", row.error.function.name(), "");
  record.field("neighbours", row.error.neighbours_at_most, "Most neighbours; 0: a plain network.");
  record.field("unit", row.unit, "");
  record.field("bound", row.error.total.value(), "", "", "proved upper bound");
  record.field("evaluation", row.error.evaluation.value(), "Of the arithmetic.", "", "proved upper bound");
  record.field("inputs", row.error.inputs.value(), "Of the conversion of the inputs.", "",
               "proved upper bound");
  record.constant("arithmetic", "float32 against exact", "");
  const auto stated = [&row](check::Summation summation) {
    return row.stated != nullptr ? row.stated->float32_error[summation] : std::nullopt;
  };
  record.field("bound_in_certificate", stated(check::kInOrder),
               "What the certificate states for the order of summation of the exported code; null: nothing.");
  record.field("bound_in_certificate_any_order", stated(check::kAnyOrder),
               "What it states for any order, with or without fused multiply-adds.");
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

}  // namespace

void describe_certify(Record& record, const files::Network& network, const CertifyOutput& output) {
  const Certification& found = output.found;
  std::vector<std::pair<std::string, const files::Weights*>> sources;
  for (const auto& [part, weights] : files::parts(network)) sources.emplace_back(part.name(), weights);
  std::vector<SamplesRow> samples;
  for (const auto& [part, agreement] : found.samples) samples.push_back({part.name(), agreement});
  std::vector<RangeRow> ranges;
  for (const lipschitz::CertifiedRange& range : output.ranges)
    ranges.push_back(
        {range, output_unit(network), in_certificate(output, range.function, range.neighbours_at_most)});
  std::vector<Float32Row> errors;
  for (const lipschitz::Float32Error& error : output.float32_errors)
    errors.push_back(
        {error, output_unit(network), in_certificate(output, error.function, error.neighbours_at_most)});

  record.field("as", found.as_float32 ? std::optional<std::string>("float32") : std::nullopt,
               "Arithmetic in which the network flies; null: as stored.");
  record.field("gamma", found.gamma ? std::optional(found.gamma->value) : std::nullopt,
               "Declared largest spectral norm of a layer or network; null: none.");
  record.field("max_lipschitz", output.max_lipschitz > 0 ? std::optional(output.max_lipschitz) : std::nullopt,
               "Limit of --max-lipschitz; null: none.");
  record.list("chain", chain_steps(network), "Operations that were certified, in order.",
              [](Record& r, const PartStep& one) {
                const bool has_layer = one.step.op == "linear";
                r.field("op", one.step.op, "");
                r.field("layer", has_layer ? std::optional(one.step.layer) : std::nullopt,
                        "Null: not linear.");
                r.field("inputs", one.step.inputs, "");
                r.field("outputs", one.step.outputs, "");
                r.field("network", one.part, "");
              });
  record.entries("chain_source", sources, "What is known of the chain, by part.", describe_chain_source);
  record.field(
      "silent", files::silent_compositions(network),
      "Neighbours > vehicle among which the set functions are 0; ranges hold this 0, jumps the step to it.");
  record.list("samples", samples, "Recorded outputs that the chain reproduces.", describe_samples);
  record.field("assumed", output.assumed,
               "What was guessed about the function; not empty: nothing is proved, exit 4.");
  record.list("layers", stated_norms(network, found), "Spectral norm of every layer.", describe_layer);
  record.list("bounds", bound_rows(network, output), "One per function, domain, block and law.",
              describe_bound);
  record.list("range", ranges, "Range over the box.", describe_range);
  record.list("float32_error", errors, "Distance of the float32 evaluation from the exact function.",
              describe_float32);
  record.field("status", lipschitz::status(output.is_interrupted()),
               "interrupted: a search was cut short; its bounds hold all the same.");
  record.field("verdict", name(output.verdict),
               "proved, refuted or inconclusive: gamma and --max-lipschitz hold.");
}

files::Node certify_result(const files::Network& network, const CertifyOutput& output) {
  return described_result("certify", files_read(network, output), output.seed,
                          [&](Record& record) { describe_certify(record, network, output); });
}

}  // namespace swarmcert::analysis
