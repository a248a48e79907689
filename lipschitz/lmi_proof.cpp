#include "lipschitz/lmi_proof.h"

#include <cmath>
#include <limits>

namespace swarmcert::lipschitz {

using check::Dyadic;
using check::Factor;
using check::Matrix;

double sqrt_up(double rho) {
  const auto is_enough = [rho](double x) { return Dyadic(x) * Dyadic(x) >= Dyadic(rho); };
  double root = std::sqrt(rho);
  while (!is_enough(root)) root = std::nextafter(root, std::numeric_limits<double>::infinity());
  while (root > 0 && is_enough(std::nextafter(root, 0.0))) root = std::nextafter(root, 0.0);
  return root;
}

namespace {

template <class Chain>
std::optional<UpperProof> proof_of(const Chain& chain, double rho, const std::vector<double>& t) {
  UpperProof proof;
  proof.rho = rho;
  proof.t = t;
  if (!(rho > 0) || !std::isfinite(rho)) return std::nullopt;
  for (const double multiplier : t) {
    if (!(multiplier >= 0) || !std::isfinite(multiplier)) return std::nullopt;
  }
  std::optional<Factor> factor =
      check::proposed_factor(check::lipschitz_lmi(chain, rho, {t.begin(), t.end()}));
  if (!factor) return std::nullopt;
  if (factor->rows.size() <= kMostFactorRows) proof.factor = std::move(factor);
  proof.upper = UpperBound(sqrt_up(rho));
  return proof;
}

}  // namespace

std::optional<UpperProof> prove(const std::vector<Matrix>& stages, double rho, const std::vector<double>& t) {
  return proof_of(stages, rho, t);
}

std::optional<UpperProof> prove(const check::BentChain& chain, double rho, const std::vector<double>& t) {
  return proof_of(chain, rho, t);
}

}  // namespace swarmcert::lipschitz
