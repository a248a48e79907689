#include "analysis/identification/findings.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "analysis/identification/covariance.h"
#include "analysis/identification/scan/formulas.h"
#include "analysis/residuals/statistics.h"
#include "nn/base/doubles.h"

namespace swarmcert::identification {
namespace {

double sum_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

Interval drop_interval(const std::vector<double>& before, const std::vector<double>& after) {
  std::mt19937_64 generator(1);
  std::vector<double> drops;
  for (int i = 0; i < 200; ++i) {
    double a = 0, b = 0;
    for (std::size_t k = 0; k < before.size(); ++k) {
      const std::size_t j = generator() % before.size();
      b += before[j];
      a += after[j];
    }
    drops.push_back(1 - std::sqrt(std::max(a, 0.0) / b));
  }
  return {residuals::quantile(drops, 0.05), residuals::quantile(drops, 0.95)};
}

void widen(std::vector<Interval>& spread, const Eigen::VectorXd& values) {
  for (std::size_t c = 0; c < spread.size(); ++c) {
    spread[c].lower = std::min(spread[c].lower, values[static_cast<Eigen::Index>(c)]);
    spread[c].upper = std::max(spread[c].upper, values[static_cast<Eigen::Index>(c)]);
  }
}

/// Returns `members` with the last one at the best theta of its grid, because rivals are not refined either.
Members on_grid(const Selection& selection, const Members& members) {
  const Candidate& candidate = selection.candidate(members.back());
  const auto count = static_cast<int>(candidate.thetas.size() - candidate.refined_thetas);
  const Members rest = without(members, members.size() - 1);
  Members best = members;
  double least = kInfinity;
  for (int theta = 0; theta < count; ++theta) {
    Members tried = with(rest, {members.back().candidate, theta});
    const double square = selection.mean_square(tried);
    if (square >= least) continue;
    least = square;
    best = std::move(tried);
  }
  return best;
}

/// Finds rivals of the last of `members`: they keep at least half of its gain, and the data do not clearly prefer it.
void find_rivals(const Selection& selection, const Members& members, Finding& finding) {
  constexpr double kClearlyBetter_z = 2, kShare = 0.5;
  const Members rest = without(members, members.size() - 1);
  const double rest_square = selection.mean_square(rest), full_square = selection.mean_square(members);
  const std::vector<double> full_errors = selection.block_errors(on_grid(selection, members));
  const Eigen::Index p = selection.candidate(members.back()).columns();
  for (int q = 0; q < static_cast<int>(selection.grams().candidates.size()); ++q) {
    if (selection.is_present(members, q)) continue;
    if (is_formula(selection.grams().candidates[static_cast<std::size_t>(q)].name)) continue;
    const Member rival = selection.best_theta(rest, q);
    const Members instead = with(rest, rival);
    const bool explains = rest_square - selection.mean_square(instead) > kShare * (rest_square - full_square);
    if (!explains) continue;
    const Candidate& other = selection.candidate(rival);
    // A constant force for all and one per vehicle have the same name.
    const bool is_known = std::any_of(finding.rivals.begin(), finding.rivals.end(),
                                      [&](const Rival& r) { return r.effect == other.name; });
    if (!is_known && paired_z(selection.block_errors(instead), full_errors) < kClearlyBetter_z) {
      const double kept = (rest_square - selection.mean_square(instead)) / (rest_square - full_square);
      const double squared = finding.wald_z * finding.wald_z;
      finding.rivals.push_back({other.name, other.info.excitation,
                                std::exp(log_likelihood_ratio(kept * squared, full_errors.size()) -
                                         log_likelihood_ratio(squared, full_errors.size()))});
    }
    const Members both = with(instead, members.back());
    widen(finding.model_form, selection.in_model(both, selection.coefficients(both)).tail(p));
  }
}

}  // namespace

double log_likelihood_ratio(double squared_wald, std::size_t blocks) {
  const auto n = static_cast<double>(blocks);
  return n / 2 * std::log1p(squared_wald / n);
}

std::vector<std::string> Finding::confounded_with() const {
  std::vector<std::string> names;
  for (const Rival& rival : rivals) names.push_back(rival.effect);
  return names;
}

std::vector<Finding> findings(const Selection& selection, const Members& members) {
  std::vector<Finding> result;
  Members prefix;
  for (std::size_t i = 0; i < members.size(); ++i) {
    Finding finding;
    finding.member = members[i];
    finding.support = selection.support(members[i]);
    const std::vector<double> before = selection.block_errors(prefix);
    prefix.push_back(members[i]);
    const std::vector<double> after = selection.block_errors(prefix);
    finding.rmse_before_N = std::sqrt(sum_of(before) / selection.records());
    finding.rmse_after_N = std::sqrt(sum_of(after) / selection.records());
    finding.drop_interval = drop_interval(before, after);
    const Members rest = without(members, i);
    const Members last = with(rest, members[i]);
    finding.paired_z = paired_z(selection.block_errors(rest), selection.block_errors(last));
    finding.wald_z = selection.wald(last);
    const Eigen::Index p = selection.candidate(members[i]).columns();
    const std::size_t blocks = selection.grams().blocks.size();
    finding.evidence_bits = (log_likelihood_ratio(finding.wald_z * finding.wald_z, blocks) -
                             static_cast<double>(p) / 2 * std::log(static_cast<double>(blocks))) /
                            std::log(2.0);
    const Eigen::VectorXd own = selection.in_model(last, selection.coefficients(last)).tail(p);
    for (Eigen::Index c = 0; c < p; ++c) finding.model_form.emplace_back(own[c], own[c]);
    for (const Eigen::VectorXd& fold : selection.fold_coefficients(last))
      widen(finding.model_form, selection.in_model(last, fold).tail(p));
    find_rivals(selection, last, finding);
    result.push_back(std::move(finding));
  }
  return result;
}

}  // namespace swarmcert::identification
