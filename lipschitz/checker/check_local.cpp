#include <algorithm>
#include <cmath>
#include <limits>

#include "lipschitz/checker/certificate_checker.h"
#include "lipschitz/checker/projective_cover.h"
#include "lipschitz/checker/slope_tree.h"
#include "lipschitz/checker/tree_proof.h"
#include "nn/weights/function_id.h"

namespace swarmcert::check {

void CertificateChecker::read_box(const files::FunctionId& part, std::vector<double>& lower,
                                  std::vector<double>& upper, const std::string& where) const {
  lower = files::parse_hex_floats(certificate_["box"].at(part.name()).at("lower"));
  upper = files::parse_hex_floats(certificate_["box"].at(part.name()).at("upper"));
  const auto inputs = static_cast<std::size_t>(parts_.at(part)->inputs());
  require(lower.size() == inputs && upper.size() == inputs, where + ": the box has another size");
  for (std::size_t k = 0; k < inputs; ++k) {
    if (network_.clamp && files::is_clamped(part)) {  // the clamp never increases a distance
      lower[k] = std::clamp(lower[k], network_.clamp->lower[k], network_.clamp->upper[k]);
      upper[k] = std::clamp(upper[k], network_.clamp->lower[k], network_.clamp->upper[k]);
    }
    require(lower[k] <= upper[k], where + ": the box is empty");
  }
}

void CertificateChecker::check_others(const Json& others, const std::vector<files::FunctionId>& names,
                                      Neighbours counts, Row& least, Row& most,
                                      const std::string& where) const {
  if (!names[0].is_ground_phi()) {
    if (--counts.at(names[0].kind()) == 0) counts.erase(names[0].kind());
    if (parts_.count(files::FunctionId::ground_phi()) == 1) counts[files::kGroundKind] = 1;
  }
  require(others.is_object() && others.size() == counts.size(),
          where + ": others does not list the kinds of the other neighbours");
  const auto rows = static_cast<std::size_t>(parts_.at(names[1])->layers.front().outputs);
  least.assign(rows, 0.0);
  most.assign(rows, 0.0);
  for (const auto& [kind, count] : counts) {
    const files::FunctionId part = files::FunctionId::phi(kind);
    const std::string here = where + "." + part.name();
    const Json& range = others.at(part.name());
    files::require_keys(range, {"tree", "least", "most"}, here);
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

void CertificateChecker::check_local(const Json& bound, double upper, const std::vector<double>& scale,
                                     const std::string& where) {
  const Json& proof = bound["proof"];
  const bool is_coupled = proof.contains("others"), is_global = bound["domain"] == "global";
  std::set<std::string> keys = {"rho", is_coupled ? "others" : "form", "tree", "multipliers"};
  if (is_global) keys.insert("radius");
  if (proof.contains("conflicts")) keys.insert("conflicts");
  if (is_coupled) keys.insert("forms");
  files::require_keys(proof, keys, where + ".proof");
  const files::FunctionId function = bound["function"].get<std::string>();
  const std::vector<files::FunctionId> names = function.parts();
  const files::FunctionId& moved = names.front();
  const std::string block = bound["block"].get<std::string>();
  require(!moved.is_rho(), where + ": rho has no box");
  const double rho = files::parse_hex_float(proof["rho"].get<std::string>());
  require(rho > 0 && Dyadic(upper) * upper >= Dyadic(rho), where + ": claims less than sqrt(rho)");
  TreeProof tree{proof["tree"].get<std::string>(), {}, {}, {}};
  require(proof["multipliers"].is_array(), where + ": multipliers is not an array");
  for (const Json& words : proof["multipliers"]) tree.multipliers.push_back(hex_floats_in(words));
  if (!files::is_relu(network_, function)) {
    require(!is_coupled && !is_global && proof["form"].is_null() && !proof.contains("conflicts"),
            where + ": a bound by parts for other activations than ReLU is for a box, without a form");
    Sides box;
    read_box(moved, box.lower, box.upper, where);
    const TreeVerdict verdict = check_slope_tree(network_, function, block, scale, box, rho, tree);
    require(verdict.holds, where + ": " + verdict.reason);
    ++on_boxes_;
    return;
  }
  LocalFunction f;
  if (is_coupled) {
    const Neighbours neighbours = neighbours_of(bound, where);
    require(!neighbours.empty(), where + ": a bound for any number of neighbours needs a form");
    Row least, most;
    check_others(proof["others"], names, neighbours, least, most, where + ".others");
    f = coupled_function(network_, function, block, scale, least, most);
  } else {
    require(proof["form"].is_null() == (names.size() == 1),
            where + ": a form must be given for set functions, and only for them");
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
  if (proof.contains("conflicts")) {
    require(proof["conflicts"].is_array(), where + ": conflicts is not an array");
    for (const Json& words : proof["conflicts"]) tree.conflicts.push_back(conflicts_in(words));
  }
  if (is_coupled) {
    require(proof["forms"].is_array(), where + ": forms is not an array");
    for (const Json& form : proof["forms"]) {
      files::require_keys(form, {"q", "t"}, where + ".forms");
      tree.forms.push_back({hex_floats_in(form["q"]), hex_floats_in(form["t"])});
    }
  }
  const TreeVerdict verdict = check_tree(f, boxes, rho, tree);
  require(verdict.holds, where + ": " + verdict.reason);
  ++on_boxes_;
}

Matrix CertificateChecker::checked_form(const Json& form, const files::FunctionId& rho,
                                        const std::string& where) const {
  files::require_keys(form, {"q", "t", "factor"}, where);
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

}  // namespace swarmcert::check
