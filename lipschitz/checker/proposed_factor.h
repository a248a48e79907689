/// @file A factor that shows a matrix to be positive semidefinite, found in floating point and verified in integers.
#pragma once

#include <optional>

#include "lipschitz/checker/lipschitz_lmi.h"

namespace swarmcert::check {

/// x as a double, rounded towards zero; 0 where the magnitude is below the smallest one.
double to_double(const Dyadic& x);

/// Looks for a factor that shows P >= 0: P is scaled to a unit diagonal by powers of two, rounded to double, shifted
/// down by a little more than what rounding costs, factorised, and the factor rounded to multiples of 2^-60.
///
/// Floating point only proposes: whatever it does, what is returned has been accepted by shows_positive_semidefinite(),
/// in integers. So a certificate need not hold a factor, which is many times as long as the weights of a large network.
/// @returns nothing where no such factor was found: P is indefinite or too close to it.
std::optional<Factor> proposed_factor(const SymmetricMatrix& p);

}  // namespace swarmcert::check
