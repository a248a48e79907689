#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "lipschitz/checker/canonical_network.h"
#include "lipschitz/checker/certificate_checker.h"
#include "nn/base/content_hash.h"
#include "nn/base/input_error.h"
#include "nn/weights/chain.h"
#include "nn/weights/compositions.h"
#include "nn/weights/function_id.h"

namespace swarmcert::check {
namespace {

Dyadic squared_norm(const Matrix& m) {
  Dyadic sum;
  for (const Dyadic& x : m.entries) sum += x * x;
  return sum;
}

/// Returns whether the bound uses the slopes of the activations on the box.
bool is_from_local_slopes(const files::Json& bound) {
  return bound["upper_method"] == "local_sdp" || bound["upper_method"] == "local_product";
}

/// The status tells whether a search was completed. No statement depends on it.
void check_status(const files::Json& entry, const std::string& where) {
  require(entry["status"] == "finished" || entry["status"] == "interrupted", where + ": unknown status");
}

/// Verifies that sqrt(rho) <= `upper` bounds the chain's Lipschitz constant.
void check_upper(const BentChain& chain, const files::Json& proof, double upper, const std::string& where) {
  files::require_keys(proof, {"rho", "t", "factor"}, where + ".proof");
  const Dyadic rho = files::parse_hex_float(proof["rho"].get<std::string>());
  const std::vector<double> t = files::parse_hex_floats(proof["t"]);
  require(t.size() == chain.multipliers(), where + ": needs one multiplier t per hidden neuron");
  require(rho.sign() > 0 && std::all_of(t.begin(), t.end(), [](double x) { return x >= 0; }),
          where + ": rho is not positive, or a t negative");
  require(Dyadic(upper) * upper >= rho, where + ": claims less than sqrt(rho)");
  require(shows_positive_semidefinite(lipschitz_lmi(chain, rho, {t.begin(), t.end()}),
                                      parse_factor(proof["factor"], where + ".factor")),
          where + ": the factor does not show that the matrix inequality holds");
}

}  // namespace

CheckResult CertificateChecker::run() {
  files::require_keys(certificate_,
                      {"schema", "tool", "statement", "network", "box", "layers", "bounds", "laws", "values",
                       "content_sha256"},
                      "certificate");
  require(certificate_["schema"] == kCertificateSchema, "schema is not " + std::string(kCertificateSchema));
  require(certificate_["statement"] == statement_for(network_), "statement is not the one that is checked");
  require(certificate_["content_sha256"] == files::content_sha256(certificate_),
          "content_sha256 does not match: the certificate was changed after it was written");
  require(certificate_["tool"].is_string(), "tool is not text");
  check_weights(certificate_["network"]);
  check_boxes(certificate_["box"]);
  for (const auto& [part, weights] : parts_)
    for (const files::Layer& layer : weights->layers)
      check_layer(certificate_["layers"].at(spectral_norms_), part, layer);
  require(certificate_["layers"].size() == static_cast<std::size_t>(spectral_norms_),
          "layers lists more than the networks have");
  require(certificate_["bounds"].is_array() && !certificate_["bounds"].empty(), "bounds is empty");
  require(certificate_["laws"].is_array(), "laws is not an array");
  for (const Json& bound : certificate_["bounds"]) check_bound(bound);
  for (const Json& law : certificate_["laws"]) check_law(law);
  require(certificate_["values"].is_array(), "values is not an array");
  for (const Json& entry : certificate_["values"]) check_values(entry);
  std::string reason = "every statement verified in exact arithmetic";
  if (on_boxes_ > 0) reason += ", those by parts of boxes in double with every rounding accounted for";
  return {true, reason, spectral_norms_, upper_bounds_, lower_bounds_, on_boxes_, values_};
}

void CertificateChecker::check_weights(const Json& named) {
  files::require_keys(named, {"description_sha256", "options", "output", "input", "silent", "weights", "as"},
                      "network");
  require(named["as"].is_null() || named["as"] == "float32", "network.as is unknown");
  for (const auto& [part, weights] : parts_) {
    const Json& entry = named["weights"].at(part.name());
    const std::string where = "network.weights." + part.name();
    files::require_keys(
        entry, {"file", "sha256", "data_files", "precision", "assumed", "chain", "layers", "samples"}, where);
    require(named["as"].is_null() || weights->precision == files::Precision::kFloat32,
            where + ": is not of float32, as network.as states");
    check_chain(entry["chain"], part);
    check_samples(entry["samples"], where + ".samples");
  }
}

void CertificateChecker::check_boxes(const Json& boxes) const {
  if (boxes.is_null()) return;
  require(boxes.is_object() && !boxes.empty(), "box is neither null nor an object with boxes");
  for (const auto& [part, box] : boxes.items()) {
    const std::optional<files::FunctionId> named = files::FunctionId::parse(part);
    const auto found = named ? parts_.find(*named) : parts_.end();
    require(found != parts_.end() && !named->is_rho(),
            "box." + part + " does not belong to a network with a box");
    files::require_keys(box, {"lower", "upper"}, "box." + part);
    const auto inputs = static_cast<std::size_t>(found->second->inputs());
    const std::vector<double> lower = files::parse_hex_floats(box["lower"]);
    const std::vector<double> upper = files::parse_hex_floats(box["upper"]);
    require(lower.size() == inputs && upper.size() == inputs, "box." + part + " has another size");
    for (std::size_t k = 0; k < inputs; ++k) require(lower[k] <= upper[k], "box." + part + " is empty");
  }
}

void CertificateChecker::check_chain(const Json& stated, const files::FunctionId& part) const {
  const std::vector<files::ChainStep> chain = files::chain(network_, part);
  const std::string where = "network.weights." + part.name() + ".chain";
  const auto fits = [&](std::size_t k) {
    const Json& step = stated[k];
    files::require_keys(step, {"op", "layer", "inputs", "outputs"}, where);
    const Json layer = chain[k].op == "linear" ? Json(chain[k].layer) : Json();
    return step["op"] == chain[k].op && step["layer"] == layer && step["inputs"].is_number_integer() &&
           step["inputs"] == chain[k].inputs && step["outputs"].is_number_integer() &&
           step["outputs"] == chain[k].outputs;
  };
  bool is_equal = stated.is_array() && stated.size() == chain.size();
  for (std::size_t k = 0; is_equal && k < chain.size(); ++k) is_equal = fits(k);
  require(is_equal, where + " is not the one of this network: " + files::chain_words(chain));
}

void CertificateChecker::check_samples(const Json& samples, const std::string& where) {
  if (samples.is_null()) return;
  files::require_keys(
      samples,
      {"sha256", "count", "tolerance", "tolerance_hex", "largest_deviation", "largest_deviation_hex"}, where);
  const auto is_hash = [](const Json& json) {
    if (!json.is_string()) return false;
    const std::string text = json.get<std::string>();
    return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
  };
  require(is_hash(samples["sha256"]), where + ".sha256 is not a hash");
  require(samples["count"].is_number_integer() && samples["count"] >= 1, where + ".count is not positive");
  const double tolerance = number(samples["tolerance"], samples["tolerance_hex"], where + ".tolerance");
  require(number(samples["largest_deviation"], samples["largest_deviation_hex"],
                 where + ".largest_deviation") <= tolerance,
          where + ": the largest deviation is above the tolerance");
}

void CertificateChecker::check_layer(const Json& entry, const files::FunctionId& part,
                                     const files::Layer& layer) {
  const std::string where = "layer " + part.name() + " " + layer.name;
  files::require_keys(entry, {"network", "name", "spectral_norm", "spectral_norm_hex", "proof"}, where);
  require(entry["network"] == part.name() && entry["name"] == layer.name,
          where + " is not where it is expected");
  const double lower = number(entry["spectral_norm"].at(0), entry["spectral_norm_hex"].at(0), where);
  const double upper = number(entry["spectral_norm"].at(1), entry["spectral_norm_hex"].at(1), where);
  files::require_keys(entry["proof"], {"lower_vector", "upper"}, where + ".proof");
  const Matrix w(layer.outputs, layer.inputs, layer.weights);
  const std::vector<double> vector = files::parse_hex_floats(entry["proof"]["lower_vector"]);
  const Matrix v(static_cast<int>(vector.size()), 1, vector);
  require(v.rows == w.cols && squared_norm(v).sign() > 0, where + ": unusable lower_vector");
  require(squared_norm(product(w, v)) >= Dyadic(lower) * lower * squared_norm(v),
          where + ": claims more than |W v| / |v|");
  check_upper({{w}, {}}, entry["proof"]["upper"], upper, where);
  norms_[part].emplace_back(upper);
  ++spectral_norms_;
}

void CertificateChecker::check_bound(const Json& bound) {
  std::set<std::string> keys = {"function", "domain",    "block",         "law",       "norm",
                                "scale",    "unit",      "upper",         "upper_hex", "upper_method",
                                "lower",    "lower_hex", "lower_witness", "proof",     "status"};
  if (bound.contains("neighbours")) keys.insert("neighbours");
  files::require_keys(bound, keys, "bound");
  const files::FunctionId function = bound["function"].get<std::string>();
  const std::string block = bound["block"].get<std::string>();
  const std::string where = "bound " + function.name() + " " + block;
  const std::vector<files::FunctionId> names = function.parts();
  const std::vector<double> scale = files::parse_hex_floats(bound["scale"]);
  require(std::all_of(scale.begin(), scale.end(), [](double x) { return x > 0; }),
          where + ": scale is not positive");
  const std::map<std::string, std::string> meaning = {
      {"domain", bound["domain"] == "box" && certificate_["box"].is_object() ? "box" : "global"},
      {"norm", scale.empty() ? "l2" : "weighted_l2"},
      {"unit", files::unit(network_, function, block)},
      {"law", names.size() == 2 ? "one_neighbour" : "none"}};
  for (const auto& [key, text] : meaning) require(bound[key] == text, where + ": " + key + " is not " + text);
  require(scale.empty() || scale.size() == static_cast<std::size_t>(parts_.at(names.front())->inputs()),
          where + ": scale has another size");
  const Neighbours neighbours = neighbours_of(bound, where);
  const double upper = number(bound["upper"], bound["upper_hex"], where + " upper");
  check_status(bound, where);
  check_activations(bound, names, where);
  files::block_coordinates(network_, function, block);  // throws if the function has no such block
  if (bound["upper_method"] == "sdp" || bound["upper_method"] == "eclipse_fast") {
    check_upper(bent_chain(network_, function, block, scale), bound["proof"], upper, where);
  } else if (bound["upper_method"] == "local_sdp") {
    check_upper(chain_on_box(network_, function, block, scale, local_inputs(bound, names.front(), where)),
                bound["proof"], upper, where);
  } else if (bound["upper_method"] == "branch") {
    check_local(bound, upper, scale, where);
  } else {
    check_product(bound, names, upper, scale, where);
  }
  if (scale.empty()) {
    proved_[key(function, block, neighbours)] = upper;
    if ((bound["upper_method"] == "branch" || is_from_local_slopes(bound)) && bound["domain"] == "box")
      local_.insert(key(function, block, neighbours));
  }
  ++upper_bounds_;
  if (bound["lower_witness"].is_null())
    return require(bound["lower"].is_null() && bound["lower_hex"].is_null(),
                   where + ": lower has no witness");
  const double lower = number(bound["lower"], bound["lower_hex"], where + " lower");
  check_lower(bound, lower, scale, where + ": lower_witness");
  ++lower_bounds_;
}

void CertificateChecker::check_product(const Json& bound, const std::vector<files::FunctionId>& names,
                                       double upper, const std::vector<double>& scale,
                                       const std::string& where) const {
  const bool is_local = bound["upper_method"] == "local_product";
  require((is_local || bound["upper_method"] == "product") && bound["proof"].is_null(),
          where + ": unknown upper_method");
  Dyadic total = scale.empty() ? 1.0 : *std::max_element(scale.begin(), scale.end());
  for (const files::FunctionId& part : names) {
    require(norms_.count(part) == 1, where + ": there is no network " + part.name());
    for (const Dyadic& norm : norms_.at(part)) total = total * norm;
    if (is_local && part == names.front()) {
      total = total * steepest_on_box(*parts_.at(part), local_inputs(bound, part, where));
      continue;
    }
    for (const double steepest : parts_.at(part)->steepest_slopes()) total = total * steepest;
  }
  require(Dyadic(upper) >= total, where + ": claims less than the product of the norms");
}

void CertificateChecker::check_activations(const Json& bound, const std::vector<files::FunctionId>& names,
                                           const std::string& where) const {
  for (const files::FunctionId& part : names) {
    require(parts_.count(part) == 1, where + ": there is no network " + part.name());
    for (const files::Activation activation : parts_.at(part)->activations()) {
      if (activation == files::Activation::kRelu) continue;
      const files::ActivationFunction& function = files::function_of(activation);
      const std::string with = " of a network with " + function.words;
      const Json& method = bound["upper_method"];
      require(!function.sorts() || method == "product" || method == "local_product" || method == "sdp",
              where + ": a bound from slopes of single numbers" + with);
    }
  }
}

Intervals CertificateChecker::local_inputs(const Json& bound, const files::FunctionId& part,
                                           const std::string& where) const {
  require(bound["domain"] == "box" && !part.is_rho(), where + ": slopes on a box of a bound without one");
  Row lower, upper;
  read_box(part, lower, upper, where);
  return {{lower.begin(), lower.end()}, {upper.begin(), upper.end()}};
}

CertificateChecker::Neighbours CertificateChecker::neighbours_of(const Json& bound,
                                                                 const std::string& where) const {
  if (!bound.contains("neighbours")) return {};
  const Neighbours neighbours = bound["neighbours"].get<Neighbours>();
  const files::FunctionId function = bound["function"].get<std::string>();
  require(function.is_set() && bound["domain"] == "box",
          where + ": neighbours may be given only for a set function on a box");
  for (const auto& [kind, count] : neighbours)
    require(kind != files::kGroundKind && parts_.count(files::FunctionId::phi(kind)) == 1 && 1 <= count &&
                count <= kMostNeighbours,
            where + ": impossible neighbours");
  require(!neighbours.empty() &&
              (function.input_part().is_ground_phi() || neighbours.count(function.phi_kind()) == 1),
          where + ": the neighbour that moves is not among those listed");
  return neighbours;
}

std::string CertificateChecker::key(const files::FunctionId& function, const std::string& block,
                                    const Neighbours& neighbours) {
  return function.name() + " " + block + (neighbours.empty() ? "" : " " + Json(neighbours).dump());
}

void CertificateChecker::check_law(const Json& law) {
  files::require_keys(law, {"rho", "neighbours", "domain", "block", "law", "status", "upper", "upper_hex"},
                      "law");
  const std::string rho = law["rho"].get<std::string>(), block = law["block"].get<std::string>();
  const std::string where = "law of " + rho + " " + block;
  check_status(law, where);
  const double upper = number(law["upper"], law["upper_hex"], where + " upper");
  const Neighbours neighbours = law["neighbours"].get<Neighbours>();
  Neighbours terms = neighbours;
  require(terms.count(files::kGroundKind) == 0, where + ": the ground is not a neighbour");
  if (parts_.count(files::FunctionId::ground_phi()) == 1) terms[files::kGroundKind] = 1;
  require(law["domain"] == "box" || law["domain"] == "global", where + ": unknown domain");
  Dyadic sum, sum_of_squares;
  for (const auto& [kind, count] : terms) {
    require(1 <= count && count <= kMostNeighbours, where + ": impossible number of neighbours");
    const Dyadic n = static_cast<double>(count);
    const files::FunctionId function = files::FunctionId::set(kind, rho);
    const std::string any_number = key(function, block, {});
    require(proved_.count(any_number) == 1,
            where + ": rests on a bound of " + function.name() + " that is missing");
    Dyadic k = proved_.at(any_number);
    if (law["domain"] == "box") {
      const auto fewer = proved_.find(key(function, block, neighbours));
      if (fewer != proved_.end() && k >= fewer->second) k = fewer->second;
    } else {
      require(local_.count(any_number) == 0, where + ": rests on a bound that holds on a box only");
    }
    sum += n * k;
    sum_of_squares += n * k * k;
  }
  require(law["block"] == "all" || law["block"] == "position" || law["block"] == "velocity",
          where + ": no law for this block");
  const bool stacked = law["law"] == "all_stacked";
  require(stacked || law["law"] == "all_max" || law["law"] == "own_state", where + ": unknown law");
  require(stacked ? Dyadic(upper) * upper >= sum_of_squares : Dyadic(upper) >= sum,
          where + ": claims less than the law gives");
  ++upper_bounds_;
}

std::string statement_for(const files::Network& network) {
  const auto parts = files::parts(network);
  const bool sorts = std::any_of(parts.begin(), parts.end(), [](const auto& part) {
    const std::vector<files::Activation> all = part.second->activations();
    return std::any_of(all.begin(), all.end(), [](auto one) { return files::function_of(one).sorts(); });
  });
  const bool keeps = std::any_of(parts.begin(), parts.end(), [](const auto& part) {
    const std::vector<files::Layer>& layers = part.second->layers;
    return std::any_of(layers.begin(), layers.end(),
                       [](const files::Layer& layer) { return layer.kept > 0; });
  });
  std::string text = kStatement;
  if (sorts) text += kSortingStatement;
  if (keeps) text += kKeepingStatement;
  const std::vector<std::string> silent = files::silent_compositions(network);
  for (std::size_t k = 0; k < silent.size(); ++k) text += (k == 0 ? kSilentStatement : ", ") + silent[k];
  return text + (silent.empty() ? "" : ".");
}

files::NetworkArguments with_stated_options(const files::Json& certificate,
                                            files::NetworkArguments arguments) {
  const auto network = certificate.find("network");
  if (network == certificate.end() || !network->contains("options"))
    return arguments;  // check() reports the error
  const files::Json& named = *network;
  files::ReadingOptions stated;
  try {
    stated = files::options_of(named["options"]);
  } catch (const std::exception&) {
    return arguments;
  }
  const bool chooses = !arguments.order.empty() || !arguments.select.empty() ||
                       !arguments.phi_order.empty() || !arguments.rho_order.empty();
  if (!chooses) {
    const bool is_pair = !arguments.phi.empty();
    if (!is_pair) arguments.order = stated.order;
    if (!is_pair) arguments.select = stated.select;
    if (is_pair) arguments.phi_order = stated.phi_order;
    if (is_pair) arguments.rho_order = stated.rho_order;
  }
  if (arguments.key.empty() && arguments.file.find('#') == std::string::npos) arguments.key = stated.key;
  if (arguments.activation.empty()) arguments.activation = stated.activation;
  if (arguments.normalization.empty() && !stated.normalization.empty()) {
    const std::filesystem::path folder = std::filesystem::path(arguments.file).parent_path();
    const bool is_none = stated.normalization == "none";
    arguments.normalization = is_none ? stated.normalization : (folder / stated.normalization).string();
  }
  return arguments;
}

files::Json parse_certificate(const std::string& text, const std::string& path) {
  const files::Json any = files::parse_json(text, path);
  if (any.is_object() && any.value("schema", files::Json()) == kOldCertificateSchema)
    throw files::InputError(
        {path, "", "schema", files::in_quotes(kOldCertificateSchema),
         "is older than this program: it does not carry the network",
         "renew it: swarmcert certify NET -o CERTIFICATE --force, with the options of then"});
  return any.is_object() && any.value("schema", files::Json()) == kCertificateSchema
             ? any
             : files::parse_json(text, path, kCertificateSchema);
}

namespace {

/// Runs `decide`; what is wrong with the certificate's form becomes a reason.
template <class Decide>
CheckResult decided(const Decide& decide) {
  try {
    return decide();
  } catch (const files::Json::exception& fault) {
    // "[json.exception.type_error.302] type must be string, but is null"
    const std::string text = fault.what();
    return {false, "a field is missing or of another type: " + text.substr(text.find("] ") + 2), 0, 0, 0, 0,
            0};
  } catch (const std::exception& fault) {
    return {false, fault.what(), 0, 0, 0, 0, 0};
  }
}

}  // namespace

CheckResult check(const files::Json& certificate) {
  return decided([&certificate] { return CertificateChecker(certificate).run(); });
}

CheckResult check(const files::Json& certificate, const files::Network& network) {
  return decided([&]() -> CheckResult {
    require(certificate.contains("network"), "certificate lacks field network");
    const files::Json& named = certificate["network"];
    require(named.is_object(), "network is not an object");
    const std::string difference = first_difference(
        canonical_network(named), named.at("as") == "float32" ? files::as_float32(network) : network);
    if (!difference.empty()) return {false, difference, 0, 0, 0, 0, 0};
    return CertificateChecker(certificate).run();
  });
}

}  // namespace swarmcert::check
