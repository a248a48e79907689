/// @file Values and slopes of an activation over an interval, in exact arithmetic. Not for users.
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

/// Returns an interval that contains s(t) for every t of the interval. Exact for ReLU; for other activations the ends
/// are multiples of 2^kValueUnit.
///
/// No mathematical library is used. With E = e^-|t|, e^-x from the power series of e^(x / 4096), and
/// Phi(t) = 1/2 + phi(t) (t + t^3/3 + t^5/(3 5) + ...), the values are rational functions of E, of
/// ln(1 + E) = 2 artanh(E / (2 + E)) and of Phi. They are computed in integers with 256 fractional bits; every
/// round-off error and every series remainder is added to the enclosure. All activations are increasing except SiLU,
/// which decreases up to its only minimum 1 + t at e^t + 1 + t = 0, and GELU, which decreases up to its only minimum
/// near -0.7518.
/// @throws std::domain_error if the activation sorts.
Interval values_between(files::Activation activation, const Interval& t);

/// Returns an interval that contains the slopes (s(t) - s(u)) / (t - u) for all t and u of the interval and lies within
/// the activation's global slope range (ActivationFunction). The ends are multiples of 2^kSlopeUnit or the ends of the
/// global range; the upper end is above the lower one.
///
/// By the mean value theorem, the slopes lie between the extremes of the derivative s'. For tanh and sigmoid, s'
/// decreases with |t|. For softplus it increases; for ELU and SELU it increases for t < 0, and at 0 that of SELU jumps
/// down to a constant. For SiLU, s' has its only maximum where t tanh(t / 2) = 2, t = 2.3994; for GELU, at t = sqrt 2.
/// For both, s'(-t) = 1 - s'(t), so the minima are at the negatives of these points. Elsewhere s' is monotone, and its
/// extremes are at the ends.
/// @throws std::domain_error if the activation sorts.
Interval slopes_between(files::Activation activation, const Interval& t);

}  // namespace swarmcert::check
