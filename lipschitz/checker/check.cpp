#include "lipschitz/checker/check.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "lipschitz/checker/lipschitz_lmi.h"
#include "lipschitz/checker/projective_cover.h"
#include "lipschitz/checker/tree_proof.h"
#include "lipschitz/stages.h"
#include "lipschitz/witness.h"
#include "nn/files/content_hash.h"
#include "nn/files/functions.h"

namespace swarmcert::check {
namespace {

using files::Json;
using files::require_keys;
using files::Weights;

using Row = std::vector<double>;
/// By kind.
using Neighbours = std::map<std::string, long>;

constexpr long kMostNeighbours = 1000000;

void require(bool condition, const std::string& reason) {
  if (!condition) throw std::runtime_error(reason);
}

/// A nonnegative number that stands once in decimal and once in hex: both must be the same double.
double number(const Json& decimal, const Json& hex, const std::string& where) {
  const double value = files::parse_hex_float(hex.get<std::string>());
  require(decimal.is_number() && decimal.get<double>() == value && value >= 0,
          where + ": negative, or decimal and hex notation differ");
  return value;
}

/// Finite hex floats in one text, separated by single spaces.
std::vector<double> hex_floats_in(const Json& json) {
  std::vector<double> values;
  std::istringstream text(json.get<std::string>());
  for (std::string word; text >> word;) values.push_back(files::parse_hex_float(word));
  return values;
}

/// Conflicts in one text, each as "<neuron><+ or -> <neuron><+ or -> <lambda> <multiplier>"; + is on.
std::vector<Conflict> conflicts_in(const Json& json) {
  std::vector<Conflict> conflicts;
  std::istringstream text(json.get<std::string>());
  const auto neuron = [](const std::string& word, bool& is_on) {
    std::size_t index = 0;
    const char* const last = word.data() + word.size() - 1;
    const auto [end, error] = std::from_chars(word.data(), last, index);
    require(error == std::errc() && end == last && word.size() <= 10 && (*last == '+' || *last == '-'),
            "a conflict's neuron is not a number with + or -");
    is_on = *last == '+';
    return index;
  };
  for (std::string first, second, lambda, multiplier; text >> first;) {
    require(static_cast<bool>(text >> second >> lambda >> multiplier), "a conflict lacks words");
    Conflict conflict;
    conflict.first = neuron(first, conflict.first_on);
    conflict.second = neuron(second, conflict.second_on);
    conflict.lambda = files::parse_hex_float(lambda);
    conflict.multiplier = files::parse_hex_float(multiplier);
    conflicts.push_back(conflict);
  }
  return conflicts;
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
  for (const std::string& row : json["rows"].get<std::vector<std::string>>()) {
    std::istringstream text(row);
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
  const std::vector<double> t = files::parse_hex_floats(proof["t"]);
  require(t.size() == hidden_neurons(chain), where + ": needs one multiplier t per hidden neuron");
  require(rho.sign() > 0 && std::all_of(t.begin(), t.end(), [](double x) { return x >= 0; }),
          where + ": rho is not positive, or a t negative");
  require(Dyadic(upper) * upper >= rho, where + ": claims less than sqrt(rho)");
  require(shows_positive_semidefinite(lipschitz_lmi(chain, rho, {t.begin(), t.end()}),
                                      parse_factor(proof["factor"], where + ".factor")),
          where + ": the factor does not show that the matrix inequality holds");
}

class Checker {
 public:
  Checker(const Json& certificate, const files::Network& network)
      : certificate_(certificate),
        network_(certificate.at("network").at("as") == "float32" ? files::as_float32(network) : network),
        parts_(files::parts(network_)) {}

  CheckResult run() {
    require_keys(
        certificate_,
        {"schema", "tool", "statement", "network", "box", "layers", "bounds", "laws", "content_sha256"},
        "certificate");
    require(certificate_["schema"] == kCertificateSchema, "schema is not " + std::string(kCertificateSchema));
    require(certificate_["statement"] == kStatement, "statement is not the one that is checked");
    require(certificate_["content_sha256"] == files::content_sha256(certificate_),
            "content_sha256 does not match: the certificate was changed after it was written");
    check_weights(certificate_["network"]);
    for (const auto& [name, weights] : parts_)
      for (const files::Layer& layer : weights->layers)
        check_layer(certificate_["layers"].at(spectral_norms_), name, layer);
    require(certificate_["layers"].size() == static_cast<std::size_t>(spectral_norms_),
            "layers lists more than the networks have");
    require(certificate_["bounds"].is_array() && !certificate_["bounds"].empty(), "bounds is empty");
    require(certificate_["laws"].is_array(), "laws is not an array");
    for (const Json& bound : certificate_["bounds"]) check_bound(bound);
    for (const Json& law : certificate_["laws"]) check_law(law);
    std::string reason = "every statement verified in exact arithmetic";
    if (on_boxes_ > 0) reason += ", those by parts of boxes in double with every rounding accounted for";
    return {true, reason, spectral_norms_, upper_bounds_, lower_bounds_, on_boxes_};
  }

 private:
  void check_weights(const Json& named) {
    require_keys(named, {"description_sha256", "weights", "as"}, "network");
    require(named["as"].is_null() || named["as"] == "float32", "network.as is unknown");
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

  void check_layer(const Json& entry, const std::string& network, const files::Layer& layer) {
    const std::string where = "layer " + network + " " + layer.name;
    require_keys(entry, {"network", "name", "spectral_norm", "spectral_norm_hex", "proof"}, where);
    require(entry["network"] == network && entry["name"] == layer.name,
            where + " is not where it is expected");
    const double lower = number(entry["spectral_norm"].at(0), entry["spectral_norm_hex"].at(0), where);
    const double upper = number(entry["spectral_norm"].at(1), entry["spectral_norm_hex"].at(1), where);
    require_keys(entry["proof"], {"lower_vector", "upper"}, where + ".proof");
    const Matrix w(layer.outputs, layer.inputs, layer.weights);
    const std::vector<double> vector = files::parse_hex_floats(entry["proof"]["lower_vector"]);
    const Matrix v(static_cast<int>(vector.size()), 1, vector);
    require(v.rows == w.cols && squared_norm(v).sign() > 0, where + ": unusable lower_vector");
    require(squared_norm(product(w, v)) >= Dyadic(lower) * lower * squared_norm(v),
            where + ": claims more than |W v| / |v|");
    check_upper({w}, entry["proof"]["upper"], upper, where);
    norms_[network] = norms_.emplace(network, 1.0).first->second * upper;
    ++spectral_norms_;
  }

  void check_bound(const Json& bound) {
    std::set<std::string> keys = {"function", "domain",    "block",         "law",       "norm",
                                  "scale",    "unit",      "upper",         "upper_hex", "upper_method",
                                  "lower",    "lower_hex", "lower_witness", "proof"};
    if (bound.contains("neighbours")) keys.insert("neighbours");
    require_keys(bound, keys, "bound");
    const std::string function = bound["function"].get<std::string>();
    const std::string block = bound["block"].get<std::string>();
    const std::string where = "bound " + function + " " + block;
    const std::vector<std::string> names = files::networks_of(function);
    const std::vector<double> scale = files::parse_hex_floats(bound["scale"]);
    require(std::all_of(scale.begin(), scale.end(), [](double x) { return x > 0; }),
            where + ": scale is not positive");
    const std::map<std::string, std::string> meaning = {
        {"domain", bound["domain"] == "box" && certificate_["box"].is_object() ? "box" : "global"},
        {"norm", scale.empty() ? "l2" : "weighted_l2"},
        {"unit", files::unit(network_, function, block)},
        {"law", names.size() == 2 ? "one_neighbour" : "none"}};
    for (const auto& [key, text] : meaning)
      require(bound[key] == text, where + ": " + key + " is not " + text);
    const Neighbours neighbours = neighbours_of(bound, where);
    const double upper = number(bound["upper"], bound["upper_hex"], where + " upper");
    if (bound["upper_method"] == "sdp") {
      check_upper(stages(network_, function, block, scale), bound["proof"], upper, where);
    } else if (bound["upper_method"] == "branch") {
      check_local(bound, upper, scale, where);
    } else {
      require(bound["upper_method"] == "product" && bound["proof"].is_null(),
              where + ": unknown upper_method");
      Dyadic total = scale.empty() ? 1.0 : *std::max_element(scale.begin(), scale.end());
      for (const std::string& name : names) total = total * norms_.at(name);
      require(Dyadic(upper) >= total, where + ": claims less than the product of the norms");
    }
    if (scale.empty()) {
      proved_[key(function, block, neighbours)] = upper;
      if (bound["upper_method"] == "branch" && bound["domain"] == "box")
        local_.insert(key(function, block, neighbours));
    }
    ++upper_bounds_;
    if (bound["lower_witness"].is_null())
      return require(bound["lower"].is_null() && bound["lower_hex"].is_null(),
                     where + ": lower without a witness");
    const double lower = number(bound["lower"], bound["lower_hex"], where + " lower");
    check_lower(bound, lower, scale, where + ": lower_witness");
    ++lower_bounds_;
  }

  /// Of a set function, at most how many of each kind there are; empty: any number.
  Neighbours neighbours_of(const Json& bound, const std::string& where) const {
    if (!bound.contains("neighbours")) return {};
    const Neighbours neighbours = bound["neighbours"].get<Neighbours>();
    const std::vector<std::string> names = files::networks_of(bound["function"].get<std::string>());
    require(names.size() == 2 && bound["domain"] == "box",
            where + ": neighbours only of a set function on a box");
    for (const auto& [kind, count] : neighbours)
      require(kind != files::kGroundKind && parts_.count("phi:" + kind) == 1 && 1 <= count &&
                  count <= kMostNeighbours,
              where + ": impossible neighbours");
    require(
        !neighbours.empty() && (names[0] == files::kGroundPhi || neighbours.count(names[0].substr(4)) == 1),
        where + ": the neighbour that moves is none of those listed");
    return neighbours;
  }

  static std::string key(const std::string& function, const std::string& block,
                         const Neighbours& neighbours) {
    return function + " " + block + (neighbours.empty() ? "" : " " + Json(neighbours).dump());
  }

  /// The part's box, or what the input clamp makes of it.
  void read_box(const std::string& part, std::vector<double>& lower, std::vector<double>& upper,
                const std::string& where) const {
    lower = files::parse_hex_floats(certificate_["box"].at(part).at("lower"));
    upper = files::parse_hex_floats(certificate_["box"].at(part).at("upper"));
    const auto inputs = static_cast<std::size_t>(parts_.at(part)->inputs());
    require(lower.size() == inputs && upper.size() == inputs, where + ": the box has another size");
    for (std::size_t k = 0; k < inputs; ++k) {
      if (network_.clamp && files::is_clamped(part)) {  // never increases a distance
        lower[k] = std::clamp(lower[k], network_.clamp->lower[k], network_.clamp->upper[k]);
        upper[k] = std::clamp(upper[k], network_.clamp->lower[k], network_.clamp->upper[k]);
      }
      require(lower[k] <= upper[k], where + ": the box is empty");
    }
  }

  /// What the other terms of the sum add to the values before the first ReLU of rho: each kind's range over its box,
  /// shown by a tree, as often as there are such neighbours or less; the ground's once.
  void check_others(const Json& others, const std::vector<std::string>& names, Neighbours counts, Row& least,
                    Row& most, const std::string& where) const {
    if (names[0] != files::kGroundPhi) {
      if (--counts.at(names[0].substr(4)) == 0) counts.erase(names[0].substr(4));
      if (parts_.count(files::kGroundPhi) == 1) counts[files::kGroundKind] = 1;
    }
    require(others.is_object() && others.size() == counts.size(), where + ": others lists other kinds");
    const auto rows = static_cast<std::size_t>(parts_.at(names[1])->layers.front().outputs);
    least.assign(rows, 0.0);
    most.assign(rows, 0.0);
    for (const auto& [kind, count] : counts) {
      const std::string part = "phi:" + kind, here = where + "." + part;
      const Json& range = others.at(part);
      require_keys(range, {"tree", "least", "most"}, here);
      const Row low = files::parse_hex_floats(range["least"]), high = files::parse_hex_floats(range["most"]);
      Row lower_end, upper_end;
      read_box(part, lower_end, upper_end, here);
      const TreeVerdict verdict = check_range(term_layers(network_, part, names[1]), lower_end, upper_end,
                                              range["tree"].get<std::string>(), low, high);
      require(verdict.holds, here + ": " + verdict.reason);
      const auto n = static_cast<double>(count);
      const bool always = kind == files::kGroundKind;
      constexpr double kInfinity = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < rows; ++i) {
        const double down = always ? low[i] : std::nextafter(n * std::min(low[i], 0.0), -kInfinity);
        const double up = always ? high[i] : std::nextafter(n * std::max(high[i], 0.0), kInfinity);
        least[i] = std::nextafter(least[i] + down, -kInfinity);
        most[i] = std::nextafter(most[i] + up, kInfinity);
      }
    }
  }

  /// sqrt(rho) <= `upper` bounds the slope on the box, or on what the input clamp makes of it; of a set function through
  /// a quadratic form of rho, for so many neighbours one that holds for the sums that they reach. Everywhere: by a projective cover.
  void check_local(const Json& bound, double upper, const std::vector<double>& scale,
                   const std::string& where) {
    const Json& proof = bound["proof"];
    const bool is_coupled = proof.contains("others"), is_global = bound["domain"] == "global";
    std::set<std::string> keys = {"rho", is_coupled ? "others" : "form", "tree", "multipliers"};
    if (is_global) keys.insert("radius");
    if (proof.contains("conflicts")) keys.insert("conflicts");
    if (is_coupled) keys.insert("forms");
    require_keys(proof, keys, where + ".proof");
    const std::vector<std::string> names = files::networks_of(bound["function"].get<std::string>());
    const std::string& moved = names.front();
    const std::string block = bound["block"].get<std::string>();
    require(moved.rfind("rho:", 0) != 0, where + ": rho has no box");
    const double rho = files::parse_hex_float(proof["rho"].get<std::string>());
    require(rho > 0 && Dyadic(upper) * upper >= Dyadic(rho), where + ": claims less than sqrt(rho)");
    LocalFunction f;
    if (is_coupled) {
      const Neighbours neighbours = neighbours_of(bound, where);
      require(!neighbours.empty(), where + ": a bound for any number of neighbours needs a form");
      Row least, most;
      check_others(proof["others"], names, neighbours, least, most, where + ".others");
      f = coupled_function(network_, bound["function"].get<std::string>(), block, scale, least, most);
    } else {
      require(proof["form"].is_null() == (names.size() == 1),
              where + ": a form for set functions, and only for those");
      Matrix q(0, 0);
      if (names.size() == 2) q = checked_form(proof["form"], names.back(), where + ".form");
      f = local_function(network_, moved, block, scale, q);
    }
    std::vector<Sides> boxes(1);
    if (is_global) {
      const Row radius = files::parse_hex_floats(proof["radius"]);
      require(radius.size() == static_cast<std::size_t>(parts_.at(moved)->inputs()) &&
                  std::all_of(radius.begin(), radius.end(), [](double r) { return r > 0; }),
              where + ": needs a positive radius per input");
      boxes = projective_cover(radius);
      f = homogeneous(f);
    } else {
      read_box(moved, boxes[0].lower, boxes[0].upper, where);
    }
    TreeProof tree{proof["tree"].get<std::string>(), {}, {}, {}};
    require(proof["multipliers"].is_array(), where + ": multipliers is not an array");
    for (const Json& words : proof["multipliers"]) tree.multipliers.push_back(hex_floats_in(words));
    if (proof.contains("conflicts")) {
      require(proof["conflicts"].is_array(), where + ": conflicts is not an array");
      for (const Json& words : proof["conflicts"]) tree.conflicts.push_back(conflicts_in(words));
    }
    if (is_coupled) {
      require(proof["forms"].is_array(), where + ": forms is not an array");
      for (const Json& form : proof["forms"]) {
        require_keys(form, {"q", "t"}, where + ".forms");
        tree.forms.push_back({hex_floats_in(form["q"]), hex_floats_in(form["t"])});
      }
    }
    const TreeVerdict verdict = check_tree(f, boxes, rho, tree);
    require(verdict.holds, where + ": " + verdict.reason);
    ++on_boxes_;
  }

  /// Q with |rho(v) - rho(w)|^2 <= (v - w)' Q (v - w), its lower triangle given row by row.
  Matrix checked_form(const Json& form, const std::string& rho, const std::string& where) const {
    require_keys(form, {"q", "t", "factor"}, where);
    const std::vector<Matrix> chain = stages(network_, rho);
    const int size = chain.front().cols;
    require(form["q"].is_array() && form["q"].size() == static_cast<std::size_t>(size),
            where + ": q has another size");
    Matrix q(size, size);
    for (int i = 0; i < size; ++i) {
      const std::vector<double> row = hex_floats_in(form["q"][static_cast<std::size_t>(i)]);
      require(row.size() == static_cast<std::size_t>(i) + 1, where + ": q is not a lower triangle");
      for (int j = 0; j <= i; ++j) q(i, j) = q(j, i) = row[static_cast<std::size_t>(j)];
    }
    const std::vector<double> t = files::parse_hex_floats(form["t"]);
    require(
        t.size() == hidden_neurons(chain) && std::all_of(t.begin(), t.end(), [](double x) { return x >= 0; }),
        where + ": needs one nonnegative t per hidden neuron");
    require(shows_positive_semidefinite(quadratic_lmi(chain, q, {t.begin(), t.end()}),
                                        parse_factor(form["factor"], where + ".factor")),
            where + ": the factor does not show that the matrix inequality holds");
    return q;
  }

  /// |f(x) - f(y)| >= lower |x - y|. In a set function one neighbour moves from x to y, the others stay.
  void check_lower(const Json& bound, double lower, const std::vector<double>& scale,
                   const std::string& where) const {
    const Json& witness = bound["lower_witness"];
    require_keys(witness, {"x", "y", "others"}, where);
    const std::string function = bound["function"].get<std::string>();
    const auto point = [&](const Json& array, const std::string& part) {
      const std::vector<double> values = files::parse_hex_floats(array);
      const std::vector<float> result(values.begin(), values.end());
      require(std::equal(values.begin(), values.end(), result.begin()),
              where + ": a coordinate is not a float32");
      if (bound["domain"] == "box") {
        const std::vector<double> lower_end =
            files::parse_hex_floats(certificate_["box"].at(part).at("lower"));
        const std::vector<double> upper_end =
            files::parse_hex_floats(certificate_["box"].at(part).at("upper"));
        for (std::size_t k = 0; k < values.size(); ++k)
          require(lower_end.at(k) <= values[k] && values[k] <= upper_end.at(k),
                  where + ": a point is outside of the box");
      }
      return result;
    };
    const std::string moved = files::networks_of(function).front();
    lipschitz::SlopePoints points{point(witness["x"], moved), point(witness["y"], moved), {}};
    std::vector<std::string> others;
    require(witness["others"].is_array(), where + ": others is not an array");
    Neighbours there = {{moved.substr(moved.find(':') + 1), 1}};
    for (const Json& other : witness["others"]) {
      require_keys(other, {"network", "x"}, where + ".others");
      others.push_back(other["network"].get<std::string>());
      points.others.push_back(point(other["x"], others.back()));
      ++there[others.back().substr(others.back().find(':') + 1)];
    }
    const Neighbours neighbours = neighbours_of(bound, where);
    for (const auto& [kind, count] : there)
      require(neighbours.empty() || kind == files::kGroundKind ||
                  (neighbours.count(kind) == 1 && count <= neighbours.at(kind)),
              where + ": has more neighbours than listed");
    const mpq_class square = lipschitz::slope_squared(
        lipschitz::slope_function(network_, function, others), points,
        files::block_coordinates(network_, function, bound["block"].get<std::string>()), scale);
    require(mpq_class(lower) * mpq_class(lower) <= square,
            where + ": claims more than the slope between x and y");
  }

  /// Several terms of the sum move: by the triangle inequality one after the other, each by its one_neighbour bound.
  /// Not by single coordinates: those of the ground are others than those of a neighbour.
  void check_law(const Json& law) {
    require_keys(law, {"rho", "neighbours", "domain", "block", "law", "upper", "upper_hex"}, "law");
    const std::string rho = law["rho"].get<std::string>(), block = law["block"].get<std::string>();
    const std::string where = "law of " + rho + " " + block;
    const double upper = number(law["upper"], law["upper_hex"], where + " upper");
    const Neighbours neighbours = law["neighbours"].get<Neighbours>();
    Neighbours terms = neighbours;
    require(terms.count(files::kGroundKind) == 0, where + ": the ground is no neighbour");
    if (parts_.count(files::kGroundPhi) == 1) terms[files::kGroundKind] = 1;
    require(law["domain"] == "box" || law["domain"] == "global", where + ": unknown domain");
    Dyadic sum, sum_of_squares;
    for (const auto& [kind, count] : terms) {
      require(1 <= count && count <= kMostNeighbours, where + ": impossible number of neighbours");
      const Dyadic n = static_cast<double>(count);
      const std::string function = "set:" + kind + ":" + rho, any_number = key(function, block, {});
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

  const Json& certificate_;
  const files::Network network_;
  std::map<std::string, const Weights*> parts_;
  std::map<std::string, Dyadic> norms_;   ///< product of the verified norms, by network
  std::map<std::string, Dyadic> proved_;  ///< verified upper bounds, by key()
  std::set<std::string> local_;           ///< those of them that hold on the box only
  int spectral_norms_ = 0, upper_bounds_ = 0, lower_bounds_ = 0, on_boxes_ = 0;
};

}  // namespace

CheckResult check(const Json& certificate, const files::Network& network) {
  try {
    return Checker(certificate, network).run();
  } catch (const std::exception& fault) {
    return {false, fault.what(), 0, 0, 0, 0};
  }
}

}  // namespace swarmcert::check
