#include "lipschitz/checker/values.h"

#include "lipschitz/checker/activation_bounds.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::check {
namespace {

Dyadic largest_absolute(const Dyadic& lower, const Dyadic& upper) {
  const Dyadic a = absolute(lower), b = absolute(upper);
  return a >= b ? a : b;
}
Dyadic count(long n) { return {mpz_class(n), 0}; }

/// Returns `before` plus a bound on the round-off error of a sum of n summands whose absolute values add up to m.
std::optional<Dyadic> rounding_error(long n, const Dyadic& m, const Dyadic& before) {
  constexpr long kMostSummands = 1L << 23;
  if (n > kMostSummands || !(Dyadic(0x1p126) >= m + Dyadic(mpz_class(n), -149))) return std::nullopt;
  const Dyadic nu(mpz_class(n), -24);
  return before + (nu + nu * nu) * m + Dyadic(mpz_class(n), -148);
}

}  // namespace

Intervals layer_intervals(const files::Layer& layer, const Intervals& inputs) {
  const Matrix w(layer.outputs, layer.inputs, layer.weights);
  Intervals result;
  for (int i = 0; i < layer.outputs; ++i) {
    const auto row = static_cast<std::size_t>(i);
    Dyadic lower = layer.biases[row], upper = lower;
    for (int j = 0; j < layer.inputs; ++j) {
      const auto k = static_cast<std::size_t>(j);
      const bool rises = w(i, j).sign() >= 0;
      lower += w(i, j) * (rises ? inputs.lower[k] : inputs.upper[k]);
      upper += w(i, j) * (rises ? inputs.upper[k] : inputs.lower[k]);
    }
    result.lower.push_back(std::move(lower));
    result.upper.push_back(std::move(upper));
  }
  return result;
}

Intervals relu_intervals(Intervals intervals) {
  for (std::vector<Dyadic>* ends : {&intervals.lower, &intervals.upper})
    for (Dyadic& x : *ends)
      if (x.sign() < 0) x = Dyadic();
  return intervals;
}

Intervals activated_intervals(const files::Layer& layer, const Intervals& values) {
  const files::Activation activation = layer.activation;
  // Sorting, maxima and minima are nondecreasing in every entry, so each end is computed separately.
  if (files::function_of(activation).sorts())
    return {files::rearranged(activation, values.lower), files::rearranged(activation, values.upper)};
  Intervals result = values;
  for (std::size_t i = 0; i + static_cast<std::size_t>(layer.kept) < values.lower.size(); ++i) {
    Interval between = values_between(activation, {values.lower[i], values.upper[i]});
    result.lower[i] = std::move(between.lower);
    result.upper[i] = std::move(between.upper);
  }
  return result;
}

Intervals network_intervals(const files::Weights& weights, Intervals inputs) {
  for (std::size_t k = 0; k < weights.layers.size(); ++k) {
    if (k > 0) inputs = activated_intervals(weights.layers[k - 1], inputs);
    inputs = layer_intervals(weights.layers[k], inputs);
  }
  return inputs;
}

Intervals sum_intervals(const std::vector<SumTerm>& terms, std::size_t size) {
  Intervals sum{std::vector<Dyadic>(size), std::vector<Dyadic>(size)};
  for (const SumTerm& term : terms) {
    for (std::size_t i = 0; i < size; ++i) {
      const Dyadic &low = term.values.lower[i], &high = term.values.upper[i];
      sum.lower[i] += count(low.sign() >= 0 ? term.fewest : term.most) * low;
      sum.upper[i] += count(high.sign() >= 0 ? term.most : term.fewest) * high;
    }
  }
  return sum;
}

std::optional<std::vector<Dyadic>> layer_error(const files::Layer& layer, const Intervals& inputs,
                                               const std::vector<Dyadic>& error) {
  std::vector<Dyadic> sizes;
  for (std::size_t k = 0; k < error.size(); ++k)
    sizes.push_back(largest_absolute(inputs.lower[k], inputs.upper[k]) + error[k]);
  const Matrix w(layer.outputs, layer.inputs, layer.weights);
  std::vector<Dyadic> result;
  for (int i = 0; i < layer.outputs; ++i) {
    Dyadic size = absolute(layer.biases[static_cast<std::size_t>(i)]), before;
    for (int j = 0; j < layer.inputs; ++j) {
      const Dyadic factor = absolute(w(i, j));
      size += factor * sizes[static_cast<std::size_t>(j)];
      before += factor * error[static_cast<std::size_t>(j)];
    }
    const std::optional<Dyadic> total = rounding_error(layer.inputs + 1L, size, before);
    if (!total) return std::nullopt;
    result.push_back(*total);
  }
  return result;
}

std::optional<std::vector<Dyadic>> sum_error(const std::vector<SumTerm>& terms, std::size_t size) {
  std::vector<Dyadic> result;
  for (std::size_t i = 0; i < size; ++i) {
    long summands = 1;
    Dyadic sizes, before;
    for (const SumTerm& term : terms) {
      summands += term.most;
      const Dyadic largest = largest_absolute(term.values.lower[i], term.values.upper[i]) + term.error[i];
      sizes += count(term.most) * largest;
      before += count(term.most) * term.error[i];
    }
    const std::optional<Dyadic> total = rounding_error(summands, sizes, before);
    if (!total) return std::nullopt;
    result.push_back(*total);
  }
  return result;
}

Dyadic largest_square(const Intervals& intervals) {
  Dyadic sum;
  for (std::size_t i = 0; i < intervals.lower.size(); ++i) {
    const Dyadic largest = largest_absolute(intervals.lower[i], intervals.upper[i]);
    sum += largest * largest;
  }
  return sum;
}

Dyadic silent_step_square(const files::Network& network, const files::FunctionId& function,
                          const std::function<Intervals(const files::FunctionId& part)>& inputs) {
  Dyadic largest;
  const auto networks = files::parts(network);
  for (std::vector<files::FunctionId> parts : files::beside_silent(network, function)) {
    if (networks.count(files::FunctionId::ground_phi()) == 1)
      parts.push_back(files::FunctionId::ground_phi());
    const files::Weights& rho = *networks.at(function.output_part());
    std::vector<SumTerm> terms;
    for (const files::FunctionId& part : parts)
      terms.push_back({{network_intervals(*networks.at(part), inputs(part)), {}}, 1, 1});
    const Intervals sum = sum_intervals(terms, static_cast<std::size_t>(rho.inputs()));
    largest = larger(largest, largest_square(network_intervals(rho, sum)));
  }
  return largest;
}

const Dyadic& larger(const Dyadic& a, const Dyadic& b) { return a >= b ? a : b; }

Dyadic square(const std::vector<Dyadic>& values) {
  Dyadic sum;
  for (const Dyadic& x : values) sum += x * x;
  return sum;
}

}  // namespace swarmcert::check
