#include "analysis/identification/evidence/detectable.h"

#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"

namespace swarmcert::evidence {
namespace {

/// Returns the sum of the relative distances of a shape from the effect's default.
double distance(const stability::EffectInfo& info, const std::vector<double>& theta) {
  double sum = 0;
  for (std::size_t i = 0; i < theta.size(); ++i) {
    const double own = info.shape[i].value;
    sum += std::abs(theta[i] - own) / std::max(std::abs(own), 1e-3);
  }
  return sum;
}

/// Returns the index of the shape of the grid that is closest to the effect's default.
std::size_t default_shape(const identification::Candidate& candidate) {
  const auto& thetas = candidate.thetas;
  const auto closest = std::min_element(thetas.begin(), thetas.end(), [&](const auto& a, const auto& b) {
    return distance(candidate.info, a) < distance(candidate.info, b);
  });
  return static_cast<std::size_t>(closest - thetas.begin());
}

/// Returns the smallest size over the priors of an entry.
double smallest(const Hypotheses& all, const EvidenceSearch& search, const Set& set, std::size_t entry,
                std::size_t shape, int coefficient) {
  double least = kInfinity;
  for (std::size_t prior = 0; prior < all.entries[entry].priors.size(); ++prior)
    least = std::min(least, search.size_for(kNamed_bits, set, {entry, shape, prior}, coefficient));
  return least;
}

Detectable shortest_time(const Hypotheses& all, const EvidenceSearch& search, const Set& set,
                         std::size_t entry) {
  const identification::Candidate& candidate = all.candidates[entry];
  Detectable result{
      candidate.info.name, candidate.info.shape[0].name, kInfinity, candidate.info.excitation, {}};
  for (std::size_t shape = 0; shape < candidate.thetas.size(); ++shape) {
    if (smallest(all, search, set, entry, shape, 0) <= 1)
      result.size = std::min(result.size, candidate.thetas[shape][0]);
  }
  return result;
}

Detectable smallest_size(const Hypotheses& all, const EvidenceSearch& search, const Set& set,
                         std::size_t entry, int coefficient) {
  const identification::Candidate& candidate = all.candidates[entry];
  const stability::Parameter& parameter = candidate.info.linear[static_cast<std::size_t>(coefficient)];
  const std::size_t shape = default_shape(candidate);
  Detectable result{candidate.info.name,
                    parameter.name,
                    smallest(all, search, set, entry, shape, coefficient),
                    candidate.info.excitation,
                    {}};
  if (result.size > std::max(std::abs(parameter.lower), std::abs(parameter.upper))) result.size = kInfinity;
  for (std::size_t i = 0; i < candidate.info.shape.size(); ++i)
    result.shape[candidate.info.shape[i].name] = candidate.thetas[shape][i];
  return result;
}

}  // namespace

std::vector<Detectable> detectable(const Hypotheses& all, const EvidenceSearch& search, const Weighed& best) {
  std::vector<Detectable> result;
  for (std::size_t k = 0; k < all.candidates.size(); ++k) {
    const identification::Candidate& candidate = all.candidates[k];
    if (!candidate.vehicles.empty() || !search.may_add(best.set, k)) continue;
    if (candidate.info.remembers) {
      result.push_back(shortest_time(all, search, best.set, k));
      continue;
    }
    for (int c = 0; c < candidate.columns(); ++c)
      result.push_back(smallest_size(all, search, best.set, k, c));
  }
  return result;
}

}  // namespace swarmcert::evidence
