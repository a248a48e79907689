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

std::vector<Finding> findings(const CrossValidation& fits, const Members& members) {
  std::vector<Finding> result;
  Members prefix;
  for (std::size_t i = 0; i < members.size(); ++i) {
    Finding finding;
    finding.member = members[i];
    finding.support = fits.support(members[i]);
    const std::vector<double> before = fits.block_errors(prefix);
    prefix.push_back(members[i]);
    const std::vector<double> after = fits.block_errors(prefix);
    finding.rmse_before_N = std::sqrt(sum_of(before) / fits.records());
    finding.rmse_after_N = std::sqrt(sum_of(after) / fits.records());
    finding.drop_interval = drop_interval(before, after);
    const Members rest = without(members, i);
    const Members last = with(rest, members[i]);
    finding.paired_z = paired_z(fits.block_errors(rest), fits.block_errors(last));
    finding.wald_z = fits.wald(last);
    const Eigen::Index p = fits.candidate(members[i]).columns();
    const std::size_t blocks = fits.grams().blocks.size();
    finding.evidence_bits = (log_likelihood_ratio(finding.wald_z * finding.wald_z, blocks) -
                             static_cast<double>(p) / 2 * std::log(static_cast<double>(blocks))) /
                            std::log(2.0);
    const Eigen::VectorXd own = fits.in_model(last, fits.coefficients(last)).tail(p);
    for (Eigen::Index c = 0; c < p; ++c) finding.model_form.emplace_back(own[c], own[c]);
    for (const Eigen::VectorXd& fold : fits.fold_coefficients(last))
      widen(finding.model_form, fits.in_model(last, fold).tail(p));
    result.push_back(std::move(finding));
  }
  return result;
}

}  // namespace swarmcert::identification
