/// @file What an activation gives over an interval and between which slopes it lies there, in exact arithmetic. Not for
/// users.
#pragma once

#include "lipschitz/checker/dyadic.h"
#include "nn/weights/activation_function.h"

namespace swarmcert::check {

/// lower <= t <= upper.
struct Interval {
  Dyadic lower, upper;
};

/// Values are multiples of 2^kValueUnit, slopes of 2^kSlopeUnit, rounded outwards.
inline constexpr long kValueUnit = -64, kSlopeUnit = -24;

/// Contains s(t) for every t of the interval. Exact for ReLU; else the ends are multiples of 2^kValueUnit.
///
/// No value of a mathematical library is used. With E = e^-|t|, e^-x from the power series of e^(x / 4096), and
/// Phi(t) = 1/2 + phi(t) (t + t^3/3 + t^5/(3 5) + ...), the values are rational functions of E, of
/// ln(1 + E) = 2 artanh(E / (2 + E)) and of Phi, in integers with 256 bits behind the point and each rounding and each
/// remainder of a series added to an enclosure. All activations rise, but for SiLU, which falls up to its one minimum
/// 1 + t at e^t + 1 + t = 0, and GELU, which falls up to its one minimum near -0.7518.
/// @throws std::domain_error if the activation sorts.
Interval values_between(files::Activation activation, const Interval& t);

/// Slopes (s(t) - s(u)) / (t - u) of all t and u of the interval lie within, and the interval lies within the slopes
/// that the activation has anywhere (ActivationFunction). Ends are multiples of 2^kSlopeUnit, or those slopes; the
/// upper one is above the lower one.
///
/// By the mean value theorem between the extremes of the derivative s'. That of tanh and sigmoid falls with |t|; that
/// of softplus rises, and those of ELU and SELU do for t < 0, where SELU's jumps down to a constant at 0. That of SiLU
/// has its one maximum where t tanh(t / 2) = 2, t = 2.3994, GELU's its one at t = sqrt 2; both s'(-t) = 1 - s'(t), so
/// that minima are at the negative of these places. Elsewhere s' is monotone, and its extremes are at the ends.
/// @throws std::domain_error if the activation sorts.
Interval slopes_between(files::Activation activation, const Interval& t);

}  // namespace swarmcert::check
