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
  files::require_keys(json, {"lower", "upper", "error", "error_in_order"}, where);
  Bounded result{{exact(hex_floats_in(json["lower"])), exact(hex_floats_in(json["upper"]))}};
  bool fits = result.values.lower.size() == size && result.values.upper.size() == size;
  for (const Summation summation : {kAnyOrder, kInOrder}) {
    const files::Json& error = json[summation == kAnyOrder ? "error" : "error_in_order"];
    require(error.is_null() != with_error,
            where + ": an error must be given if there are input errors, and only then");
    if (with_error) result.error[summation] = exact(hex_floats_in(error));
    fits = fits && result.error[summation].size() == (with_error ? size : 0);
  }
  require(fits, where + ": needs one number per output");
  return result;
}

/// @param found what was computed; nothing where float32 might overflow.
void require_encloses(const Bounded& stated, const std::optional<Bounded>& found, const std::string& where) {
  require(found.has_value(), where + ": claims less than the float32 error");
  require(
      at_most(stated.values.lower, found->values.lower) && at_most(found->values.upper, stated.values.upper),
      where + ": the values leave the bounds");
  for (const Summation summation : {kAnyOrder, kInOrder})
    require(at_most(found->error[summation], stated.error[summation]),
            where + ": claims less than the float32 error");
}

/// Verifies the bounds stated for every layer of a network with activations other than ReLU.
void check_enclosed_layers(const files::Weights& weights, const files::Json& json, const Intervals& input,
                           const std::string& where) {
  const std::vector<Intervals> found = layers_on_box(weights, input);
  for (std::size_t k = 0; k < found.size(); ++k)
    require_encloses(stated(json[k], found[k].lower.size(), false, where), Bounded{found[k]}, where);
}

/// Verifies the bounds stated for every layer of a network; returns those of the last layer.
/// @param norms bounds of the layers' spectral norms.
Bounded check_layers(const files::Weights& weights, const std::vector<Dyadic>& norms, const files::Json& json,
                     Bounded input, const std::string& where) {
  require(json.is_array() && json.size() == weights.layers.size(), where + ": needs one entry per layer");
  const bool with_error = input.has_error();
  if (!weights.is_relu()) {
    require(!with_error, where + ": a float32 error of a network with activations other than ReLU");
    check_enclosed_layers(weights, json, input.values, where);
    return stated(json.back(), static_cast<std::size_t>(weights.outputs()), false, where);
  }
  for (std::size_t k = 0; k < weights.layers.size(); ++k) {
    const files::Layer& layer = weights.layers[k];
    if (k > 0) input.values = relu_intervals(std::move(input.values));
    Bounded output = stated(json[k], static_cast<std::size_t>(layer.outputs), with_error, where);
    const std::optional<Bounded> found = through_layer(layer, norms.at(k), input);
    require_encloses(output, found, where);
    output.added = found->added;
    input = std::move(output);
  }
  return input;
}

}  // namespace

void CertificateChecker::check_values(const Json& entry) {
  files::require_keys(entry,
                      {"function", "neighbours", "domain", "input_error", "networks", "sum", "lower", "upper",
                       "jump", "jump_hex", "float32_error", "float32_error_hex", "float32_error_in_order",
                       "float32_error_in_order_hex"},
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
  std::array<std::vector<Dyadic>, 2> input_error;  // of the network whose output is the result
  std::vector<SumTerm> terms;
  for (const files::FunctionId& part : inputs) {
    Bounded input = values_input(entry, part, where);
    input_error = input.error;
    result = check_layers(*parts_.at(part), norms_.at(part), entry["networks"].at(part.name()),
                          std::move(input), where + ": " + part.name());
    const bool is_ground = part.is_ground_phi();
    terms.push_back({result, is_ground ? 1 : 0, is_ground ? 1 : neighbours});
  }
  require(entry["sum"].is_null() != is_set,
          where + ": a sum must be given for set functions, and only for them");
  if (is_set) {
    const files::Weights& rho = *parts_.at(names[1]);
    require(!with_error || rho.precision == files::Precision::kFloat32, where + kNotFloat32);
    const auto size = static_cast<std::size_t>(rho.inputs());
    Bounded sum = stated(entry["sum"], size, with_error, where + ": sum");
    require_encloses(sum, through_sum(terms, size), where + ": sum");
    input_error = sum.error;
    result = check_layers(rho, norms_.at(names[1]), entry["networks"].at(names[1].name()), std::move(sum),
                          where + ": " + names[1].name());
  }
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
  check_float32_error(entry, result, input_error, where);
  ++values_;
}

void CertificateChecker::check_float32_error(const Json& entry, const Bounded& output,
                                             const std::array<std::vector<Dyadic>, 2>& input_error,
                                             const std::string& where) const {
  const files::FunctionId part = files::FunctionId(entry["function"].get<std::string>()).output_part();
  for (const Summation summation : {kAnyOrder, kInOrder}) {
    const std::string name = summation == kAnyOrder ? "float32_error" : "float32_error_in_order";
    const Json &decimal = entry[name], &hex = entry[name + "_hex"];
    require(decimal.is_null() != output.has_error() && hex.is_null() != output.has_error(),
            where + ": a float32 error must be given if there are input errors, and only then");
    if (!output.has_error()) continue;
    require(Dyadic(number(decimal, hex, where + " " + name)) >=
                error_norm(output, input_error[summation], unclamped_slope(part), summation),
            where + ": claims less than the float32 error");
  }
}

Dyadic CertificateChecker::unclamped_slope(const files::FunctionId& part) const {
  const auto bound = proved_.find(key(part, "all", {}));
  const bool is_clamped = network_.clamp && files::is_clamped(part);
  if (bound != proved_.end() && local_.count(bound->first) == 0 && !is_clamped) return bound->second;
  Dyadic product = 1.0;
  for (const Dyadic& norm : norms_.at(part)) product = product * norm;
  return product;
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
  Bounded input{values_box(entry, part, where)};
  if (entry["input_error"].is_null()) return input;
  require(parts_.at(part)->precision == files::Precision::kFloat32, where + kNotFloat32);
  const std::vector<Dyadic> error = exact(files::parse_hex_floats(entry["input_error"].at(part.name())));
  require(error.size() == input.values.lower.size() &&
              std::all_of(error.begin(), error.end(), [](const Dyadic& x) { return x.sign() >= 0; }),
          where + ": needs one input error per input, none negative");
  input.error = {error, error};
  return input;
}

}  // namespace swarmcert::check
