#include "lipschitz/checker/activation_bounds.h"

#include <algorithm>
#include <stdexcept>

#include "lipschitz/checker/fixed_point.h"

namespace swarmcert::check {
namespace {

using files::Activation;

Fixed whole(long n) { return Fixed(Dyadic(mpz_class(n), 0)); }
Dyadic lower_end(const Fixed& x) { return {x.lower, -kFixedBits}; }
Dyadic upper_end(const Fixed& x) { return {x.upper, -kFixedBits}; }
bool contains(const Interval& t, const Dyadic& low, const Dyadic& high) {
  return high >= t.lower && t.upper >= low;
}

/// SELU's constants as the statement writes them.
Fixed selu_scale() { return Fixed::ratio(mpz_class("10507009873554805"), mpz_class("10000000000000000")); }
Fixed selu_alpha() { return Fixed::ratio(mpz_class("16732632423543772"), mpz_class("10000000000000000")); }

Fixed exp_of_minus_size(const Dyadic& t) { return exp_of_minus(Fixed(absolute(t))); }

Fixed sigmoid(const Dyadic& t) {
  const Fixed e = exp_of_minus_size(t);
  return (t.sign() >= 0 ? whole(1) : e) / (whole(1) + e);
}

/// e / (1 + e)^2, sigmoid'(t) for e = e^-|t|.
Fixed sigmoid_slope(const Fixed& e) { return e / ((whole(1) + e) * (whole(1) + e)); }

Fixed tanh(const Dyadic& t) {
  const Fixed e = exp_of_minus_size(Dyadic(2.0) * t), value = (whole(1) - e) / (whole(1) + e);
  return t.sign() >= 0 ? value : -value;
}

/// s(t).
Fixed value_at(Activation activation, const Dyadic& t) {
  const bool is_negative = t.sign() < 0;
  switch (activation) {
    case Activation::kTanh:
      return tanh(t);
    case Activation::kSigmoid:
      return sigmoid(t);
    case Activation::kSoftplus:
      return (is_negative ? whole(0) : Fixed(t)) + log_of_one_plus(exp_of_minus_size(t));
    case Activation::kElu:
      return is_negative ? exp_of_minus_size(t) - whole(1) : Fixed(t);
    case Activation::kSelu:
      return selu_scale() * (is_negative ? selu_alpha() * (exp_of_minus_size(t) - whole(1)) : Fixed(t));
    case Activation::kSilu:
      return Fixed(t) * sigmoid(t);
    case Activation::kGelu:
      return Fixed(t) * normal_probability(Fixed(t));
    default:
      throw std::domain_error(files::function_of(activation).words + " is not evaluated by an enclosure");
  }
}

/// s'(t); for ELU and SELU at 0, the derivative from below.
Fixed slope_at(Activation activation, const Dyadic& t) {
  switch (activation) {
    case Activation::kTanh:
      return whole(4) * sigmoid_slope(exp_of_minus_size(Dyadic(2.0) * t));
    case Activation::kSigmoid:
      return sigmoid_slope(exp_of_minus_size(t));
    case Activation::kSoftplus:
      return sigmoid(t);
    case Activation::kElu:
      return t.sign() > 0 ? whole(1) : exp_of_minus_size(t);
    case Activation::kSelu:
      return t.sign() > 0 ? selu_scale() : selu_scale() * selu_alpha() * exp_of_minus_size(t);
    case Activation::kSilu:
      return sigmoid(t) + Fixed(t) * sigmoid_slope(exp_of_minus_size(t));
    case Activation::kGelu:
      return normal_probability(Fixed(t)) + Fixed(t) * normal_density(Fixed(t));
    default:
      throw std::domain_error(files::function_of(activation).words + " has no derivative here");
  }
}

/// Bounds on the position of the minimum of s, and a lower bound on its value. SiLU: the minimum is 1 + t where
/// e^t + 1 + t, which is increasing, is 0, so 1 + `from` is a lower bound. GELU: s' is increasing for |t| < sqrt 2 and
/// is between 0 and 2^-22 at `to`, so s(`to`) - 2^-41 is a lower bound.
struct Minimum {
  Dyadic from, to, value;
};
Minimum minimum_of(Activation activation) {
  return activation == Activation::kSilu ? Minimum{-0x1.47498p+0, -0x1.47497p+0, -0x1.1d26p-2}
                                         : Minimum{-0x1.80eaep-1, -0x1.80eacp-1, -0x1.5c19ep-3};
}

/// Bounds on the position of the maximum of s'.
Interval steepest_place(Activation activation) {
  return activation == Activation::kSilu ? Interval{0x1.331p+1, 0x1.332p+1} : Interval{0x1.6ap+0, 0x1.6a1p+0};
}

/// Encloses s' of SiLU and GELU over an interval. If s' may have an extreme inside, its global extreme is used.
Interval bent_slopes(Activation activation, const Interval& t) {
  const Fixed low = slope_at(activation, t.lower), high = slope_at(activation, t.upper);
  Interval result = {std::min<Dyadic>(lower_end(low), lower_end(high)),
                     std::max<Dyadic>(upper_end(low), upper_end(high))};
  const files::ActivationFunction& function = files::function_of(activation);
  const Interval place = steepest_place(activation);
  if (contains(t, place.lower, place.upper)) result.upper = function.greatest_slope;
  if (contains(t, -place.upper, -place.lower)) result.lower = function.least_slope;
  return result;
}

/// Encloses s' over an interval.
Interval derivatives(Activation activation, const Interval& t) {
  const bool has_negative = t.lower.sign()<0, has_positive = t.upper.sign()> 0;
  switch (activation) {
    case Activation::kRelu:
      return {has_negative || !has_positive ? 0.0 : 1.0, has_positive ? 1.0 : 0.0};
    case Activation::kTanh:
    case Activation::kSigmoid: {
      const Dyadic a = absolute(t.lower), b = absolute(t.upper);
      const Dyadic nearest = has_negative && has_positive ? Dyadic() : std::min<Dyadic>(a, b);
      return {lower_end(slope_at(activation, std::max<Dyadic>(a, b))),
              upper_end(slope_at(activation, nearest))};
    }
    case Activation::kSelu: {
      if (!has_negative) return {lower_end(selu_scale()), upper_end(selu_scale())};
      const Dyadic least = lower_end(slope_at(activation, t.lower));
      return {has_positive ? std::min<Dyadic>(least, lower_end(selu_scale())) : least,
              upper_end(slope_at(activation, has_positive ? Dyadic() : t.upper))};
    }
    case Activation::kSilu:
    case Activation::kGelu:
      return bent_slopes(activation, t);
    default:
      return {lower_end(slope_at(activation, t.lower)), upper_end(slope_at(activation, t.upper))};
  }
}

}  // namespace

Interval values_between(Activation activation, const Interval& t) {
  if (activation == Activation::kRelu)
    return {t.lower.sign() < 0 ? Dyadic() : t.lower, t.upper.sign() < 0 ? Dyadic() : t.upper};
  const Fixed low = value_at(activation, t.lower), high = value_at(activation, t.upper);
  Dyadic least = lower_end(low), greatest = upper_end(high);
  if (!files::function_of(activation).is_monotone()) {
    least = std::min<Dyadic>(least, lower_end(high));
    greatest = std::max<Dyadic>(greatest, upper_end(low));
    const Minimum minimum = minimum_of(activation);
    if (contains(t, minimum.from, minimum.to)) least = minimum.value;
  }
  return {floor_to(least, kValueUnit), ceil_to(greatest, kValueUnit)};
}

Interval slopes_between(Activation activation, const Interval& t) {
  const files::ActivationFunction& function = files::function_of(activation);
  if (function.sorts()) throw std::domain_error(function.words + " has no slopes of single numbers");
  const Interval exact = derivatives(activation, t);
  const Dyadic unit(1, kSlopeUnit);
  return {std::max<Dyadic>(ceil_to(exact.lower, kSlopeUnit) - unit, function.least_slope),
          std::min<Dyadic>(floor_to(exact.upper, kSlopeUnit) + unit, function.greatest_slope)};
}

}  // namespace swarmcert::check
