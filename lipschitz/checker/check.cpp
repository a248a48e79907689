#include "lipschitz/checker/check.h"

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "lipschitz/checker/lipschitz_lmi.h"
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

/// A number that stands once in decimal and once in hex: both must be the same double.
double number(const Json& decimal, const Json& hex, const std::string& where) {
  const double value = files::parse_hex_float(hex.get<std::string>());
  require(decimal.is_number() && decimal.get<double>() == value, where + ": decimal and hex notation differ");
  return value;
}

std::vector<Dyadic> hex_floats(const Json& array) {
  std::vector<Dyadic> values;
  for (const Json& text : array) values.emplace_back(files::parse_hex_float(text.get<std::string>()));
  return values;
}

Matrix column(const std::vector<Dyadic>& entries) {
  Matrix result(static_cast<int>(entries.size()), 1);
  result.entries = entries;
  return result;
}

Dyadic squared_norm(const std::vector<Dyadic>& v) {
  Dyadic sum;
  for (const Dyadic& x : v) sum += x * x;
  return sum;
}

Dyadic power(const Dyadic& base, std::size_t exponent) {
  Dyadic result(1.0);
  for (std::size_t i = 0; i < exponent; ++i) result = result * base;
  return result;
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
    int first = -1;
    text >> first;
    factor.first.push_back(first);
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
  const std::vector<Dyadic> t = hex_floats(proof["t"]);
  std::size_t neurons = 0;
  for (std::size_t k = 0; k + 1 < chain.size(); ++k) neurons += static_cast<std::size_t>(chain[k].rows);
  require(rho.sign() > 0, where + ": rho is not positive");
  require(t.size() == neurons, where + ": needs one multiplier t per hidden neuron");
  require(std::all_of(t.begin(), t.end(), [](const Dyadic& x) { return x.sign() >= 0; }),
          where + ": a t is negative");
  require(upper >= 0 && Dyadic(upper) * upper >= rho, where + ": claims less than sqrt(rho)");
  require(shows_positive_semidefinite(lipschitz_lmi(chain, rho, t),
                                      parse_factor(proof["factor"], where + ".factor")),
          where + ": the factor does not show that the matrix inequality holds");
}

/// f(x), exactly; `x` is a column.
Matrix evaluate(const Weights& f, Matrix x) {
  for (const files::Layer& layer : f.layers) {
    x = product(Matrix(layer.outputs, layer.inputs, layer.weights), x);
    for (int i = 0; i < layer.outputs; ++i) {
      x(i, 0) += layer.biases[i];
      if (&layer != &f.layers.back() && x(i, 0).sign() < 0) x(i, 0) = Dyadic();
    }
  }
  return x;
}

class Checker {
 public:
  Checker(const Json& certificate, const files::Network& network)
      : certificate_(certificate), network_(network), parts_(files::parts(network)) {}

  CheckResult run() {
    require_keys(certificate_,
                 {"schema", "tool", "statement", "network", "gamma", "layers", "bounds", "content_sha256"},
                 "certificate");
    require(certificate_["schema"] == kCertificateSchema, "schema is not " + std::string(kCertificateSchema));
    require(certificate_["content_sha256"] == files::content_sha256(certificate_),
            "content_sha256 does not match: the certificate was changed after it was written");
    check_weights(certificate_["network"]);
    check_layers();
    require(!certificate_["bounds"].empty(), "bounds is empty");
    for (const Json& bound : certificate_["bounds"]) check_bound(bound);
    result_.accepted = true;
    result_.reason = "every statement verified in exact arithmetic";
    return result_;
  }

 private:
  void check_weights(const Json& named) {
    require_keys(named, {"description_sha256", "weights"}, "network");
    require(named["description_sha256"] == network_.sha256,
            "network.description_sha256 is of another network.toml");
    require(named["weights"].size() == parts_.size(), "network.weights lists another number of networks");
    for (const auto& [name, weights] : parts_) {
      require(named["weights"].contains(name), "network.weights lacks " + name);
      const Json& entry = named["weights"][name];
      require_keys(entry, {"sha256", "precision"}, "network.weights." + name);
      require(entry["sha256"] == weights->sha256,
              "sha256 of " + name + " is of another file than " + weights->path);
      require(entry["precision"] == files::name(weights->precision), "precision of " + name + " is wrong");
    }
  }

  void check_layers() {
    const Json& gamma = certificate_["gamma"];
    if (!gamma.is_null()) {
      require_keys(gamma, {"value", "value_hex", "scope", "mode"}, "gamma");
      require(gamma["mode"] == "clip" && (gamma["scope"] == "layer" || gamma["scope"] == "network"),
              "gamma has an unknown mode or scope");
      number(gamma["value"], gamma["value_hex"], "gamma.value");
    }
    std::size_t expected = 0;
    for (const auto& [name, weights] : parts_) expected += weights->layers.size();
    for (const Json& layer : certificate_["layers"]) check_layer(layer, gamma);
    require(norms_.size() == expected && certificate_["layers"].size() == expected,
            "layers does not list every layer once");
  }

  void check_layer(const Json& entry, const Json& gamma) {
    require_keys(entry, {"network", "name", "spectral_norm", "spectral_norm_hex", "respects_gamma", "proof"},
                 "layer");
    const std::string network = entry["network"].get<std::string>();
    const std::string name = entry["name"].get<std::string>();
    const std::string where = "layer " + network + " " + name;
    require(parts_.count(network) == 1, where + ": no such network");
    const std::vector<files::Layer>& layers = parts_.at(network)->layers;
    const auto layer =
        std::find_if(layers.begin(), layers.end(), [&](const auto& l) { return l.name == name; });
    require(layer != layers.end(), where + ": no such layer");
    const double lower =
        number(entry["spectral_norm"].at(0), entry["spectral_norm_hex"].at(0), where + " lower");
    const double upper =
        number(entry["spectral_norm"].at(1), entry["spectral_norm_hex"].at(1), where + " upper");
    require_keys(entry["proof"], {"lower_vector", "upper"}, where + ".proof");
    const Matrix w(layer->outputs, layer->inputs, layer->weights);
    const std::vector<Dyadic> v = hex_floats(entry["proof"]["lower_vector"]);
    require(static_cast<int>(v.size()) == w.cols && squared_norm(v).sign() > 0,
            where + ": unusable lower_vector");
    require(
        lower >= 0 && squared_norm(product(w, column(v)).entries) >= Dyadic(lower) * lower * squared_norm(v),
        where + ": claims more than |W v| / |v|");
    check_upper({w}, entry["proof"]["upper"], upper, where);
    Json respects;  // null: nothing stated, or the enclosure does not decide
    if (!gamma.is_null()) {
      const Dyadic limit = gamma["value"].get<double>();
      const std::size_t exponent =
          gamma["scope"] == "layer" ? 1 : layers.size();  // norm <= gamma^(1 / layers)
      if (limit >= power(upper, exponent)) respects = true;
      if ((power(lower, exponent) - limit).sign() > 0) respects = false;
    }
    require(entry["respects_gamma"] == respects,
            where + ": respects_gamma does not follow from its spectral norm");
    norms_[network + " " + name] = upper;
    ++result_.spectral_norms;
  }

  void check_bound(const Json& bound) {
    require_keys(bound,
                 {"function", "domain", "block", "law", "norm", "unit", "upper", "upper_hex", "upper_method",
                  "lower", "lower_hex", "lower_witness", "proof"},
                 "bound");
    const std::string function = bound["function"].get<std::string>();
    const std::string where = "bound " + function;
    const std::vector<Matrix> chain = stages(network_, function);
    require(bound["domain"] == "global" && bound["block"] == "all" && bound["norm"] == "l2",
            where + ": domain, block or norm is none that this checker knows");
    require(bound["law"] == (function.rfind("set:", 0) == 0 ? "one_neighbour" : "none"),
            where + ": wrong law");
    require(bound["unit"] == files::unit(network_, function),
            where + ": unit is not " + files::unit(network_, function));
    const double upper = number(bound["upper"], bound["upper_hex"], where + " upper");
    if (bound["upper_method"] == "sdp") {
      check_upper(chain, bound["proof"], upper, where);
    } else {
      require(bound["upper_method"] == "product" && bound["proof"].is_null(),
              where + ": unknown upper_method");
      require(Dyadic(upper) >= product_of_norms(function),
              where + ": claims less than the product of the norms");
    }
    ++result_.upper_bounds;
    if (bound["lower"].is_null()) {
      require(bound["lower_hex"].is_null() && bound["lower_witness"].is_null(),
              where + ": lower has no value");
      return;
    }
    check_lower(bound["lower_witness"], function,
                number(bound["lower"], bound["lower_hex"], where + " lower"), where + ": lower_witness");
    ++result_.lower_bounds;
  }

  Dyadic product_of_norms(const std::string& function) const {
    Dyadic total(1.0);
    for (const std::string& name : files::networks_of(function)) {
      for (const files::Layer& layer : parts_.at(name)->layers)
        total = total * norms_.at(name + " " + layer.name);
    }
    return total;
  }

  /// The input column of network `name`, clamped as NET says.
  Matrix input(const std::string& name, const Json& point, const std::string& where) const {
    Matrix x = column(hex_floats(point));
    require(x.rows == parts_.at(name)->inputs(),
            where + ": a point has another length than the input of " + name);
    for (int i = 0; network_.clamp && files::is_clamped(name) && i < x.rows; ++i) {
      const Dyadic lower = network_.clamp->lower.at(i);
      const Dyadic upper = network_.clamp->upper.at(i);
      x(i, 0) = lower >= x(i, 0) ? lower : x(i, 0) >= upper ? upper : x(i, 0);
    }
    return x;
  }

  /// |f(x) - f(y)| >= lower |x - y|. In a set function one neighbour moves from x to y, the others stay.
  void check_lower(const Json& witness, const std::string& function, double lower,
                   const std::string& where) const {
    require_keys(witness, {"x", "y", "others"}, where);
    const std::vector<std::string> names = files::networks_of(function);
    std::vector<Matrix> images = {evaluate(*parts_.at(names[0]), input(names[0], witness["x"], where)),
                                  evaluate(*parts_.at(names[0]), input(names[0], witness["y"], where))};
    int grounds = names[0] == "phi:ground" ? 1 : 0;
    for (const Json& other : witness["others"]) {
      require_keys(other, {"network", "x"}, where + ".others");
      const std::string name = other["network"].get<std::string>();
      require(names.size() == 2 && name.rfind("phi:", 0) == 0,
              where + ".others: not a neighbour in a set function");
      grounds += name == "phi:ground" ? 1 : 0;
      const Matrix fixed = evaluate(*parts_.at(name), input(name, other["x"], where));
      for (Matrix& image : images) {
        for (int i = 0; i < image.rows; ++i) image(i, 0) += fixed(i, 0);
      }
    }
    require(names.size() == 1 || grounds == static_cast<int>(parts_.count("phi:ground")),
            where + ": the ground network enters the sum exactly once");
    if (names.size() == 2) {
      for (Matrix& image : images) image = evaluate(*parts_.at(names[1]), image);
    }
    const auto distance = [](Matrix a, const Matrix& b) {
      for (int i = 0; i < a.rows; ++i) a(i, 0) += -b(i, 0);
      return squared_norm(a.entries);
    };
    const Dyadic moved = distance(column(hex_floats(witness["x"])), column(hex_floats(witness["y"])));
    require(moved.sign() > 0, where + ": x equals y");
    require(lower >= 0 && distance(images[0], images[1]) >= Dyadic(lower) * lower * moved,
            where + ": claims more than the slope between x and y");
  }

  const Json& certificate_;
  const files::Network& network_;
  std::map<std::string, const Weights*> parts_;
  std::map<std::string, Dyadic> norms_;  ///< verified upper ends, by "<network> <layer>"
  CheckResult result_;
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
    CheckResult rejected;
    rejected.reason = fault.what();
    return rejected;
  }
}

}  // namespace swarmcert::check
