/// @file Exact numbers rounded to doubles that stay bounds.
#pragma once

#include <optional>

#include "lipschitz/checker/dyadic.h"

namespace swarmcert::lipschitz {

/// The smallest double that is at least x; infinite beyond the doubles.
double rounded_up(const check::Dyadic& x);
/// The largest double that is at most x; -infinity beyond the doubles.
double rounded_down(const check::Dyadic& x);

/// The smallest double u >= 0 with u^2 >= square, in exact arithmetic; infinite beyond the doubles.
/// @param square not negative
double sqrt_up(const check::Dyadic& square);

/// A float32 in [low, high], the nearest to x or one next to it; nothing if the interval holds no float32.
/// @param x within the range of float32 once it is in [low, high]; low and high not NaN.
std::optional<float> nearest_float(double x, double low, double high);

}  // namespace swarmcert::lipschitz
