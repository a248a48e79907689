#include "analysis/identification/evidence/explanations.h"

#include <algorithm>
#include <cmath>
#include <set>

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

/// Returns whether the sets have the same entries.
bool has_same_entries(const Set& a, const Set& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Item& x, const Item& y) { return x.entry == y.entry; });
}

/// Searches step by step. After each, shapes move off the grid: what a coarse grid leaves is no other effect.
Found found_on(const identification::Passes& passes, const Projection& projection, Hypotheses& all,
               const Set& start) {
  constexpr int kMostSteps = 40;
  Found found{{projection.of(all.columns), projection.of(all.residual_N)}, {}};
  found.best = EvidenceSearch(all, found.data).weigh(start);
  for (int step = 0; step < kMostSteps; ++step) {
    Weighed next = EvidenceSearch(all, found.data).next(found.best);
    if (has_same_entries(next.set, found.best.set)) break;
    found.best = with_free_shapes(passes, projection, all, found.data, std::move(next));
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
    if (has_same_entries(found.best.set, before)) break;
  }
  return found;
}

/// Returns whether the effect at `index` has another form than the flights show, which a curve over its variable shows.
bool is_refuted(const Hypotheses& all, const EvidenceSearch& search, const Weighed& best, std::size_t index) {
  const stability::EffectTraits& traits = all.candidates[best.set[index].entry].info.traits;
  for (std::size_t i = 0; i < best.set.size(); ++i) {
    const Entry& entry = all.entries[best.set[i].entry];
    if (entry.kind != Kind::kCurve || !traits.varies_with(entry.variable)) continue;
    Set without = best.set;
    without.erase(without.begin() + static_cast<std::ptrdiff_t>(i));
    const std::size_t effect = index - (i < index ? 1 : 0);
    if (search.shows_form(search.weigh(without), effect, best.set[i], best)) return true;
  }
  return false;
}

Named named(const Hypotheses& all, const EvidenceSearch& search, const Weighed& best, std::size_t index,
            Eigen::Index first) {
  const Item& item = best.set[index];
  const identification::Candidate& candidate = all.candidates[item.entry];
  Named result{candidate,
               search.bits(best, index),
               best.coefficients[first],
               std::sqrt(best.covariance(first, first)),
               {}};
  result.candidate.thetas = {candidate.thetas[std::min(item.shape, candidate.thetas.size() - 1)]};
  for (const Option& other : search.instead_of(best, index))
    result.rivals.push_back({all.entries[other.item.entry].name,
                             all.candidates[other.item.entry].info.excitation,
                             std::exp(other.score - best.score)});
  return result;
}

/// Returns the best set without the excluded effects.
Found best_found(const identification::Passes& passes, Hypotheses& all) {
  return all.has_set_points() ? found_on(passes, Projection::on_set_points(all), all, {})
                              : found_in_everything(passes, all);
}

/// Returns the names of the effects of a set that are refuted.
std::set<std::string> refuted(const Hypotheses& all, const Found& found) {
  const EvidenceSearch search(all, found.data);
  std::set<std::string> names;
  for (std::size_t i = 0; i < found.best.set.size(); ++i) {
    const Entry& entry = all.entries[found.best.set[i].entry];
    if (entry.kind == Kind::kEffect && is_refuted(all, search, found.best, i)) names.insert(entry.name);
  }
  return names;
}

Explanations described(const Hypotheses& all, const Found& found) {
  Explanations result;
  result.is_by_set_points = all.has_set_points();
  const EvidenceSearch search(all, found.data);
  Eigen::Index first = 0;
  for (std::size_t i = 0; i < found.best.set.size(); ++i) {
    const Entry& entry = all.entries[found.best.set[i].entry];
    if (entry.kind == Kind::kEffect)
      result.effects.push_back(named(all, search, found.best, i, first));
    else
      result.curves.push_back(entry.name);
    if (entry.name == kDragCurve) result.has_drag_curve = true;
    first += entry.size;
  }
  result.detectable = detectable(all, search, found.best);
  std::stable_sort(result.effects.begin(), result.effects.end(),
                   [](const Named& a, const Named& b) { return a.evidence_bits > b.evidence_bits; });
  return result;
}

}  // namespace

Explanations explanations(const identification::Passes& passes, Hypotheses& all) {
  for (;;) {
    const Found found = best_found(passes, all);
    const std::set<std::string> names = refuted(all, found);
    if (names.empty()) return described(all, found);
    all.excluded.insert(names.begin(), names.end());
  }
}

}  // namespace swarmcert::evidence
