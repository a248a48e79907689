#include "lipschitz/checker/box_states.h"

#include <algorithm>
#include <cmath>

#include "lipschitz/checker/products.h"
#include "nn/base/doubles.h"

namespace swarmcert::check {
namespace {

using Row = std::vector<double>;

constexpr double kTiny = 0x1p-900;  ///< covers underflow in sums of at most 10^6 terms

/// Upper bounds on (signed) values of neurons, one per row, as linear forms in some layer's y or h, or in x.
struct Forms {
  int count = 0, width = 0;
  Row coefficients;        ///< [count x width]
  Row constant, absolute;  ///< sums of the constants' terms and of their absolute values
  Row error;               ///< bounds on the error due to rounding the coefficients
  double terms = 0;        ///< largest number of terms of a `constant`
  double* at(int r) { return &coefficients[static_cast<std::size_t>(r) * static_cast<std::size_t>(width)]; }
  const double* at(int r) const {
    return &coefficients[static_cast<std::size_t>(r) * static_cast<std::size_t>(width)];
  }
};

/// Adds upper bounds on the other terms that enter the layer's sums.
void add_entering(Forms& forms, int r, const HiddenLayer& layer) {
  if (layer.least.empty()) return;
  const auto row = static_cast<std::size_t>(r);
  const double* const c = forms.at(r);
  for (std::size_t i = 0; i < layer.least.size(); ++i) {
    const double most = c[i] * (c[i] > 0 ? layer.most : layer.least)[i];
    forms.constant[row] += most;
    forms.absolute[row] += std::abs(most);
  }
}

/// Substitutes y = W h + b, which turns forms in y into forms in h. `used`: outputs with a coefficient in any form.
void through_layer(Forms& forms, const HiddenLayer& layer, const Row& term, const std::vector<int>& used) {
  Row next(static_cast<std::size_t>(forms.count) * static_cast<std::size_t>(layer.inputs), 0.0);
  add_product(next.data(), layer.inputs, forms.count, layer.inputs, {forms.coefficients.data(), forms.width},
              {layer.weights.data(), layer.inputs}, used);
  for (int r = 0; r < forms.count; ++r) {
    const auto row = static_cast<std::size_t>(r);
    const FormSums sums = form_sums(forms.at(r), layer.biases.data(), term.data(), layer.outputs);
    forms.constant[row] += sums.constant;
    forms.absolute[row] += sums.absolute;
    forms.error[row] += 1.01 * (layer.outputs + 2) * kUnit * sums.weighted;
    add_entering(forms, r, layer);
  }
  forms.terms += 2.0 * layer.outputs;
  forms.width = layer.inputs;
  forms.coefficients = std::move(next);
}

/// The lines that replace relu(y): `above` y + `offset` if the coefficient of a form is positive, `below` y if it is
/// negative.
struct Relaxation {
  Row above, below, offset, error;  ///< `error`: round-off of above times a coefficient, per unit of it
  std::vector<int> used;            ///< neurons that are not off

  /// @param lower_slopes lower slopes of undecided neurons; null: chosen from their ranges.
  Relaxation(const HiddenLayer& layer, const NeuronBounds& bounds, std::size_t k,
             const Row* lower_slopes = nullptr) {
    const std::size_t size = bounds.lower[k].size();
    above.assign(size, 1);
    below.assign(size, 1);
    offset.assign(size, 0);
    error.assign(size, 0);
    for (std::size_t i = 0; i < size; ++i) {
      const double l = bounds.lower[k][i], u = bounds.upper[k][i];
      const bool is_off = layer.has_relu(i) && !(l >= 0) && u <= 0;
      if (is_off) above[i] = below[i] = 0;
      if (!is_off) used.push_back(static_cast<int>(i));
      if (is_off || l >= 0 || !layer.has_relu(i)) continue;
      above[i] = bounds.slope[k][i];
      below[i] = lower_slopes != nullptr ? (*lower_slopes)[i] : u > -l ? 1 : 0;
      offset[i] = bounds.offset[k][i];
      error[i] = 4 * kUnit * above[i] * std::max(u, -l);
    }
  }
};

/// Substitutes h = relu(y).
void through_relu(Forms& forms, const Relaxation& relu) {
  for (int r = 0; r < forms.count; ++r) {
    const auto row = static_cast<std::size_t>(r);
    const RelaxedSums sums = relax(forms.at(r), forms.width, relu.above.data(), relu.below.data(),
                                   relu.offset.data(), relu.error.data());
    forms.constant[row] += sums.offsets;
    forms.absolute[row] += sums.offsets;
    forms.error[row] += 1.001 * sums.errors;
  }
  forms.terms += forms.width;
}

/// Returns the largest value of a form over the box, rounded up.
double largest(const Forms& forms, int r, const Row& lower, const Row& upper) {
  const auto row = static_cast<std::size_t>(r);
  double value = forms.constant[row], absolute = forms.absolute[row];
  for (std::size_t j = 0; j < lower.size(); ++j) {
    const double c = forms.at(r)[j];
    if (!std::isfinite(c)) return kInfinity;  // in earlier layers, `error` is then infinite or NaN
    value += c * (c > 0 ? upper[j] : lower[j]);
    absolute += std::abs(c) * std::max(std::abs(lower[j]), std::abs(upper[j]));
  }
  const double terms = forms.terms + 2.0 * static_cast<double>(lower.size()) + 16;
  const double result = up(value + (2 * terms * kUnit * absolute + 1.01 * forms.error[row] + kTiny));
  return std::isnan(result) ? kInfinity : result;
}

/// An output of a layer, with sign 1 or -1.
struct SignedOutput {
  int output;
  double sign;
};

/// Returns upper bounds on the signed outputs of layer `top` as forms in x.
/// @param lower_slopes lower slopes of the previous layers, if not null.
Forms above(const std::vector<HiddenLayer>& layers, const NeuronBounds& bounds, std::size_t top,
            const std::vector<SignedOutput>& outputs, const std::vector<Row>* lower_slopes = nullptr) {
  const HiddenLayer& layer = layers[top];
  Forms forms;
  forms.count = static_cast<int>(outputs.size());
  forms.width = layer.inputs;
  forms.terms = 2;
  forms.error.assign(outputs.size(), 0.0);
  forms.absolute.assign(outputs.size(), 0.0);
  forms.constant.assign(outputs.size(), 0.0);
  forms.coefficients.resize(outputs.size() * static_cast<std::size_t>(layer.inputs));
  for (std::size_t r = 0; r < outputs.size(); ++r) {  // the row of the layer itself is exact
    const double sign = outputs[r].sign;
    const auto i = static_cast<std::size_t>(outputs[r].output);
    const double* const row = &layer.weights[i * static_cast<std::size_t>(layer.inputs)];
    double* const own = forms.at(static_cast<int>(r));
    for (int j = 0; j < layer.inputs; ++j) own[j] = sign * row[j];
    forms.constant[r] = sign * layer.biases[i];
    forms.absolute[r] = std::abs(layer.biases[i]);
    if (layer.least.empty()) continue;
    const double most = sign * (sign > 0 ? layer.most : layer.least)[i];
    forms.constant[r] += most;
    forms.absolute[r] += std::abs(most);
  }
  for (std::size_t j = top; j-- > 0;) {
    const Relaxation relu(layers[j], bounds, j, lower_slopes != nullptr ? &(*lower_slopes)[j] : nullptr);
    through_relu(forms, relu);
    through_layer(forms, layers[j], bounds.terms[j], relu.used);
  }
  return forms;
}

/// Returns 1 for outputs of the first `top` layers that are on at the corner, else 0. Computed without error bounds,
/// because any slopes are valid.
std::vector<Row> slopes_at(const std::vector<HiddenLayer>& layers, std::size_t top, const Row& lower,
                           const Row& upper, std::uint64_t corner) {
  Row h;
  for (std::size_t k = 0; k < lower.size(); ++k) h.push_back((corner >> k & 1) != 0 ? upper[k] : lower[k]);
  std::vector<Row> slopes;
  for (std::size_t k = 0; k < top; ++k) {
    const HiddenLayer& layer = layers[k];
    Row next;
    slopes.emplace_back();
    for (std::size_t i = 0; i < static_cast<std::size_t>(layer.outputs); ++i) {
      const double bias = layer.biases[i] + (layer.least.empty() ? 0 : (layer.least[i] + layer.most[i]) / 2);
      double y = bias, size = std::abs(bias);
      for (std::size_t j = 0; j < h.size(); ++j) {
        const double term = layer.weights[i * h.size() + j] * h[j];
        y += term;
        size += std::abs(term);
      }
      slopes.back().push_back(y > kOnAtCorner * size ? 1 : 0);
      next.push_back(layer.has_relu(i) ? std::max(0.0, y) : y);
    }
    h = std::move(next);
  }
  return slopes;
}

/// Returns whether the decision for an output of layer k holds; if so, stores it in `bounds`.
bool decide(NeuronBounds& bounds, const std::vector<HiddenLayer>& layers, const Row& lower, const Row& upper,
            std::size_t k, std::size_t output, const Decision& decision) {
  double &l = bounds.lower[k][output], &u = bounds.upper[k][output];
  if (!layers[k].has_relu(output) || lower.size() > static_cast<std::size_t>(kMostCornerInputs)) return false;
  if (!(l < 0 && u > 0)) return true;
  const std::vector<Row> slopes = slopes_at(layers, k, lower, upper, decision.corner);
  const double sign = decision.is_on ? -1 : 1;
  const double end =
      largest(above(layers, bounds, k, {{static_cast<int>(output), sign}}, &slopes), 0, lower, upper);
  if (!(end <= 0)) return false;
  (decision.is_on ? l : u) = sign * end;
  return true;
}

/// Multiplies forms by w >= 0.
void scale(Forms& forms, double w) {
  for (double& c : forms.coefficients) c *= w;
  forms.constant[0] *= w;
  forms.absolute[0] *= w;
  forms.error[0] *= w;
}

}  // namespace

double largest_sum(const std::vector<HiddenLayer>& layers, const NeuronBounds& bounds, const Row& lower,
                   const Row& upper, const WeightedNeuron& first, const WeightedNeuron& second) {
  Forms sum = above(layers, bounds, first.layer, {{first.output, first.weight < 0 ? -1.0 : 1.0}});
  Forms other = above(layers, bounds, second.layer, {{second.output, second.weight < 0 ? -1.0 : 1.0}});
  scale(sum, std::abs(first.weight));
  scale(other, std::abs(second.weight));
  double rounding = 0;  // round-off of the products and sums of coefficients, times the inputs
  for (std::size_t j = 0; j < lower.size(); ++j) {
    rounding += (std::abs(sum.coefficients[j]) + std::abs(other.coefficients[j])) *
                std::max(std::abs(lower[j]), std::abs(upper[j]));
    sum.coefficients[j] += other.coefficients[j];
  }
  sum.constant[0] += other.constant[0];
  sum.absolute[0] += other.absolute[0];
  sum.error[0] += other.error[0] + 8 * kUnit * (rounding + sum.absolute[0]) + kTiny;
  sum.error[0] *= 1 + 1e-6;  // for round-off of the error terms themselves
  sum.terms += other.terms;
  return largest(sum, 0, lower, upper);
}

NeuronBounds neuron_bounds(const std::vector<HiddenLayer>& layers, const Row& lower, const Row& upper,
                           const NeuronBounds* around) {
  NeuronBounds bounds;
  add_layers(bounds, layers, lower, upper, around);
  return bounds;
}

bool add_layers(NeuronBounds& bounds, const std::vector<HiddenLayer>& layers, const Row& lower,
                const Row& upper, const NeuronBounds* around, const std::vector<Decision>& decisions) {
  std::vector<Row>& term = bounds.terms;
  bool all_hold = true;
  std::size_t first = 0;  // index of the layer's first output over all layers
  for (std::size_t k = 0; k < bounds.lower.size(); ++k) first += bounds.lower[k].size();
  for (std::size_t k = bounds.lower.size(); k < layers.size(); ++k) {
    const HiddenLayer& layer = layers[k];
    Row magnitude;  // largest absolute values of the layer's input
    for (std::size_t j = 0; j < static_cast<std::size_t>(layer.inputs); ++j) {
      const double l = k == 0 ? lower[j] : bounds.lower[k - 1][j],
                   u = k == 0 ? upper[j] : bounds.upper[k - 1][j];
      magnitude.push_back(k > 0 && layers[k - 1].has_relu(j) ? std::max(0.0, u)
                                                             : std::max(std::abs(l), std::abs(u)));
    }
    const auto rows = static_cast<std::size_t>(layer.outputs);
    term.emplace_back(rows);
    for (std::size_t i = 0; i < rows; ++i) {
      double sum = std::abs(layer.biases[i]);
      if (!layer.least.empty()) sum += std::max(std::abs(layer.least[i]), std::abs(layer.most[i]));
      for (std::size_t j = 0; j < magnitude.size(); ++j)
        sum += std::abs(layer.weights[i * magnitude.size() + j]) * magnitude[j];
      term.back()[i] = (1 + 2 * kUnit * static_cast<double>(magnitude.size() + 4)) * sum + kTiny;
      if (!(term.back()[i] <= kLargestInput)) term.back()[i] = kInfinity;
    }
    bounds.lower.push_back(around != nullptr ? around->lower[k] : Row(rows, -kInfinity));
    bounds.upper.push_back(around != nullptr ? around->upper[k] : Row(rows, kInfinity));
    bounds.slope.emplace_back(rows, 0.0);
    bounds.offset.emplace_back(rows, 0.0);
    std::vector<SignedOutput> open;
    for (std::size_t i = 0; i < rows; ++i) {
      if (layer.has_relu(i) && !(bounds.lower[k][i] < 0 && bounds.upper[k][i] > 0)) continue;
      for (const double sign : {1.0, -1.0}) open.push_back({static_cast<int>(i), sign});
    }
    const Forms forms = above(layers, bounds, k, open);
    for (std::size_t n = 0; n < open.size(); ++n) {
      const auto i = static_cast<std::size_t>(open[n].output);
      const double end = largest(forms, static_cast<int>(n), lower, upper);
      if (open[n].sign > 0) bounds.upper[k][i] = std::min(bounds.upper[k][i], end);
      if (open[n].sign < 0) bounds.lower[k][i] = std::max(bounds.lower[k][i], -end);
    }
    for (const Decision& decision : decisions)
      if (decision.neuron >= first && decision.neuron < first + rows &&
          !decide(bounds, layers, lower, upper, k, decision.neuron - first, decision))
        all_hold = false;
    first += rows;
    for (std::size_t i = 0; i < rows; ++i) {
      const double l = bounds.lower[k][i], u = bounds.upper[k][i];
      if (!layer.has_relu(i) || !(l < 0 && u > 0)) continue;
      const double slope = std::min(1.0, u / (u - l));
      bounds.slope[k][i] = slope;
      bounds.offset[k][i] = std::max({0.0, up(u - down(slope * u)), up(-slope * l)});
    }
  }
  return all_hold;
}

}  // namespace swarmcert::check
