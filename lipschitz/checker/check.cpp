#include "lipschitz/checker/check.h"

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "lipschitz/checker/lipschitz_lmi.h"
#include "lipschitz/witness.h"
#include "nn/files/content_hash.h"
#include "nn/files/functions.h"

namespace swarmcert::check {
namespace {

using files::Json;
using files::Weights;

void require(bool condition, const std::string& reason) {
  if (!condition) throw std::runtime_error(reason);
}

void require_keys(const Json& object, const std::set<std::string>& keys, const std::string& where) {
  require(object.is_object(), where + " is not an object");
  for (const auto& [key, value] : object.items())
    require(keys.count(key) == 1, where + " has unknown field " + key);
  for (const std::string& key : keys) require(object.contains(key), where + " lacks field " + key);
}

/// A nonnegative number that stands once in decimal and once in hex: both must be the same double.
double number(const Json& decimal, const Json& hex, const std::string& where) {
  const double value = files::parse_hex_float(hex.get<std::string>());
  require(decimal.is_number() && decimal.get<double>() == value, where + ": decimal and hex notation differ");
  require(value >= 0, where + ": negative");
  return value;
}

std::vector<double> hex_floats(const Json& array) {
  std::vector<double> values;
  for (const Json& text : array) values.push_back(files::parse_hex_float(text.get<std::string>()));
  return values;
}

Dyadic squared_norm(const Matrix& m) {
  Dyadic sum;
  for (const Dyadic& x : m.entries) sum += x * x;
  return sum;
}

Factor parse_factor(const Json& json, const std::string& where) {
  require_keys(json, {"unit_exponent", "scale", "rows"}, where);
  Factor factor;
  factor.unit_exponent = json["unit_exponent"].get<long>();
  factor.scale = json["scale"].get<std::vector<long>>();
  const auto small = [](long e) { return -8192 <= e && e <= 8192; };  // bounds the length of every integer
  require(small(factor.unit_exponent) && std::all_of(factor.scale.begin(), factor.scale.end(), small),
          where + ": exponent out of range");
  for (const Json& row : json["rows"]) {
    std::istringstream text(row.get<std::string>());
    factor.rows.emplace_back();
    for (std::string word; text >> word;) {
      require(word.size() <= 40, where + ": integer too long");
      factor.rows.back().emplace_back(word, 10);
    }
  }
  return factor;
}

/// Shows that sqrt(rho) <= `upper` bounds the chain's Lipschitz constant.
void check_upper(const std::vector<Matrix>& chain, const Json& proof, double upper,
                 const std::string& where) {
  require_keys(proof, {"rho", "t", "factor"}, where + ".proof");
  const Dyadic rho = files::parse_hex_float(proof["rho"].get<std::string>());
  const std::vector<double> t = hex_floats(proof["t"]);
  std::size_t neurons = 0;
  for (std::size_t k = 0; k + 1 < chain.size(); ++k) neurons += static_cast<std::size_t>(chain[k].rows);
  require(rho.sign() > 0, where + ": rho is not positive");
  require(t.size() == neurons, where + ": needs one multiplier t per hidden neuron");
  require(std::all_of(t.begin(), t.end(), [](double x) { return x >= 0; }), where + ": a t is negative");
  require(Dyadic(upper) * upper >= rho, where + ": claims less than sqrt(rho)");
  require(shows_positive_semidefinite(lipschitz_lmi(chain, rho, {t.begin(), t.end()}),
                                      parse_factor(proof["factor"], where + ".factor")),
          where + ": the factor does not show that the matrix inequality holds");
}

std::vector<float> floats(const Json& array, const std::string& where) {
  const std::vector<double> values = hex_floats(array);
  const std::vector<float> result(values.begin(), values.end());
  require(std::equal(values.begin(), values.end(), result.begin()),
          where + ": a coordinate is not a float32");
  return result;
}

class Checker {
 public:
  Checker(const Json& certificate, const files::Network& network)
      : certificate_(certificate), network_(network), parts_(files::parts(network)) {}

  CheckResult run() {
    require_keys(certificate_,
                 {"schema", "tool", "statement", "network", "layers", "bounds", "content_sha256"},
                 "certificate");
    require(certificate_["schema"] == kCertificateSchema, "schema is not " + std::string(kCertificateSchema));
    require(certificate_["statement"] == kStatement, "statement is not the one that is checked");
    require(certificate_["content_sha256"] == files::content_sha256(certificate_),
            "content_sha256 does not match: the certificate was changed after it was written");
    check_weights(certificate_["network"]);
    check_layers();
    require(!certificate_["bounds"].empty(), "bounds is empty");
    for (const Json& bound : certificate_["bounds"]) check_bound(bound);
    return {true, "every statement verified in exact arithmetic", spectral_norms_, upper_bounds_,
            lower_bounds_};
  }

 private:
  void check_weights(const Json& named) {
    require_keys(named, {"description_sha256", "weights"}, "network");
    require(named["description_sha256"] == network_.sha256,
            "network.description_sha256 is of another network.toml");
    require(named["weights"].size() == parts_.size(), "network.weights lists another number of networks");
    for (const auto& [name, weights] : parts_) {
      const Json& entry = named["weights"].at(name);
      require_keys(entry, {"sha256", "precision"}, "network.weights." + name);
      require(entry["sha256"] == weights->sha256 && entry["precision"] == files::name(weights->precision),
              "network.weights." + name + " is of another file than " + weights->path);
    }
  }

  void check_layers() {
    std::size_t next = 0;
    for (const auto& [name, weights] : parts_) {
      for (const files::Layer& layer : weights->layers)
        check_layer(certificate_["layers"].at(next++), name, layer);
    }
    require(certificate_["layers"].size() == next, "layers lists more layers than the networks have");
  }

  void check_layer(const Json& entry, const std::string& network, const files::Layer& layer) {
    const std::string where = "layer " + network + " " + layer.name;
    require_keys(entry, {"network", "name", "spectral_norm", "spectral_norm_hex", "proof"}, where);
    require(entry["network"] == network && entry["name"] == layer.name,
            where + " is not where it is expected");
    const double lower = number(entry["spectral_norm"].at(0), entry["spectral_norm_hex"].at(0), where);
    const double upper = number(entry["spectral_norm"].at(1), entry["spectral_norm_hex"].at(1), where);
    require_keys(entry["proof"], {"lower_vector", "upper"}, where + ".proof");
    const Matrix w(layer.outputs, layer.inputs, layer.weights);
    const std::vector<double> vector = hex_floats(entry["proof"]["lower_vector"]);
    const Matrix v(static_cast<int>(vector.size()), 1, vector);
    require(v.rows == w.cols && squared_norm(v).sign() > 0, where + ": unusable lower_vector");
    require(squared_norm(product(w, v)) >= Dyadic(lower) * lower * squared_norm(v),
            where + ": claims more than |W v| / |v|");
    check_upper({w}, entry["proof"]["upper"], upper, where);
    norms_[network + " " + layer.name] = upper;
    ++spectral_norms_;
  }

  void check_bound(const Json& bound) {
    require_keys(bound,
                 {"function", "domain", "block", "law", "norm", "unit", "upper", "upper_hex", "upper_method",
                  "lower", "lower_hex", "lower_witness", "proof"},
                 "bound");
    const std::string function = bound["function"].get<std::string>();
    const std::string where = "bound " + function;
    const std::vector<Matrix> chain = stages(network_, function);
    const std::map<std::string, std::string> meaning = {
        {"domain", "global"},
        {"block", "all"},
        {"norm", "l2"},
        {"unit", files::unit(network_, function)},
        {"law", files::networks_of(function).size() == 2 ? "one_neighbour" : "none"}};
    for (const auto& [key, text] : meaning)
      require(bound[key] == text, where + ": " + key + " is not " + text);
    const double upper = number(bound["upper"], bound["upper_hex"], where + " upper");
    if (bound["upper_method"] == "sdp") {
      check_upper(chain, bound["proof"], upper, where);
    } else {
      require(bound["upper_method"] == "product" && bound["proof"].is_null(),
              where + ": unknown upper_method");
      Dyadic total = 1.0;
      for (const std::string& name : files::networks_of(function)) {
        for (const files::Layer& layer : parts_.at(name)->layers)
          total = total * norms_.at(name + " " + layer.name);
      }
      require(Dyadic(upper) >= total, where + ": claims less than the product of the norms");
    }
    ++upper_bounds_;
    if (bound["lower"].is_null()) {
      require(bound["lower_hex"].is_null() && bound["lower_witness"].is_null(),
              where + ": lower has no value");
      return;
    }
    const double lower = number(bound["lower"], bound["lower_hex"], where + " lower");
    check_lower(bound["lower_witness"], files::networks_of(function), lower, where + ": lower_witness");
    ++lower_bounds_;
  }

  lipschitz::Term term(const std::string& name) const {
    const bool clamped = network_.clamp && files::is_clamped(name);
    return {parts_.at(name), clamped ? &*network_.clamp : nullptr};
  }

  /// |f(x) - f(y)| >= lower |x - y|. In a set function (two names) one neighbour moves from x to y, the others stay.
  void check_lower(const Json& witness, const std::vector<std::string>& names, double lower,
                   const std::string& where) const {
    require_keys(witness, {"x", "y", "others"}, where);
    lipschitz::SlopeFunction f{term(names[0]), {}, names.size() == 2 ? parts_.at(names[1]) : nullptr};
    lipschitz::SlopePoints points{floats(witness["x"], where), floats(witness["y"], where), {}};
    std::size_t grounds = names[0] == "phi:ground" ? 1 : 0;
    for (const Json& other : witness["others"]) {
      require_keys(other, {"network", "x"}, where + ".others");
      const std::string name = other["network"].get<std::string>();
      require(name.rfind("phi:", 0) == 0, where + ".others: " + name + " is no neighbour");
      grounds += name == "phi:ground" ? 1 : 0;
      f.others.push_back(term(name));
      points.others.push_back(floats(other["x"], where));
    }
    require(names.size() == 1 || grounds == parts_.count("phi:ground"),
            where + ": the ground network enters the sum exactly once");
    require(mpq_class(lower) * mpq_class(lower) <= lipschitz::slope_squared(f, points),
            where + ": claims more than the slope between x and y");
  }

  const Json& certificate_;
  const files::Network& network_;
  std::map<std::string, const Weights*> parts_;
  std::map<std::string, Dyadic> norms_;  ///< verified upper ends, by "<network> <layer>"
  int spectral_norms_ = 0, upper_bounds_ = 0, lower_bounds_ = 0;
};

}  // namespace

std::vector<Matrix> stages(const files::Network& network, const std::string& function) {
  const std::map<std::string, const Weights*> parts = files::parts(network);
  std::vector<Matrix> chain;
  for (const std::string& name : files::networks_of(function)) {
    bool joins = !chain.empty();  // the first layer of rho acts on the last of phi
    for (const files::Layer& layer : parts.at(name)->layers) {
      const Matrix w(layer.outputs, layer.inputs, layer.weights);
      if (joins) {
        chain.back() = product(w, chain.back());
      } else {
        chain.push_back(w);
      }
      joins = false;
    }
  }
  return chain;
}

CheckResult check(const Json& certificate, const files::Network& network) {
  try {
    return Checker(certificate, network).run();
  } catch (const std::exception& fault) {
    return {false, fault.what(), 0, 0, 0};
  }
}

}  // namespace swarmcert::check
