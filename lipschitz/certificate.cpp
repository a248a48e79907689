#include "lipschitz/certify.h"
#include "lipschitz/checker/check.h"
#include "nn/files/content_hash.h"
#include "nn/files/functions.h"

namespace swarmcert::lipschitz {
namespace {

using files::hex_float;
using files::Json;

Json hex_floats(const std::vector<double>& values) {
  Json array = Json::array();
  for (const double value : values) array.push_back(hex_float(value));
  return array;
}

Json hex_floats(const std::vector<float>& values) {
  return hex_floats(std::vector<double>(values.begin(), values.end()));
}

Json factor_json(const check::Factor& factor) {
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

Json layer_json(const CertifiedLayer& layer) {
  const double lower = layer.norm.norm.lower.value();
  const double upper = layer.norm.norm.upper.value();
  return {{"network", layer.network},
          {"name", layer.name},
          {"spectral_norm", {lower, upper}},
          {"spectral_norm_hex", {hex_float(lower), hex_float(upper)}},
          {"proof",
           {{"lower_vector", hex_floats(layer.norm.lower_vector)},
            {"upper", upper_json(layer.norm.upper_proof)}}}};
}

Json bound_json(const files::Network& network, const CertifiedBound& bound) {
  Json json = {{"function", bound.function},
               {"domain", "global"},
               {"block", "all"},
               {"law", bound.function.rfind("set:", 0) == 0 ? "one_neighbour" : "none"},
               {"norm", "l2"},
               {"unit", files::unit(network, bound.function)},
               {"upper", bound.upper.value()},
               {"upper_hex", hex_float(bound.upper.value())},
               {"upper_method", name(bound.method)},
               {"lower", nullptr},
               {"lower_hex", nullptr},
               {"lower_witness", nullptr},
               {"proof", nullptr}};
  if (bound.proof) json["proof"] = upper_json(*bound.proof);
  if (bound.witness) {
    Json others = Json::array();
    for (std::size_t j = 0; j < bound.witness->others.size(); ++j) {
      others.push_back({{"network", bound.other_networks[j]}, {"x", hex_floats(bound.witness->others[j])}});
    }
    json["lower"] = bound.witness->slope.value();
    json["lower_hex"] = hex_float(bound.witness->slope.value());
    json["lower_witness"] = {{"x", hex_floats(bound.witness->x)},
                             {"y", hex_floats(bound.witness->y)},
                             {"others", std::move(others)}};
  }
  return json;
}

}  // namespace

Json certificate(const files::Network& network, const Certification& certification) {
  Json weights = Json::object();
  for (const auto& [name, part] : files::parts(network)) {
    weights[name] = {{"sha256", part->sha256}, {"precision", files::name(part->precision)}};
  }
  Json layers = Json::array();
  for (const CertifiedLayer& layer : certification.layers) layers.push_back(layer_json(layer));
  Json bounds = Json::array();
  for (const CertifiedBound& bound : certification.bounds) bounds.push_back(bound_json(network, bound));
  Json result = {{"schema", check::kCertificateSchema},
                 {"tool", "swarmcert " SWARMCERT_VERSION},
                 {"statement", check::kStatement},
                 {"network", {{"description_sha256", network.sha256}, {"weights", std::move(weights)}}},
                 {"layers", std::move(layers)},
                 {"bounds", std::move(bounds)}};
  result["content_sha256"] = files::content_sha256(result);
  return result;
}

}  // namespace swarmcert::lipschitz
