#include <algorithm>

#include "lipschitz/checker/centred_form.h"
#include "lipschitz/checker/certificate_checker.h"
#include "lipschitz/checker/values.h"
#include "nn/weights/compositions.h"

namespace swarmcert::check {
namespace {

using Row = std::vector<double>;

constexpr const char* kNotFloat32 = ": a float32 error of weights that are not float32";

std::vector<Dyadic> exact(const Row& values) { return {values.begin(), values.end()}; }

/// Returns whether a <= b, entry by entry.
bool at_most(const std::vector<Dyadic>& a, const std::vector<Dyadic>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Dyadic& x, const Dyadic& y) { return y >= x; });
}

/// Reads the bounds stated for one layer or for a sum.
Bounded stated(const files::Json& json, std::size_t size, bool with_error, const std::string& where) {
  files::require_keys(json, {"lower", "upper", "error"}, where);
  require(json["error"].is_null() != with_error,
          where + ": an error must be given if there are input errors, and only then");
  Bounded result{{exact(hex_floats_in(json["lower"])), exact(hex_floats_in(json["upper"]))}, {}};
  if (with_error) result.error = exact(hex_floats_in(json["error"]));
  require(result.values.lower.size() == size && result.values.upper.size() == size &&
              result.error.size() == (with_error ? size : 0),
          where + ": needs one number per output");
  return result;
}

void require_encloses(const Bounded& stated, const Intervals& values,
                      const std::optional<std::vector<Dyadic>>& error, const std::string& where) {
  require(at_most(stated.values.lower, values.lower) && at_most(values.upper, stated.values.upper),
          where + ": the values leave the bounds");
  if (!stated.error.empty())
    require(error && at_most(*error, stated.error), where + ": claims less than the float32 error");
}

/// Verifies the bounds stated for every layer of a network with activations other than ReLU.
void check_enclosed_layers(const files::Weights& weights, const files::Json& json, const Intervals& input,
                           const std::string& where) {
  const std::vector<Intervals> found = layers_on_box(weights, input);
  for (std::size_t k = 0; k < found.size(); ++k)
    require_encloses(stated(json[k], found[k].lower.size(), false, where), found[k], std::nullopt, where);
}

/// Verifies the bounds stated for every layer of a network; returns those of the last layer.
Bounded check_layers(const files::Weights& weights, const files::Json& json, Bounded input,
                     const std::string& where) {
  require(json.is_array() && json.size() == weights.layers.size(), where + ": needs one entry per layer");
  const bool with_error = !input.error.empty();
  if (!weights.is_relu()) {
    require(!with_error, where + ": a float32 error of a network with activations other than ReLU");
    check_enclosed_layers(weights, json, input.values, where);
    return stated(json.back(), static_cast<std::size_t>(weights.outputs()), false, where);
  }
  for (std::size_t k = 0; k < weights.layers.size(); ++k) {
    const files::Layer& layer = weights.layers[k];
    if (k > 0) input.values = relu_intervals(std::move(input.values));
    Bounded output = stated(json[k], static_cast<std::size_t>(layer.outputs), with_error, where);
    require_encloses(output, layer_intervals(layer, input.values),
                     with_error ? layer_error(layer, input.values, input.error) : std::nullopt, where);
    input = std::move(output);
  }
  return input;
}

/// Verifies the bounds stated for the sum of `terms` and for every layer of rho; returns those of the last layer.
Bounded check_sum(const files::Json& entry, const std::vector<SumTerm>& terms, const files::Weights& rho,
                  const std::string& name, const std::string& where) {
  const bool with_error = !entry["input_error"].is_null();
  require(!with_error || rho.precision == files::Precision::kFloat32, where + kNotFloat32);
  const auto size = static_cast<std::size_t>(rho.inputs());
  Bounded sum = stated(entry["sum"], size, with_error, where + ": sum");
  require_encloses(sum, sum_intervals(terms, size), with_error ? sum_error(terms, size) : std::nullopt,
                   where + ": sum");
  return check_layers(rho, entry["networks"].at(name), std::move(sum), where + ": " + name);
}

}  // namespace

void CertificateChecker::check_values(const Json& entry) {
  files::require_keys(entry,
                      {"function", "neighbours", "domain", "input_error", "networks", "sum", "lower", "upper",
                       "jump", "jump_hex", "float32_error", "float32_error_hex"},
                      "values");
  const files::FunctionId function = entry["function"].get<std::string>();
  const std::string where = "values of " + function.name();
  const std::vector<files::FunctionId> names = function.parts();
  const bool is_set = names.size() == 2;
  for (const files::FunctionId& part : names)
    require(parts_.count(part) == 1, where + ": there is no network " + part.name());
  require(is_set ? !names[0].is_ground_phi() : function.is_plain(),
          where + ": possible only for the network, or for a sum over neighbours");
  const bool has_ground = is_set && parts_.count(files::FunctionId::ground_phi()) == 1;
  require(entry["neighbours"].is_number_integer(), where + ": neighbours is not an integer");
  const long neighbours = entry["neighbours"].get<long>();
  require(is_set ? 1 <= neighbours && neighbours <= kMostNeighbours : neighbours == 0,
          where + ": impossible number of neighbours");
  std::vector<files::FunctionId> inputs = {names[0]};
  if (has_ground) inputs.push_back(files::FunctionId::ground_phi());
  require(entry["networks"].is_object() && entry["networks"].size() == inputs.size() + (is_set ? 1 : 0),
          where + ": networks does not list the networks of the function");
  const bool with_error = !entry["input_error"].is_null();
  if (with_error)
    require(entry["input_error"].is_object() && entry["input_error"].size() == inputs.size(),
            where + ": input_error is not of the function's inputs");

  Bounded result;
  std::vector<SumTerm> terms;
  for (const files::FunctionId& part : inputs) {
    Bounded input = values_input(entry, part, where);
    result = check_layers(*parts_.at(part), entry["networks"].at(part.name()), std::move(input),
                          where + ": " + part.name());
    const bool is_ground = part.is_ground_phi();
    terms.push_back({result, is_ground ? 1 : 0, is_ground ? 1 : neighbours});
  }
  require(entry["sum"].is_null() != is_set,
          where + ": a sum must be given for set functions, and only for them");
  if (is_set) result = check_sum(entry, terms, *parts_.at(names[1]), names[1].name(), where);
  const std::vector<Dyadic> lower = exact(files::parse_hex_floats(entry["lower"]));
  const std::vector<Dyadic> upper = exact(files::parse_hex_floats(entry["upper"]));
  require(lower.size() == result.values.lower.size() && upper.size() == lower.size(),
          where + ": needs one range per output");
  const long silent = files::silent_up_to(network_, function, neighbours);
  const std::vector<Dyadic> zeros(lower.size());
  require(silent == 0 || (at_most(lower, zeros) && at_most(zeros, upper)),
          where + ": the range lacks 0, the output for neighbours for which the network is silent");
  require(silent == neighbours + 1 ||
              (at_most(lower, result.values.lower) && at_most(result.values.upper, upper)),
          where + ": the values leave the range");
  check_jump(entry, terms.front(), names, where);
  require(
      entry["float32_error"].is_null() != with_error && entry["float32_error_hex"].is_null() != with_error,
      where + ": a float32 error must be given if there are input errors, and only then");
  if (with_error) {
    const Dyadic claimed =
        number(entry["float32_error"], entry["float32_error_hex"], where + " float32_error");
    require(claimed * claimed >= square(result.error), where + ": claims less than the float32 error");
  }
  ++values_;
}

void CertificateChecker::check_jump(const Json& entry, const Bounded& moved,
                                    const std::vector<files::FunctionId>& names,
                                    const std::string& where) const {
  const bool is_set = names.size() == 2;
  require(entry["jump"].is_null() != is_set && entry["jump_hex"].is_null() != is_set,
          where + ": a jump must be given for set functions, and only for them");
  if (!is_set) return;
  const Dyadic jump = number(entry["jump"], entry["jump_hex"], where + " jump");
  const auto bound = proved_.find(key(names[1], "all", {}));
  require(bound != proved_.end(), where + ": rests on a bound of " + names[1].name() + " that is missing");
  require(jump * jump >= bound->second * bound->second * largest_square(moved.values),
          where + ": claims less than the jump");
  const auto inputs = [&](const files::FunctionId& part) { return values_box(entry, part, where); };
  require(jump * jump >= silent_step_square(network_, entry["function"].get<std::string>(), inputs),
          where + ": claims less than the step to neighbours for which the network is silent");
}

Intervals CertificateChecker::values_box(const Json& entry, const files::FunctionId& part,
                                         const std::string& where) const {
  if (entry["domain"] == "box") {
    require(certificate_["box"].is_object(), where + ": there is no box");
    Row lower, upper;
    read_box(part, lower, upper, where);
    return {exact(lower), exact(upper)};
  }
  require(entry["domain"] == "clamp" && network_.clamp && files::is_clamped(part),
          where + ": the domain is neither the box nor a clamp of this input");
  return {exact(network_.clamp->lower), exact(network_.clamp->upper)};
}

Bounded CertificateChecker::values_input(const Json& entry, const files::FunctionId& part,
                                         const std::string& where) const {
  Bounded input{values_box(entry, part, where), {}};
  if (entry["input_error"].is_null()) return input;
  require(parts_.at(part)->precision == files::Precision::kFloat32, where + kNotFloat32);
  input.error = exact(files::parse_hex_floats(entry["input_error"].at(part.name())));
  require(
      input.error.size() == input.values.lower.size() &&
          std::all_of(input.error.begin(), input.error.end(), [](const Dyadic& x) { return x.sign() >= 0; }),
      where + ": needs one input error per input, none negative");
  return input;
}

}  // namespace swarmcert::check
