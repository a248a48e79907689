#include "lipschitz/checker/values.h"

#include <utility>

#include "lipschitz/checker/activation_bounds.h"
#include "lipschitz/checker/fixed_point.h"
#include "nn/weights/compositions.h"
#include "nn/weights/functions.h"

namespace swarmcert::check {
namespace {

Dyadic largest_absolute(const Dyadic& lower, const Dyadic& upper) {
  const Dyadic a = absolute(lower), b = absolute(upper);
  return a >= b ? a : b;
}
Dyadic count(long n) { return {mpz_class(n), 0}; }

Dyadic square(const std::vector<Dyadic>& values) {
  Dyadic sum;
  for (const Dyadic& x : values) sum += x * x;
  return sum;
}
/// Multiples of 2^kErrorUnit, on which errors are rounded up. Far below the least float, 2^-149.
constexpr long kErrorUnit = -160;
/// At least the square root of x >= 0.
Dyadic root_above(const Dyadic& x) {
  const Dyadic scaled = ceil_to(x * Dyadic(1, -2 * kErrorUnit), 0);
  const mpz_class units = scaled.mantissa << static_cast<mp_bitcnt_t>(scaled.exponent);
  return {sqrt(units) + 1, kErrorUnit};
}
const Dyadic kLargestFloat = 0x1p126;  // with room for what is off

/// Of a sum of n summands whose absolute values add up to m, in any order.
std::optional<Dyadic> any_rounding(long n, const Dyadic& m) {
  constexpr long kMostSummands = 1L << 23;
  if (n > kMostSummands || !(kLargestFloat >= m + Dyadic(mpz_class(n), -149))) return std::nullopt;
  const Dyadic nu(mpz_class(n), -24);
  return (nu + nu * nu) * m + Dyadic(mpz_class(n), -148);
}

/// Of one operation whose exact result is at most `size`.
Dyadic one_rounding(const Dyadic& size) {
  const Dyadic least(1, -150);
  if (size.sign() <= 0) return least;
  const auto bits = static_cast<long>(mpz_sizeinbase(size.mantissa.get_mpz_t(), 2));
  return Dyadic(1, size.exponent + bits - 25) + least;
}

/// Of the sum of the bias and the products of row i with inputs that lie in `inputs`, in order.
std::optional<Dyadic> ordered_rounding(const Matrix& w, int i, const Dyadic& bias, const Intervals& inputs) {
  Dyadic low = bias, high = bias, off;
  for (int j = 0; j < w.cols; ++j) {
    const auto k = static_cast<std::size_t>(j);
    Dyadic least = w(i, j) * inputs.lower[k], most = w(i, j) * inputs.upper[k];
    if (w(i, j).sign() < 0) std::swap(least, most);
    low += least;
    high += most;
    const Dyadic product = largest_absolute(least, most);
    off += one_rounding(product);
    const Dyadic size = largest_absolute(low, high) + off;
    if (!(kLargestFloat >= product + size)) return std::nullopt;
    off = ceil_to(off + one_rounding(size), kErrorUnit);
  }
  return off;
}

/// Bounds on what the float32 evaluation of the layer adds to the errors of its inputs, entry by entry.
std::optional<std::vector<Dyadic>> layer_rounding(const files::Layer& layer, const Matrix& w,
                                                  const Intervals& inputs, const std::vector<Dyadic>& error,
                                                  Summation summation) {
  Intervals computed = inputs;
  std::vector<Dyadic> sizes;
  for (std::size_t k = 0; k < error.size(); ++k) {
    sizes.push_back(largest_absolute(inputs.lower[k], inputs.upper[k]) + error[k]);
    computed.lower[k] += -error[k];
    computed.upper[k] += error[k];
  }
  std::vector<Dyadic> result;
  for (int i = 0; i < layer.outputs; ++i) {
    const Dyadic bias = layer.biases[static_cast<std::size_t>(i)];
    Dyadic size = absolute(bias);
    for (int j = 0; summation == kAnyOrder && j < layer.inputs; ++j)
      size += absolute(w(i, j)) * sizes[static_cast<std::size_t>(j)];
    const std::optional<Dyadic> one = summation == kAnyOrder ? any_rounding(layer.inputs + 1L, size)
                                                             : ordered_rounding(w, i, bias, computed);
    if (!one) return std::nullopt;
    result.push_back(*one);
  }
  return result;
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

std::optional<Bounded> through_layer(const files::Layer& layer, const Dyadic& norm, const Bounded& input) {
  Bounded result{layer_intervals(layer, input.values)};
  if (!input.has_error()) return result;
  const Matrix w(layer.outputs, layer.inputs, layer.weights);
  for (const Summation summation : {kAnyOrder, kInOrder}) {
    const std::vector<Dyadic>& before = input.error[summation];
    const auto made = layer_rounding(layer, w, input.values, before, summation);
    if (!made) return std::nullopt;
    std::vector<Dyadic> error = *made;
    for (int i = 0; i < layer.outputs; ++i)
      for (int j = 0; j < layer.inputs; ++j)
        error[static_cast<std::size_t>(i)] += absolute(w(i, j)) * before[static_cast<std::size_t>(j)];
    result.error[summation] = std::move(error);
    result.added[summation] = norm * input.added[summation] + root_above(square(*made));
  }
  return result;
}

std::optional<Bounded> through_sum(const std::vector<SumTerm>& terms, std::size_t size) {
  Bounded result{sum_intervals(terms, size)};
  if (!terms.front().has_error()) return result;
  for (const Summation summation : {kAnyOrder, kInOrder}) {
    for (std::size_t i = 0; i < size; ++i) {
      long summands = 1;
      Dyadic sizes, before;
      for (const SumTerm& term : terms) {
        const Dyadic& error = term.error[summation][i];
        summands += term.most;
        sizes += count(term.most) * (largest_absolute(term.values.lower[i], term.values.upper[i]) + error);
        before += count(term.most) * error;
      }
      const std::optional<Dyadic> rounding = any_rounding(summands, sizes);
      if (!rounding) return std::nullopt;
      result.error[summation].push_back(before + *rounding);
    }
  }
  return result;
}

Dyadic error_norm(const Bounded& output, const std::vector<Dyadic>& input_error, const Dyadic& slope,
                  Summation summation) {
  const Dyadic by_entry = root_above(square(output.error[summation]));
  const Dyadic by_norm = slope * root_above(square(input_error)) + output.added[summation];
  return by_entry < by_norm ? by_entry : by_norm;
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
      terms.push_back({{network_intervals(*networks.at(part), inputs(part))}, 1, 1});
    const Intervals sum = sum_intervals(terms, static_cast<std::size_t>(rho.inputs()));
    largest = larger(largest, largest_square(network_intervals(rho, sum)));
  }
  return largest;
}

const Dyadic& larger(const Dyadic& a, const Dyadic& b) { return a >= b ? a : b; }

}  // namespace swarmcert::check
