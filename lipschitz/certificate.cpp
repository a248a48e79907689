#include "lipschitz/certify.h"
#include "lipschitz/checker/canonical_network.h"
#include "lipschitz/checker/statement.h"
#include "nn/base/content_hash.h"
#include "nn/base/file_keys.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using files::hex_float;
using files::Record;
using Texts = std::vector<std::string>;

template <class Number>
Texts hex_floats(const std::vector<Number>& values) {
  Texts texts;
  for (const Number value : values) texts.push_back(hex_float(static_cast<double>(value)));
  return texts;
}

/// Joins numbers into one string, because a JSON document should not have a node for each number of a tree.
std::string joined(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + hex_float(value);
  return text;
}

// --- the network

void describe_chain(files::Keys& keys) {
  keys.must<std::string>("op", "linear, an activation, or clamp.");
  keys.must<std::optional<std::string>>("layer", "Of a linear operation.");
  keys.must<int>("inputs", "");
  keys.must<int>("outputs", "");
}

void describe_stored_layer(files::Keys& keys) {
  keys.must<std::string>("name", "");
  keys.must<std::optional<std::string>>("tensor", "That holds the weights; null: folded or rewritten.");
  keys.must<Texts>("weights", "One text per row.");
  keys.must<std::string>("biases", "");
  keys.must<std::string>("weight_rounding", "Of folded weights.");
  keys.must<std::string>("bias_rounding", "Likewise.");
}

void describe_samples(files::Keys& keys) {
  keys.must<std::string>("sha256", "Of the recorded samples.");
  keys.must<int>("count", "");
  keys.must<double>("tolerance", "Of every output, in its unit.");
  keys.must<std::string>("tolerance_hex", "The same double.");
  keys.must<double>("largest_deviation", "Of the network from the samples.");
  keys.must<std::string>("largest_deviation_hex", "The same double.");
}

void describe_stored_weights(files::Keys& keys) {
  keys.must<std::string>("file", "Relative to the folder of network.toml, or its name.");
  keys.must<std::string>("sha256", "Of its bytes.");
  keys.must<std::map<std::string, std::string>>("data_files", "Other files that hold numbers.");
  keys.must<std::string>("precision", "As stored.");
  keys.must<Texts>("assumed", "What was guessed when the file was read.");
  keys.must("chain", "Operations in order of evaluation.", "",
            std::vector<files::Node>{files::shape_of_table(describe_chain)});
  keys.must("layers", "Affine layers in order of evaluation; every number a hex float.", "",
            std::vector<files::Node>{files::shape_of_table(describe_stored_layer)});
  keys.must("samples", "null: it was compared with none.", "",
            std::optional<files::Node>(files::shape_of_table(describe_samples)));
}

/// The shape of check::canonical_json(), which the checker reads back.
void describe_canonical_network(files::Keys& keys) {
  keys.must<std::string>("description_sha256", "Of network.toml; empty: none.");
  keys.must_table("options", "With which the files were read.", [](files::Keys& options) {
    options.must<std::string>("key", "");
    for (const char* const list : {"order", "phi_order", "rho_order", "select"})
      options.must<Texts>(list, "");
    options.must<std::string>("activation", "");
    options.may<std::string>("normalization", "File of VecNormalize, from the folder of the weights; none.");
  });
  keys.must_table("output", "", [](files::Keys& output) {
    output.must<std::string>("quantity", "");
    output.must<std::string>("unit", "");
  });
  keys.must_table("input", "", [](files::Keys& input) {
    input.must<Texts>("order", "");
    input.must("clamp", "null: none.", "",
               std::optional<files::Node>(files::shape_of_table([](files::Keys& clamp) {
                 clamp.must<Texts>("lower", "");
                 clamp.must<Texts>("upper", "");
               })));
  });
  keys.must<Texts>("silent", "Compositions in which the output is 0.");
  keys.must_named_tables("weights", "By network.", describe_stored_weights);
  keys.must<std::optional<std::string>>("as", "float32: rounded to it; null: as stored.");
}

files::Json samples_entry(const Certification& certification, const files::FunctionId& part) {
  const auto found = certification.samples.find(part);
  if (found == certification.samples.end()) return nullptr;
  const files::SampleAgreement& agreement = found->second;
  return {{"sha256", agreement.sha256},
          {"count", agreement.count},
          {"tolerance", agreement.tolerance},
          {"tolerance_hex", hex_float(agreement.tolerance)},
          {"largest_deviation", agreement.largest_deviation},
          {"largest_deviation_hex", hex_float(agreement.largest_deviation)}};
}

files::Json network_json(const files::Network& network, const Certification& certification) {
  files::Json canonical = check::canonical_json(network);
  for (const auto& [part, stored] : files::parts(network))
    canonical["weights"][part.name()]["samples"] = samples_entry(certification, part);
  canonical["as"] = certification.as_float32 ? files::Json("float32") : files::Json();
  return canonical;
}

// --- proofs

void describe_factor(Record& record, const check::Factor& factor) {
  Texts rows;
  for (const std::vector<mpz_class>& entries : factor.rows) {
    std::string row;
    for (const mpz_class& entry : entries) row += (row.empty() ? "" : " ") + entry.get_str();
    rows.push_back(std::move(row));
  }
  record.field("unit_exponent", factor.unit_exponent, "");
  record.field("scale", factor.scale, "");
  record.field("rows", rows, "Integers.");
}

void describe_multipliers(Record& record, const UpperProof& proof) {
  record.field("t", hex_floats(proof.t), "Multipliers of the matrix inequality.");
  record.object_or_null(proof.factor.has_value(), "factor", "null: the checker computes it.",
                        [&](Record& r) { describe_factor(r, proof.factor.value_or(check::Factor{})); });
}

constexpr const char* kRhoMeaning = "The square of the bound, a hex float.";

void describe_upper_proof(Record& record, const UpperProof& proof) {
  record.field("rho", hex_float(proof.rho), kRhoMeaning);
  describe_multipliers(record, proof);
}

Texts texts_of(const std::vector<std::vector<check::Conflict>>& conflicts_of_leaves) {
  Texts texts;
  for (const std::vector<check::Conflict>& conflicts : conflicts_of_leaves) {
    std::string text;
    for (const check::Conflict& c : conflicts)
      text += (text.empty() ? "" : " ") + std::to_string(c.first) + (c.first_on ? "+ " : "- ") +
              std::to_string(c.second) + (c.second_on ? "+ " : "- ") + hex_float(c.lambda) + " " +
              hex_float(c.multiplier);
    texts.push_back(std::move(text));
  }
  return texts;
}

void describe_rho_form(Record& record, const RhoForm& form) {
  Texts rows;
  for (Eigen::Index i = 0; i < form.q.rows(); ++i) {
    std::vector<double> row;
    for (Eigen::Index j = 0; j <= i; ++j) row.push_back(form.q(i, j));
    rows.push_back(joined(row));
  }
  record.field("q", rows, "The lower triangle, row by row.");
  record.field("t", hex_floats(form.t), "One multiplier per hidden neuron of rho.");
  record.object("factor", "", [&](Record& r) { describe_factor(r, form.factor); });
}

void describe_range_proof(Record& record, const RangeProof& range) {
  record.field("tree", range.tree, "");
  record.field("least", hex_floats(range.least), "");
  record.field("most", hex_floats(range.most), "");
}

void describe_local_proof(Record& record, const LocalProof& proof) {
  const auto unless_empty = [](Texts texts) {
    return texts.empty() ? std::nullopt : std::optional(std::move(texts));
  };
  Texts multipliers;
  for (const std::vector<double>& t : proof.tree.multipliers) multipliers.push_back(joined(t));
  record.field("tree", proof.tree.tree,
               "Words in preorder: where the box is halved, and what proves a leaf.");
  record.field("multipliers", multipliers, "Of the leaves.");
  record.may("conflicts", unless_empty(texts_of(proof.tree.conflicts)), "Of neurons that are not both on.");
  record.may("radius", unless_empty(hex_floats(proof.radius)), "Of the projective cover of all inputs.");
  record.may_fields(proof.others.has_value(), [&](Record& r) {
    std::vector<std::pair<std::string, RangeProof>> others;
    for (const auto& [part, range] : proof.others.value_or(std::map<files::FunctionId, RangeProof>{}))
      others.emplace_back(part.name(), range);
    r.entries("others", others, "Ranges of the other terms.", describe_range_proof);
    r.list("forms", proof.tree.forms, "Bounds on rho that hold in a part.",
           [](Record& one, const check::Form& form) {
             one.field("q", joined(form.q), "");
             one.field("t", joined(form.t), "");
           });
  });
  record.may_fields(!proof.others, [&](Record& r) {
    r.object_or_null(proof.form.has_value(), "form", "null: rho is the identity.",
                     [&](Record& form) { describe_rho_form(form, proof.form.value_or(RhoForm{})); });
  });
}

void describe_proof(Record& record, const CertifiedBound& bound) {
  const LocalProof local = bound.local.value_or(LocalProof{});
  const UpperProof upper = bound.proof.value_or(UpperProof{});
  record.field("rho", hex_float(bound.local ? local.rho : upper.rho), kRhoMeaning);
  record.may_fields(!bound.local, [&](Record& r) { describe_multipliers(r, upper); });
  record.may_fields(bound.local.has_value(), [&](Record& r) { describe_local_proof(r, local); });
}

// --- what is stated

void describe_proved_layer(Record& record, const CertifiedLayer& layer) {
  const double lower = layer.norm.norm.lower.value(), upper = layer.norm.norm.upper.value();
  record.field("network", layer.network.name(), "");
  record.field("name", layer.name, "");
  record.field("spectral_norm", std::array<double, 2>{lower, upper}, "", "", "proved bounds");
  record.field("spectral_norm_hex", std::array<std::string, 2>{hex_float(lower), hex_float(upper)},
               "The same doubles.");
  record.object("proof", "", [&](Record& proof) {
    proof.field("lower_vector", hex_floats(layer.norm.lower_vector), "v with |W v| >= lower |v|.");
    proof.object("upper", "", [&](Record& r) { describe_upper_proof(r, layer.norm.upper_proof); });
  });
}

/// Describes what results and certificates state; `describe_scale` describes the field `scale` or none.
void describe_statement(Record& record, const BoundSummary& summary,
                        const std::function<void()>& describe_scale) {
  record.field("function", summary.function, "network, phi:KIND, rho:KIND or set:PHI:RHO.");
  record.field("domain", summary.domain, "global: all inputs, or box.");
  record.field("block", summary.block, "Inputs that change: all, position or velocity.");
  record.field("law", summary.law, "What moves: none, one_neighbour, all_stacked, all_max or own_state.");
  record.field("norm", summary.norm, "l2 or weighted_l2.");
  describe_scale();
  record.field("unit", summary.unit, "Output per input.");
  record.field("upper", summary.upper, "Lipschitz constant.", "", "proved upper bound");
  record.field("upper_method", summary.upper_method,
               "product, sdp, eclipse_fast, local_product, local_sdp, branch or law.");
  record.field("status", summary.status, "finished or interrupted; bounds hold in either case.");
  record.field("lower", summary.lower, "Slope between two points that were found; null: none.", "",
               "proved lower bound");
  record.may("neighbours", summary.neighbours, "Most neighbours of each kind.");
}

/// A bound and its statement.
struct ProvedBound {
  BoundSummary summary;
  CertifiedBound bound;
};

void describe_witness(Record& record, const FoundSlope& lower) {
  const SlopeWitness witness = lower.witness.value_or(SlopeWitness{});
  record.field("x", hex_floats(witness.x), "");
  record.field("y", hex_floats(witness.y), "");
  std::vector<std::pair<std::string, Texts>> others;
  for (std::size_t j = 0; j < witness.others.size(); ++j)
    others.emplace_back(lower.other_networks[j].name(), hex_floats(witness.others[j]));
  record.list("others", others, "The other neighbours.", [](Record& r, const auto& other) {
    r.field("network", other.first, "");
    r.field("x", other.second, "");
  });
}

void describe_proved_bound(Record& record, const ProvedBound& row) {
  const CertifiedBound& bound = row.bound;
  describe_statement(record, row.summary, [&] {
    record.field("scale", hex_floats(bound.scale), "Units of the inputs in the weighted norm; empty: l2.");
  });
  const std::optional<SlopeWitness>& witness = bound.lower.witness;
  record.field("upper_hex", hex_float(bound.upper.value()), "The same double.");
  record.field("lower_hex", witness ? std::optional(hex_float(witness->slope.value())) : std::nullopt,
               "The same double.");
  record.object_or_null(witness.has_value(), "lower_witness", "Two points; null: none were found.",
                        [&](Record& r) { describe_witness(r, bound.lower); });
  record.object_or_null(bound.proof || bound.local, "proof", "null: the product of the layers' norms.",
                        [&](Record& r) { describe_proof(r, bound); });
}

void describe_law(Record& record, const CertifiedLaw& law) {
  record.field("rho", law.rho, "Kind of the vehicle.");
  record.field("neighbours", law.neighbours, "That move, of each kind.");
  record.field("domain", law.domain, "global: all inputs, or box.");
  record.field("block", law.block, "Inputs that change.");
  record.field("law", name(law.law), "What moves.");
  record.field("status", status(law.interrupted), "finished or interrupted.");
  record.field("upper", law.upper.value(), "Lipschitz constant.", "", "proved upper bound");
  record.field("upper_hex", hex_float(law.upper.value()), "The same double.");
}

/// Bounds of a vector, each joined into one text.
struct JoinedBounds {
  VectorBounds bounds;
};

void describe(Record& record, const JoinedBounds& vector) {
  const auto error = [&vector](check::Summation summation) {
    const std::vector<double>& errors = vector.bounds.error[summation];
    return errors.empty() ? std::nullopt : std::optional(joined(errors));
  };
  record.field("lower", joined(vector.bounds.lower), "");
  record.field("upper", joined(vector.bounds.upper), "");
  record.field("error", error(check::kAnyOrder),
               "Of a float32 evaluation that sums in any order; null: nothing is said of it.");
  record.field("error_in_order", error(check::kInOrder),
               "Of one that adds to the bias from the first input to the last.");
}

void describe_number(Record& record, const char* name, const std::optional<double>& number,
                     const char* meaning) {
  record.field(name, number, meaning, "", "proved upper bound");
  record.field(files::interned(std::string(name) + "_hex"),
               number ? std::optional(hex_float(*number)) : std::nullopt, "The same double.");
}

void describe_values(Record& record, const CertifiedValues& values) {
  std::map<std::string, std::vector<JoinedBounds>> networks;
  for (const auto& [part, layers] : values.layers)
    for (const VectorBounds& layer : layers) networks[part.name()].push_back({layer});
  std::map<std::string, Texts> errors;
  for (const auto& [part, error] : values.input_error) errors[part.name()] = hex_floats(error);
  record.field("function", values.function.name(), "");
  record.field("neighbours", values.neighbours, "At most, of the kind; 0 for a plain network.");
  record.field("domain", values.in_clamp ? "clamp" : "box", "clamp or box.");
  record.field("input_error", errors.empty() ? std::nullopt : std::optional(errors),
               "How far off the inputs of the float32 evaluation may be, by network; null: nothing is said "
               "of it.");
  record.field("networks", networks, "Of each network, what its layers give before their ReLU.");
  record.field("sum", values.sum ? std::optional(JoinedBounds{*values.sum}) : std::nullopt,
               "Of what rho takes in; null for a plain network.");
  record.field("lower", hex_floats(values.lower), "Of the outputs.");
  record.field("upper", hex_floats(values.upper), "Of the outputs.");
  describe_number(record, "jump", values.jump, "When a neighbour comes or goes.");
  describe_number(record, "float32_error", values.float32_error[check::kAnyOrder],
                  "Of a float32 evaluation that sums in any order.");
  describe_number(record, "float32_error_in_order", values.float32_error[check::kInOrder],
                  "Of one that adds to the bias from the first input to the last.");
}

/// A box in hex floats.
struct HexBox {
  Texts lower, upper;
};

void describe(Record& record, const HexBox& box) {
  record.field("lower", box.lower, "");
  record.field("upper", box.upper, "");
}

/// Everything that a certificate states.
struct Content {
  std::string statement, sha256;
  std::optional<files::Json> network;
  std::map<std::string, HexBox> box;
  std::vector<CertifiedLayer> layers;
  std::vector<ProvedBound> bounds;
  std::vector<CertifiedLaw> laws;
  std::vector<CertifiedValues> values;
};

void describe(Record& record, const Content& content) {
  constexpr const char* kOfNetwork = "The network itself, with the sums of the files that it was read from.";
  record.constant("schema", check::kCertificateSchema, "Name and version of this format.");
  record.field("tool", "swarmcert " SWARMCERT_VERSION, "Name and version of the tool that wrote this.");
  record.field("statement", content.statement, "What the certificate claims.");
  if (record.is_shape())
    record.field("network", files::shape_of_table(describe_canonical_network), kOfNetwork);
  else
    record.field("network", *content.network, kOfNetwork);
  record.field("box", content.box.empty() ? std::nullopt : std::optional(content.box),
               "To which bounds with a domain refer, by network; null: none.");
  record.list("layers", content.layers, "Spectral norms with their proofs.", describe_proved_layer);
  record.list("bounds", content.bounds, "Lipschitz bounds with their proofs.", describe_proved_bound);
  record.list("laws", content.laws, "Bounds for several moving neighbours, by their number.", describe_law);
  record.list("values", content.values, "Ranges, jumps and float32 errors over the box, layer by layer.",
              describe_values);
  record.field("content_sha256", content.sha256, "Over the content without this field.");
}

}  // namespace

BoundSummary summary(const files::Network& network, const CertifiedBound& bound) {
  BoundSummary result;
  result.function = bound.function.name();
  result.domain = bound.domain;
  result.block = bound.block;
  result.law = bound.function.is_set() ? "one_neighbour" : "none";
  result.norm = bound.scale.empty() ? "l2" : "weighted_l2";
  result.scale = bound.scale;
  result.unit = files::unit(network, bound.function, bound.block);
  result.upper = bound.upper.value();
  result.upper_method = name(bound.method);
  result.status = status(bound.is_interrupted());
  if (bound.lower.witness) result.lower = bound.lower.witness->slope.value();
  if (!bound.neighbours.empty()) result.neighbours = bound.neighbours;
  return result;
}

BoundSummary summary(const files::Network& network, const CertifiedLaw& law) {
  const std::string kind = law.neighbours.begin()->first;
  const std::string shown = law.neighbours.size() == 1 ? kind : "mixed";
  BoundSummary result;
  result.function = files::FunctionId::set(shown, law.rho).name();
  result.domain = law.domain;
  result.block = law.block;
  result.law = name(law.law);
  result.norm = "l2";
  result.unit = files::unit(network, files::FunctionId::set(kind, law.rho), law.block);
  result.upper = law.upper.value();
  result.upper_method = "law";
  result.status = status(law.interrupted);
  result.neighbours = law.neighbours;
  return result;
}

void describe(files::Record& record, const BoundSummary& summary) {
  describe_statement(record, summary, [&] {
    record.may("scale", summary.scale, "Units of the inputs in the weighted norm; empty: l2.");
  });
}

files::Json certificate(const files::Network& network, const Certification& certification) {
  Content content;
  content.statement = check::statement_for(network);
  content.network = network_json(network, certification);
  for (const auto& [part, sides] : certification.domain)
    content.box[part.name()] = {hex_floats(sides.lower), hex_floats(sides.upper)};
  content.layers = certification.layers;
  for (const CertifiedBound& bound : certification.bounds)
    content.bounds.push_back({summary(network, bound), bound});
  content.laws = certification.laws;
  content.values = certification.values;
  content.sha256 = files::content_sha256(files::to_json(files::record_of(content)));
  return files::to_json(files::record_of(content));
}

void describe_certificate_file(files::Record& record) { describe(record, Content{}); }

}  // namespace swarmcert::lipschitz
