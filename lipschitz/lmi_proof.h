/// @file From proposed multipliers to a proof that the checker accepts.
#pragma once

#include <optional>
#include <vector>

#include "lipschitz/checker/bounds.h"
#include "lipschitz/checker/lipschitz_lmi.h"

namespace swarmcert::lipschitz {

/// An upper bound on a chain's Lipschitz constant with what shows it: sqrt(rho) <= upper, and `factor` shows that
/// check::lipschitz_lmi(stages, rho, t) is positive semidefinite.
struct UpperProof {
  UpperBound upper{0};
  double rho = 0;
  std::vector<double> t;
  check::Factor factor;
};

/// Looks for a factor that shows P >= 0: P is scaled to a unit diagonal by powers of two, rounded to double, shifted
/// down by a little more than what rounding costs, factorised, and the factor rounded to multiples of 2^-60.
/// @returns a factor that check::shows_positive_semidefinite() has accepted, or nothing: P is then indefinite or too
///   close to it.
std::optional<check::Factor> find_factor(const check::Matrix& p);

/// A verified proof that sqrt(rho) bounds the chain, or nothing if (rho, t) does not satisfy the inequality with a
/// margin for rounding. `upper` is the smallest double whose square is at least rho.
std::optional<UpperProof> prove(const std::vector<check::Matrix>& stages, double rho,
                                const std::vector<double>& t);

/// x to the nearest double; 0 where the magnitude is below the smallest one.
double to_double(const check::Dyadic& x);

/// The smallest double whose square is at least rho >= 0, in exact arithmetic.
double sqrt_up(double rho);

}  // namespace swarmcert::lipschitz
