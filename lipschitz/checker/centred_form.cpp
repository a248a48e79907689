#include "lipschitz/checker/centred_form.h"

#include <algorithm>

#include "lipschitz/checker/fixed_point.h"
#include "lipschitz/checker/lipschitz_lmi.h"

namespace swarmcert::check {
namespace {

using files::Activation;

const Dyadic kUnit(1, kValueUnit);

Dyadic half(const Dyadic& x) { return {x.mantissa, x.exponent - 1}; }

/// y = slope (x - c) + middle + e with |e| <= error, entry by entry.
struct CentredForm {
  Matrix slope;
  std::vector<Dyadic> middle, error;
};

/// Propagates intervals and the form through the layers.
class BoxValues {
 public:
  explicit BoxValues(const Intervals& box) : values_(box), form_(form_of(box)) {
    for (std::size_t j = 0; j < box.lower.size(); ++j) {
      radius_.push_back(half(box.upper[j] - box.lower[j]));
      rounding_ += radius_.back();
    }
    rounding_ = kUnit * (Dyadic(1.0) + rounding_);
  }

  /// Applies W h + b and returns its intervals.
  Intervals pass(const files::Layer& layer) {
    const Matrix w(layer.outputs, layer.inputs, layer.weights);
    CentredForm form{product(w, form_.slope), {}, {}};
    for (Dyadic& entry : form.slope.entries) entry = floor_to(entry, kValueUnit);
    for (int i = 0; i < w.rows; ++i) {
      Dyadic middle = layer.biases[static_cast<std::size_t>(i)], error = rounding_;
      for (int j = 0; j < w.cols; ++j) {
        const auto k = static_cast<std::size_t>(j);
        middle += w(i, j) * form_.middle[k];
        error += absolute(w(i, j)) * form_.error[k];
      }
      form.middle.push_back(floor_to(middle, kValueUnit));
      form.error.push_back(ceil_to(error, kValueUnit));
    }
    form_ = std::move(form);
    values_ = intersected(layer_intervals(layer, values_));
    return values_;
  }

  /// Applies the activation to all entries except the last ones, which the layer keeps.
  void activate(const files::Layer& layer) {
    const Activation activation = layer.activation;
    if (files::function_of(activation).sorts()) {
      values_ = activated_intervals(layer, values_);
      form_ = constant_form();
      return;
    }
    const std::size_t changed = values_.lower.size() - static_cast<std::size_t>(layer.kept);
    for (std::size_t i = 0; i < changed; ++i) activate(activation, i);
  }

 private:
  static CentredForm form_of(const Intervals& box) {
    const auto inputs = static_cast<int>(box.lower.size());
    CentredForm form{Matrix(inputs, inputs), {}, std::vector<Dyadic>(box.lower.size())};
    for (int j = 0; j < inputs; ++j) {
      const auto k = static_cast<std::size_t>(j);
      form.slope(j, j) = 1.0;
      form.middle.push_back(half(box.lower[k] + box.upper[k]));
    }
    return form;
  }

  /// Returns the intersection of `intervals` with the intervals of the form.
  Intervals intersected(Intervals intervals) const {
    for (std::size_t i = 0; i < intervals.lower.size(); ++i) {
      Dyadic spread = form_.error[i];
      for (std::size_t j = 0; j < radius_.size(); ++j)
        spread += absolute(form_.slope(static_cast<int>(i), static_cast<int>(j))) * radius_[j];
      intervals.lower[i] = std::max<Dyadic>(intervals.lower[i], form_.middle[i] - spread);
      intervals.upper[i] = std::min<Dyadic>(intervals.upper[i], form_.middle[i] + spread);
    }
    return intervals;
  }

  void activate(Activation activation, std::size_t i) {
    Dyadic &low = values_.lower[i], &high = values_.upper[i], &middle = form_.middle[i],
           &error = form_.error[i];
    const Dyadic point = std::max<Dyadic>(low, std::min<Dyadic>(middle, high));
    const Interval slopes = slopes_between(activation, {low, high});
    const Interval value = values_between(activation, {point, point});
    const Dyadic mean = half(slopes.lower + slopes.upper), deviation = half(slopes.upper - slopes.lower);
    for (std::size_t j = 0; j < radius_.size(); ++j) {
      Dyadic& entry = form_.slope(static_cast<int>(i), static_cast<int>(j));
      entry = floor_to(mean * entry, kValueUnit);
    }
    error = ceil_to(absolute(mean) * error + deviation * std::max<Dyadic>(high - point, point - low) +
                        (value.upper - value.lower) + rounding_,
                    kValueUnit);
    middle = floor_to(value.lower + mean * (middle - point), kValueUnit);
    const Interval all = values_between(activation, {low, high});
    low = all.lower;
    high = all.upper;
  }

  /// Returns the intervals as a form that does not depend on x.
  CentredForm constant_form() const {
    CentredForm form{
        Matrix(static_cast<int>(values_.lower.size()), static_cast<int>(radius_.size())), {}, {}};
    for (std::size_t i = 0; i < values_.lower.size(); ++i) {
      form.middle.push_back(floor_to(half(values_.lower[i] + values_.upper[i]), kValueUnit));
      form.error.push_back(ceil_to(half(values_.upper[i] - values_.lower[i]), kValueUnit) + kUnit);
    }
    return form;
  }

  Intervals values_;
  CentredForm form_;
  std::vector<Dyadic> radius_;
  Dyadic rounding_;  ///< bound on the error of rounding the numbers of a form
};

}  // namespace

std::vector<Intervals> layers_on_box(const files::Weights& weights, const Intervals& box) {
  BoxValues values(box);
  std::vector<Intervals> result;
  for (std::size_t k = 0; k < weights.layers.size(); ++k) {
    if (k > 0) values.activate(weights.layers[k - 1]);
    result.push_back(values.pass(weights.layers[k]));
  }
  return result;
}

std::vector<std::vector<Interval>> slopes_on_box(const files::Weights& weights, const Intervals& box) {
  const std::vector<Intervals> layers = layers_on_box(weights, box);
  std::vector<std::vector<Interval>> result;
  for (std::size_t k = 0; k + 1 < layers.size(); ++k) {
    const Activation activation = weights.layers[k].activation;
    result.emplace_back();
    if (files::function_of(activation).sorts()) continue;
    const auto kept = static_cast<std::size_t>(weights.layers[k].kept);
    for (std::size_t i = 0; i < layers[k].lower.size() - kept; ++i)
      result.back().push_back(slopes_between(activation, {layers[k].lower[i], layers[k].upper[i]}));
    result.back().insert(result.back().end(), kept, kKeptSlopes);
  }
  return result;
}

}  // namespace swarmcert::check
