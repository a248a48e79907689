#include "lipschitz/upper/lmi_proof.h"

#include <cmath>

#include "lipschitz/base/rounding.h"

namespace swarmcert::lipschitz {

using check::Factor;
using check::Matrix;

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
