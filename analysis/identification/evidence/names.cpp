#include "analysis/identification/evidence/names.h"

#include <cmath>
#include <stdexcept>

#include "analysis/identification/diagnose.h"
#include "analysis/identification/evidence/evidence_search.h"

namespace swarmcert::evidence {

std::vector<Named> names_by_evidence(const residuals::Inputs& inputs, const std::string& kind, int jobs) {
  const std::vector<int> flights = identification::every_flight(inputs);
  const identification::Coverage covered = identification::coverage(inputs, kind, flights, jobs);
  const Hypotheses all = hypotheses({inputs, kind, flights, covered.records, jobs, [](int, int) {}},
                                    identification::all_candidates(*inputs.model_of(kind), covered));
  if (all.instruments[0].size() == 0)
    throw std::invalid_argument("evidence needs set points in every log: they are the instruments");
  const EvidenceSearch search(all);
  const Weighed best = search.best();
  std::vector<Named> named;
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < best.set.size(); ++i) {
    const Entry& entry = all.entries[best.set[i].entry];
    Named next{entry.name,
               entry.kind == Kind::kEffect,
               {},
               best.coefficients[first],
               std::sqrt(best.covariance(first, first))};
    for (const Option& other : search.instead_of(best, i))
      next.others.push_back(all.entries[other.item.entry].name);
    named.push_back(std::move(next));
    first += entry.size;
  }
  return named;
}

}  // namespace swarmcert::evidence
