#include "lipschitz/certify.h"
#include "lipschitz/checker/canonical_network.h"
#include "lipschitz/checker/statement.h"
#include "nn/base/content_hash.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using files::hex_float;
using files::Json;

Json hex_floats(const std::vector<double>& values) {
  Json array = Json::array();
  for (const double value : values) array.push_back(hex_float(value));
  return array;
}

/// Joins numbers into one string, because a JSON document should not have a node for each number of a tree.
std::string joined(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : " ") + hex_float(value);
  return text;
}

Json hex_floats(const std::vector<float>& values) {
  return hex_floats(std::vector<double>(values.begin(), values.end()));
}

/// Returns null if the checker is to compute the factor itself.
Json factor_json(const std::optional<check::Factor>& found) {
  if (!found) return nullptr;
  const check::Factor& factor = *found;
  Json rows = Json::array();
  for (const std::vector<mpz_class>& entries : factor.rows) {
    std::string row;
    for (const mpz_class& entry : entries) row += (row.empty() ? "" : " ") + entry.get_str();
    rows.push_back(std::move(row));
  }
  return {{"unit_exponent", factor.unit_exponent}, {"scale", factor.scale}, {"rows", std::move(rows)}};
}

Json upper_json(const UpperProof& proof) {
  return {{"rho", hex_float(proof.rho)}, {"t", hex_floats(proof.t)}, {"factor", factor_json(proof.factor)}};
}

Json tree_json(const LocalProof& proof) {
  Json multipliers = Json::array();
  for (const std::vector<double>& t : proof.tree.multipliers) multipliers.push_back(joined(t));
  Json json = {
      {"rho", hex_float(proof.rho)}, {"tree", proof.tree.tree}, {"multipliers", std::move(multipliers)}};
  if (proof.tree.conflicts.empty()) return json;
  json["conflicts"] = Json::array();
  for (const std::vector<check::Conflict>& conflicts : proof.tree.conflicts) {
    std::string text;
    for (const check::Conflict& c : conflicts)
      text += (text.empty() ? "" : " ") + std::to_string(c.first) + (c.first_on ? "+ " : "- ") +
              std::to_string(c.second) + (c.second_on ? "+ " : "- ") + hex_float(c.lambda) + " " +
              hex_float(c.multiplier);
    json["conflicts"].push_back(std::move(text));
  }
  return json;
}

Json local_json(const LocalProof& proof) {
  Json json = tree_json(proof);
  if (!proof.radius.empty()) json["radius"] = hex_floats(proof.radius);
  if (proof.others) {
    json["others"] = Json::object();
    for (const auto& [part, range] : *proof.others)
      json["others"][part.name()] = {
          {"tree", range.tree}, {"least", hex_floats(range.least)}, {"most", hex_floats(range.most)}};
    json["forms"] = Json::array();
    for (const check::Form& form : proof.tree.forms)
      json["forms"].push_back({{"q", joined(form.q)}, {"t", joined(form.t)}});
    return json;
  }
  Json form;
  if (proof.form) {
    const Eigen::MatrixXd& q = proof.form->q;
    Json rows = Json::array();
    for (Eigen::Index i = 0; i < q.rows(); ++i) {
      std::vector<double> row;
      for (Eigen::Index j = 0; j <= i; ++j) row.push_back(q(i, j));
      rows.push_back(joined(row));
    }
    form = {{"q", std::move(rows)},
            {"t", hex_floats(proof.form->t)},
            {"factor", factor_json(proof.form->factor)}};
  }
  json["form"] = std::move(form);
  return json;
}

Json layer_json(const CertifiedLayer& layer) {
  const double lower = layer.norm.norm.lower.value();
  const double upper = layer.norm.norm.upper.value();
  return {{"network", layer.network.name()},
          {"name", layer.name},
          {"spectral_norm", {lower, upper}},
          {"spectral_norm_hex", {hex_float(lower), hex_float(upper)}},
          {"proof",
           {{"lower_vector", hex_floats(layer.norm.lower_vector)},
            {"upper", upper_json(layer.norm.upper_proof)}}}};
}

Json bound_json(const files::Network& network, const CertifiedBound& bound) {
  Json json = files::to_json(files::record_of(summary(network, bound)));
  json.update({{"scale", hex_floats(bound.scale)},
               {"upper_hex", hex_float(bound.upper.value())},
               {"lower_hex", nullptr},
               {"lower_witness", nullptr},
               {"proof", nullptr}});
  if (bound.proof) json["proof"] = upper_json(*bound.proof);
  if (bound.local) json["proof"] = local_json(*bound.local);
  if (!bound.lower.witness) return json;
  const SlopeWitness& witness = *bound.lower.witness;
  Json others = Json::array();
  for (std::size_t j = 0; j < witness.others.size(); ++j)
    others.push_back(
        {{"network", bound.lower.other_networks[j].name()}, {"x", hex_floats(witness.others[j])}});
  json["lower_hex"] = hex_float(witness.slope.value());
  json["lower_witness"] = {
      {"x", hex_floats(witness.x)}, {"y", hex_floats(witness.y)}, {"others", std::move(others)}};
  return json;
}

Json samples_entry(const Certification& certification, const files::FunctionId& part) {
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

Json law_json(const CertifiedLaw& law) {
  return {{"rho", law.rho},
          {"neighbours", law.neighbours},
          {"domain", law.domain},
          {"block", law.block},
          {"law", name(law.law)},
          {"status", status(law.interrupted)},
          {"upper", law.upper.value()},
          {"upper_hex", hex_float(law.upper.value())}};
}

Json vector_json(const VectorBounds& bounds) {
  return {{"lower", joined(bounds.lower)},
          {"upper", joined(bounds.upper)},
          {"error", bounds.error.empty() ? Json() : Json(joined(bounds.error))}};
}

/// Stores a number in decimal and in hex, or null for both.
void set_number(Json& json, const std::string& name, const std::optional<double>& number) {
  json[name] = number ? Json(*number) : Json();
  json[name + "_hex"] = number ? Json(hex_float(*number)) : Json();
}

Json values_json(const CertifiedValues& values) {
  Json networks = Json::object();
  for (const auto& [part, layers] : values.layers) {
    networks[part.name()] = Json::array();
    for (const VectorBounds& layer : layers) networks[part.name()].push_back(vector_json(layer));
  }
  Json input_error;
  for (const auto& [part, errors] : values.input_error) input_error[part.name()] = hex_floats(errors);
  Json json = {{"function", values.function.name()},
               {"neighbours", values.neighbours},
               {"domain", values.in_clamp ? "clamp" : "box"},
               {"input_error", std::move(input_error)},
               {"networks", std::move(networks)},
               {"sum", values.sum ? vector_json(*values.sum) : Json()},
               {"lower", hex_floats(values.lower)},
               {"upper", hex_floats(values.upper)}};
  set_number(json, "jump", values.jump);
  set_number(json, "float32_error", values.float32_error);
  return json;
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
  record.field("function", summary.function, "network, phi:KIND, rho:KIND or set:PHI:RHO.");
  record.field("domain", summary.domain, "global: all inputs, or box.");
  record.field("block", summary.block, "Inputs that change: all, position or velocity.");
  record.field("law", summary.law, "What moves: none, one_neighbour, all_stacked, all_max or own_state.");
  record.field("norm", summary.norm, "l2 or weighted_l2.");
  record.may("scale", summary.scale, "Units of the inputs in the weighted norm; empty: l2.");
  record.field("unit", summary.unit, "Output per input.");
  record.field("upper", summary.upper, "Lipschitz constant.", "", "proved upper bound");
  record.field("upper_method", summary.upper_method,
               "product, sdp, eclipse_fast, local_product, local_sdp, branch or law.");
  record.field("status", summary.status, "finished or interrupted; bounds hold in either case.");
  record.field("lower", summary.lower, "Slope between two points that were found; null: none.", "",
               "proved lower bound");
  record.may("neighbours", summary.neighbours, "Most neighbours of each kind.");
}

Json certificate(const files::Network& network, const Certification& certification) {
  Json canonical = check::canonical_json(network);
  for (const auto& [part, stored] : files::parts(network))
    canonical["weights"][part.name()]["samples"] = samples_entry(certification, part);
  canonical["as"] = certification.as_float32 ? Json("float32") : Json();
  Json layers = Json::array();
  for (const CertifiedLayer& layer : certification.layers) layers.push_back(layer_json(layer));
  Json bounds = Json::array();
  for (const CertifiedBound& bound : certification.bounds) bounds.push_back(bound_json(network, bound));
  Json laws = Json::array();
  for (const CertifiedLaw& law : certification.laws) laws.push_back(law_json(law));
  Json values = Json::array();
  for (const CertifiedValues& entry : certification.values) values.push_back(values_json(entry));
  Json box;
  for (const auto& [part, sides] : certification.domain)
    box[part.name()] = {{"lower", hex_floats(sides.lower)}, {"upper", hex_floats(sides.upper)}};
  Json result = {{"schema", check::kCertificateSchema},
                 {"tool", "swarmcert " SWARMCERT_VERSION},
                 {"statement", check::statement_for(network)},
                 {"network", std::move(canonical)},
                 {"box", std::move(box)},
                 {"layers", std::move(layers)},
                 {"bounds", std::move(bounds)},
                 {"laws", std::move(laws)},
                 {"values", std::move(values)}};
  result["content_sha256"] = files::content_sha256(result);
  return result;
}

}  // namespace swarmcert::lipschitz
