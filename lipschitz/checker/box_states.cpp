#include "lipschitz/checker/box_states.h"

#include <algorithm>
#include <cmath>

#include "nn/files/doubles.h"

namespace swarmcert::check {
namespace {

using Row = std::vector<double>;

constexpr double kTiny = 0x1p-900;  ///< covers what underflow may cost in sums of at most 10^6 terms

/// An upper bound on one neuron's (signed) value, as a linear form in some layer's y or in x.
struct Form {
  Row coefficients;
  double constant = 0, absolute = 0;  ///< sum of the constants' terms, and of their absolute values
  double error = 0;                   ///< what rounding the coefficients may have cost
  long terms = 0;                     ///< of `constant`
};

/// out += a p, then b q, d r and e s.
void add_four(double* out, int size, const double* p, const double* q, const double* r, const double* s,
              double a, double b, double d, double e) {
  for (int j = 0; j < size; ++j) out[j] = (((out[j] + a * p[j]) + b * q[j]) + d * r[j]) + e * s[j];
}

/// Sum of c_i times row i of W over `rows`, four rows at a time: added one after the other as in a plain loop, but with
/// fewer trips to memory.
Row combined(const Row& c, const HiddenLayer& layer, const std::vector<int>& rows) {
  Row sum(static_cast<std::size_t>(layer.inputs), 0.0);
  double* const out = sum.data();
  const auto row = [&](std::size_t n) {
    return &layer.weights[static_cast<std::size_t>(rows[n]) * static_cast<std::size_t>(layer.inputs)];
  };
  const auto weight = [&](std::size_t n) { return c[static_cast<std::size_t>(rows[n])]; };
  std::size_t n = 0;
  for (; n + 4 <= rows.size(); n += 4) {
    add_four(out, layer.inputs, row(n), row(n + 1), row(n + 2), row(n + 3), weight(n), weight(n + 1),
             weight(n + 2), weight(n + 3));
  }
  for (; n < rows.size(); ++n) {
    const double* const p = row(n);
    for (int j = 0; j < layer.inputs; ++j) out[j] += weight(n) * p[j];
  }
  return sum;
}

/// Substitutes y = W h + b: the form becomes one in h.
void through_layer(Form& form, const HiddenLayer& layer, const Row& term) {
  double error = 0;
  std::vector<int> used;
  for (int i = 0; i < layer.outputs; ++i) {
    const double c = form.coefficients[static_cast<std::size_t>(i)];
    if (c == 0) continue;
    used.push_back(i);
    const double bias = c * layer.biases[static_cast<std::size_t>(i)];
    form.constant += bias;
    form.absolute += std::abs(bias);
    error += std::abs(c) * term[static_cast<std::size_t>(i)];
    ++form.terms;
    if (layer.least.empty()) continue;
    const double most = c * (c > 0 ? layer.most : layer.least)[static_cast<std::size_t>(i)];
    form.constant += most;
    form.absolute += std::abs(most);
    ++form.terms;
  }
  form.error += 1.01 * (layer.outputs + 2) * kUnit * error;
  Row next = combined(form.coefficients, layer, used);
  if (!std::all_of(next.begin(), next.end(), [](double c) { return std::isfinite(c); }))
    form.error = kInfinity;
  form.coefficients = std::move(next);
}

/// Substitutes h = relu(y), l <= y <= u.
void through_relu(Form& form, const HiddenLayer& layer, const NeuronBounds& bounds, std::size_t k) {
  const Row &lower = bounds.lower[k], &upper = bounds.upper[k];
  for (std::size_t i = 0; i < form.coefficients.size(); ++i) {
    double& c = form.coefficients[i];
    const double l = lower[i], u = upper[i];
    if (c == 0 || l >= 0 || !layer.has_relu(i)) continue;
    if (u <= 0) {
      c = 0;
    } else if (c < 0) {
      if (!(u > -l)) c = 0;
    } else {
      const double slope = bounds.slope[k][i], offset = bounds.offset[k][i];
      form.constant += c * offset;
      form.absolute += c * offset;
      ++form.terms;
      c *= slope;
      form.error += 4 * kUnit * c * std::max(u, -l);
    }
  }
}

/// The form's largest value over the box, rounded up.
double largest(const Form& form, const Row& lower, const Row& upper) {
  double value = form.constant, absolute = form.absolute;
  for (std::size_t j = 0; j < form.coefficients.size(); ++j) {
    const double c = form.coefficients[j];
    value += c * (c > 0 ? upper[j] : lower[j]);
    absolute += std::abs(c) * std::max(std::abs(lower[j]), std::abs(upper[j]));
  }
  const double terms =
      static_cast<double>(form.terms) + 2.0 * static_cast<double>(form.coefficients.size()) + 16;
  const double result = next_up(value + (2 * terms * kUnit * absolute + 1.01 * form.error + kTiny));
  return std::isnan(result) ? kInfinity : result;
}

/// The form as one in x, `top` the layer that it is in.
Form down_to_inputs(Form form, std::size_t top, const std::vector<HiddenLayer>& layers,
                    const NeuronBounds& bounds) {
  for (std::size_t j = top + 1; j-- > 0;) {
    through_layer(form, layers[j], bounds.terms[j]);
    if (j > 0) through_relu(form, layers[j - 1], bounds, j - 1);
  }
  return form;
}

/// Above y (sign 1) or -y of one neuron.
Form above(const std::vector<HiddenLayer>& layers, const NeuronBounds& bounds, std::size_t layer,
           std::size_t output, double sign) {
  Form form;
  form.coefficients.assign(static_cast<std::size_t>(layers[layer].outputs), 0.0);
  form.coefficients[output] = sign;
  return down_to_inputs(std::move(form), layer, layers, bounds);
}

/// w times the form, w >= 0.
void scale(Form& form, double w) {
  for (double& c : form.coefficients) c *= w;
  form.constant *= w;
  form.absolute *= w;
  form.error *= w;
}

}  // namespace

double largest_sum(const std::vector<HiddenLayer>& layers, const NeuronBounds& bounds, const Row& lower,
                   const Row& upper, const WeightedNeuron& first, const WeightedNeuron& second) {
  Form sum =
      above(layers, bounds, first.layer, static_cast<std::size_t>(first.output), first.weight < 0 ? -1 : 1);
  Form other = above(layers, bounds, second.layer, static_cast<std::size_t>(second.output),
                     second.weight < 0 ? -1 : 1);
  scale(sum, std::abs(first.weight));
  scale(other, std::abs(second.weight));
  double rounding = 0;  // of products and sums of coefficients, by what they multiply
  for (std::size_t j = 0; j < lower.size(); ++j) {
    rounding += (std::abs(sum.coefficients[j]) + std::abs(other.coefficients[j])) *
                std::max(std::abs(lower[j]), std::abs(upper[j]));
    sum.coefficients[j] += other.coefficients[j];
  }
  sum.constant += other.constant;
  sum.absolute += other.absolute;
  sum.error += other.error + 8 * kUnit * (rounding + sum.absolute) + kTiny;
  sum.error *= 1 + 1e-6;  // roundings of the error terms themselves
  sum.terms += other.terms;
  return largest(sum, lower, upper);
}

NeuronBounds neuron_bounds(const std::vector<HiddenLayer>& layers, const Row& lower, const Row& upper,
                           const NeuronBounds* around) {
  NeuronBounds bounds;
  std::vector<Row>& term = bounds.terms;
  Row magnitude;  // of the layer's input
  for (std::size_t j = 0; j < lower.size(); ++j)
    magnitude.push_back(std::max(std::abs(lower[j]), std::abs(upper[j])));
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const HiddenLayer& layer = layers[k];
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
    magnitude.assign(rows, 0);
    bounds.slope.emplace_back(rows, 0.0);
    bounds.offset.emplace_back(rows, 0.0);
    for (std::size_t i = 0; i < rows; ++i) {
      double& l = bounds.lower[k][i];
      double& u = bounds.upper[k][i];
      if (!layer.has_relu(i) || (l < 0 && u > 0)) {
        for (const double sign : {1.0, -1.0}) {
          const double end = largest(above(layers, bounds, k, i, sign), lower, upper);
          if (sign > 0) u = std::min(u, end);
          if (sign < 0) l = std::max(l, -end);
        }
      }
      if (layer.has_relu(i) && l < 0 && u > 0) {
        const double slope = std::min(1.0, u / (u - l));
        bounds.slope[k][i] = slope;
        bounds.offset[k][i] = std::max({0.0, next_up(u - next_down(slope * u)), next_up(-slope * l)});
      }
      magnitude[i] = layer.has_relu(i) ? std::max(0.0, u) : std::max(std::abs(l), std::abs(u));
    }
  }
  return bounds;
}

}  // namespace swarmcert::check
