#include "analysis/identification/evidence/explanations.h"

#include <algorithm>
#include <cmath>

#include "analysis/identification/evidence/evidence_search.h"
#include "analysis/identification/evidence/projection.h"
#include "analysis/identification/evidence/shapes.h"

namespace swarmcert::evidence {
namespace {

/// The best set, with the data that it explains.
struct Found {
  Whitened data;
  Weighed best;
};

/// Searches, moves shapes off the grid, and searches again from there: what a coarse grid leaves is no other effect.
Found found_on(const identification::Passes& passes, const Projection& projection, Hypotheses& all,
               Set start) {
  constexpr int kMostRounds = 4;
  Found found{{projection.of(all.columns), projection.of(all.residual_N)}, {}};
  for (int round = 0; round < kMostRounds; ++round) {
    found.best = EvidenceSearch(all, found.data).best(start);
    found.best = with_free_shapes(passes, projection, all, found.data, std::move(found.best));
    if (found.best.set == start) break;
    start = found.best.set;
  }
  return found;
}

/// Searches what set points can have caused. Where they cause something that no explanation has, it counts as noise.
Found found_by_set_points(const identification::Passes& passes, Hypotheses& all) {
  constexpr int kMostRounds = 4;
  Projection projection = Projection::on_set_points(all);
  Found found = found_on(passes, projection, all, {});
  for (int round = 1; round < kMostRounds; ++round) {
    if (!projection.temper(EvidenceSearch(all, found.data).left_by(found.best))) break;
    found = found_on(passes, projection, all, found.best.set);
  }
  return found;
}

/// Searches all data. Their noise is what the best set leaves, so that both are found in turn.
Found found_in_everything(const identification::Passes& passes, Hypotheses& all) {
  constexpr int kMostRounds = 3;
  Eigen::VectorXd power = power_beside(all, {}, {});
  Found found = found_on(passes, Projection::on_everything(all, power), all, {});
  for (int round = 1; round < kMostRounds; ++round) {
    const Set before = found.best.set;
    power = power_beside(all, EvidenceSearch(all, found.data).columns_of(before), found.best.coefficients);
    found = found_on(passes, Projection::on_everything(all, power), all, before);
    if (found.best.set == before) break;
  }
  return found;
}

Named named(const Hypotheses& all, const EvidenceSearch& search, const Weighed& best, std::size_t index,
            Eigen::Index first) {
  const Item& item = best.set[index];
  const identification::Candidate& candidate = all.candidates[item.entry];
  Named result{candidate,
               item.entry,
               search.bits(best, index),
               best.coefficients[first],
               std::sqrt(best.covariance(first, first)),
               {}};
  result.candidate.thetas = {candidate.thetas[std::min(item.shape, candidate.thetas.size() - 1)]};
  for (const Option& other : search.instead_of(best, index))
    result.others.emplace_back(all.entries[other.item.entry].name, std::exp(other.score - best.score));
  return result;
}

}  // namespace

Explanations explanations(const identification::Passes& passes,
                          const std::vector<identification::Candidate>& candidates) {
  Hypotheses all = hypotheses(passes, candidates);
  Explanations result;
  result.is_by_set_points = all.instruments[0].size() > 0;
  const Found found =
      result.is_by_set_points ? found_by_set_points(passes, all) : found_in_everything(passes, all);
  const EvidenceSearch search(all, found.data);
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < found.best.set.size(); ++i) {
    const Entry& entry = all.entries[found.best.set[i].entry];
    if (entry.kind == Kind::kEffect)
      result.effects.push_back(named(all, search, found.best, i, first));
    else
      result.curves.push_back(entry.name);
    first += entry.size;
  }
  std::stable_sort(result.effects.begin(), result.effects.end(),
                   [](const Named& a, const Named& b) { return a.evidence_bits > b.evidence_bits; });
  return result;
}

}  // namespace swarmcert::evidence
