/// @file A factor that proves a matrix positive semidefinite, computed in floating point and verified in integers.
#pragma once

#include <optional>

#include "lipschitz/checker/lipschitz_lmi.h"

namespace swarmcert::check {

/// Returns x as a double, rounded towards zero; 0 on underflow.
double to_double(const Dyadic& x);

/// Looks for a factor that proves P >= 0: P is scaled to about a unit diagonal by powers of two, rounded to double,
/// reduced on the diagonal by slightly more than the round-off errors, factorised, and the factor is rounded to
/// multiples of 2^-60.
///
/// The result does not depend on the correctness of the floating-point arithmetic, because every returned factor has
/// been accepted by shows_positive_semidefinite() in integers. A certificate therefore need not contain a factor, which
/// is many times as long as the weights of a large network.
/// @returns nothing if no such factor was found, because P is indefinite or too close to being so.
std::optional<Factor> proposed_factor(const SymmetricMatrix& p);

}  // namespace swarmcert::check
