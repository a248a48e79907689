/// @file Directed rounding of exact numbers to doubles.
#pragma once

#include <optional>

#include "lipschitz/checker/dyadic.h"

namespace swarmcert::lipschitz {

/// Returns the smallest double that is at least x, or infinity on overflow.
double rounded_up(const check::Dyadic& x);
/// Returns the largest double that is at most x, or -infinity on overflow.
double rounded_down(const check::Dyadic& x);

/// Returns the smallest double u >= 0 with u^2 >= square in exact arithmetic, or infinity on overflow.
/// @param square nonnegative
double sqrt_up(const check::Dyadic& square);

/// Returns the float32 in [low, high] that is nearest to x, or one next to it; nothing if the interval contains no
/// float32.
/// @param x must be within the range of float32 after it is clamped to [low, high]; low and high are not NaN.
std::optional<float> nearest_float(double x, double low, double high);

}  // namespace swarmcert::lipschitz
