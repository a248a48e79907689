#include "lipschitz/values/value_bounds.h"

#include <algorithm>
#include <cmath>

#include "lipschitz/base/rounding.h"
#include "lipschitz/checker/centred_form.h"
#include "lipschitz/checker/values.h"
#include "lipschitz/values/float32_error.h"
#include "lipschitz/values/range.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::lipschitz {
namespace {

using check::Bounded;
using check::Dyadic;
using Row = std::vector<double>;

Row each(const std::vector<Dyadic>& values, double (*rounded)(const Dyadic&)) {
  Row result;
  for (const Dyadic& x : values) result.push_back(rounded(x));
  return result;
}

std::vector<Dyadic> exact_numbers(const Row& values) { return {values.begin(), values.end()}; }

bool all_finite(const Row& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

/// Follows the values of one function through its layers, as the checker will.
class Values {
 public:
  Values(const files::Network& network, Domain domain, const ValueOptions& options)
      : network_(network), parts_(files::parts(network)), domain_(std::move(domain)), options_(options) {}

  std::optional<CertifiedValues> of(const files::FunctionId& function, int neighbours,
                                    const std::map<std::string, double>& rho_bound) const {
    CertifiedValues found;
    found.function = function;
    found.neighbours = neighbours;
    found.in_clamp = options_.in_clamp;
    const std::vector<files::FunctionId> names = function.parts();
    std::vector<files::FunctionId> inputs = {names[0]};
    if (names.size() == 2 && parts_.count(files::FunctionId::ground_phi()) == 1)
      inputs.emplace_back(files::FunctionId::ground_phi());
    Bounded values;
    std::array<std::vector<Dyadic>, 2> input_error;  // of the network whose output is the function's
    std::vector<check::SumTerm> terms;
    for (const files::FunctionId& name : inputs) {
      const Box& box = domain_.at(name);
      values = {{exact_numbers(box.lower), exact_numbers(box.upper)}};
      if (options_.float32) {
        found.input_error[name] = input_errors(box, options_.input_step);
        const std::vector<Dyadic> error = exact_numbers(found.input_error[name]);
        values.error = {error, error};
      }
      input_error = values.error;
      if (!through_layers(name, values, found)) return std::nullopt;
      const bool is_ground = name.is_ground_phi();
      terms.push_back({values, is_ground ? 1 : 0, is_ground ? 1 : neighbours});
    }
    if (names.size() == 2) {
      const auto size = static_cast<std::size_t>(parts_.at(names[1])->inputs());
      const double slope = rho_bound.at(names[1].kind());
      const Dyadic square = Dyadic(slope) * slope * check::largest_square(terms.front().values);
      found.jump = sqrt_up(check::larger(square, check::silent_step_square(network_, function, boxes())));
      found.sum = rounded(check::through_sum(terms, size), values);
      input_error = values.error;
      if (!found.sum || !std::isfinite(*found.jump) || !through_layers(names[1], values, found))
        return std::nullopt;
    }
    state_ends(found);
    if (!options_.float32) return found;
    for (const check::Summation summation : {check::kAnyOrder, check::kInOrder}) {
      const double bound = rounded_up(
          check::error_norm(values, input_error[summation], slope(function.output_part()), summation));
      if (!std::isfinite(bound)) return std::nullopt;
      found.float32_error[summation] = bound;
    }
    return found;
  }

 private:
  std::function<check::Intervals(const files::FunctionId&)> boxes() const {
    return [this](const files::FunctionId& part) {
      const Box& box = domain_.at(part);
      return check::Intervals{exact_numbers(box.lower), exact_numbers(box.upper)};
    };
  }

  void state_ends(CertifiedValues& found) const {
    const VectorBounds& last = found.layers.at(found.function.output_part()).back();
    found.lower = last.lower;
    found.upper = last.upper;
    const long silent = files::silent_up_to(network_, found.function, found.neighbours);
    for (std::size_t i = 0; silent > 0 && i < found.lower.size(); ++i) {
      const bool is_always = silent == found.neighbours + 1;
      found.lower[i] = is_always ? 0 : std::min(0.0, found.lower[i]);
      found.upper[i] = is_always ? 0 : std::max(0.0, found.upper[i]);
    }
  }

  /// As the checker takes it: CertificateChecker::unclamped_slope().
  Dyadic slope(const files::FunctionId& part) const {
    const auto bound = options_.slopes.find(part);
    if (bound != options_.slopes.end() && !(network_.clamp && files::is_clamped(part))) return bound->second;
    Dyadic product = 1.0;
    for (const double norm : options_.norms.at(part)) product = product * norm;
    return product;
  }

  /// Rounds outwards what the checker computes, and makes it the values from here on. Nothing where it is not finite.
  std::optional<VectorBounds> rounded(const std::optional<Bounded>& exact, Bounded& values) const {
    if (!exact) return std::nullopt;
    VectorBounds result{each(exact->values.lower, rounded_down), each(exact->values.upper, rounded_up), {}};
    bool is_finite = all_finite(result.lower) && all_finite(result.upper);
    for (const check::Summation summation : {check::kAnyOrder, check::kInOrder}) {
      result.error[summation] = each(exact->error[summation], rounded_up);
      is_finite = is_finite && all_finite(result.error[summation]);
    }
    if (!is_finite) return std::nullopt;
    values = {{exact_numbers(result.lower), exact_numbers(result.upper)}, {}, exact->added};
    for (const check::Summation summation : {check::kAnyOrder, check::kInOrder})
      values.error[summation] = exact_numbers(result.error[summation]);
    return result;
  }

  bool through_layers(const files::FunctionId& name, Bounded& values, CertifiedValues& found) const {
    std::vector<VectorBounds>& layers = found.layers[name];
    if (!parts_.at(name)->is_relu()) {
      for (const check::Intervals& exact : check::layers_on_box(*parts_.at(name), values.values)) {
        const std::optional<VectorBounds> bounds = rounded(Bounded{exact}, values);
        if (!bounds) return false;
        layers.push_back(*bounds);
      }
      return true;
    }
    const std::vector<files::Layer>& of_network = parts_.at(name)->layers;
    for (std::size_t k = 0; k < of_network.size(); ++k) {
      if (k > 0) values.values = check::relu_intervals(std::move(values.values));
      const double norm = options_.float32 ? options_.norms.at(name).at(k) : 0;
      const std::optional<VectorBounds> bounds =
          rounded(check::through_layer(of_network[k], norm, values), values);
      if (!bounds) return false;
      layers.push_back(*bounds);
    }
    return true;
  }

  const files::Network& network_;
  files::Parts parts_;
  Domain domain_;
  ValueOptions options_;
};

}  // namespace

std::vector<CertifiedValues> certified_values(const files::Network& network, const Domain& domain,
                                              const std::map<std::string, double>& rho_bound,
                                              const ValueOptions& options,
                                              const std::optional<files::FunctionId>& only) {
  const Domain inner = clamped(network, domain);
  ValueOptions exact_only = options;
  exact_only.float32 = false;
  const Values values(network, inner, options), without_float32(network, inner, exact_only);
  std::vector<CertifiedValues> result;
  for (const files::FunctionId& function : value_functions(network)) {
    if (only && function != *only) continue;
    const bool is_set = function.is_set();
    for (int n = is_set ? 1 : 0; n <= (is_set ? options.neighbours : 0); ++n) {
      std::optional<CertifiedValues> found = values.of(function, n, rho_bound);
      if (!found && options.float32) found = without_float32.of(function, n, rho_bound);
      if (found) result.push_back(std::move(*found));
    }
  }
  return result;
}

}  // namespace swarmcert::lipschitz
