#include "analysis/identification/evidence/evidence_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "nn/base/doubles.h"

namespace swarmcert::evidence {
namespace {

const double kNatsPerBit = std::log(2.0);
constexpr std::size_t kMostExplanations = 8;

/// Returns 1/2 ln det of a factored matrix.
double half_log_determinant(const Eigen::LLT<Eigen::MatrixXd>& factor) {
  return factor.matrixLLT().diagonal().array().log().sum();
}

/// ln of the normal distribution function.
double log_normal_cdf(double z) {
  const double half = std::erfc(-z / std::sqrt(2.0)) / 2;
  return half > 1e-30 ? std::log(half) : -z * z / 2 - 4;
}

Set without(const Set& set, std::size_t index) {
  Set rest = set;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(index));
  return rest;
}

Set with(Set set, const Item& item) {
  set.push_back(item);
  return set;
}

/// Returns whether both describe the wake of a neighbour, of which there is one.
bool is_same_wake(const Hypotheses& all, std::size_t a, std::size_t b) {
  const auto is_wake = [&](std::size_t entry) {
    if (all.entries[entry].kind != Kind::kEffect) return false;
    const stability::EffectTraits& traits = all.candidates[entry].info.traits;
    return traits.family == stability::Family::kWake || traits.reduces_to == stability::Family::kWake;
  };
  return is_wake(a) && is_wake(b);
}

/// Returns whether a set has the entry, or one that excludes it.
bool has_entry(const Hypotheses& all, const Set& set, std::size_t entry) {
  return std::any_of(set.begin(), set.end(), [&](const Item& item) {
    return all.entries[item.entry].name == all.entries[entry].name || is_same_wake(all, item.entry, entry);
  });
}

int size_of(const Hypotheses& all, const Set& set) {
  int size = 0;
  for (const Item& item : set) size += all.entries[item.entry].size;
  return size;
}

bool is_effect(const Hypotheses& all, const Item& item) {
  return all.entries[item.entry].kind == Kind::kEffect;
}

/// Returns whether an item is a curve over the variable of an effect.
bool is_form_of(const Hypotheses& all, const Item& curve, const Item& effect) {
  return !is_effect(all, curve) && is_effect(all, effect) &&
         all.candidates[effect.entry].info.traits.varies_with(all.entries[curve.entry].variable);
}

}  // namespace

std::vector<int> EvidenceSearch::columns_of(const Set& set) const {
  std::vector<int> columns;
  for (const Item& item : set) {
    const Entry& entry = all_.entries[item.entry];
    for (int c = 0; c < entry.size; ++c) columns.push_back(entry.first_column[item.shape] + c);
  }
  return columns;
}

Prior EvidenceSearch::prior_of(const Set& set) const {
  const int size = size_of(all_, set);
  Prior prior{Eigen::VectorXd::Zero(size), Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  Eigen::Index first = 0;
  for (const Item& item : set) {
    const Prior& part = all_.prior_of(item);
    const Eigen::Index n = part.mean.size();
    prior.mean.segment(first, n) = part.mean;
    prior.sign.segment(first, n) = part.sign;
    prior.precision.block(first, first, n, n) = part.precision;
    first += n;
  }
  return prior;
}

Eigen::VectorXd EvidenceSearch::left_by(const Weighed& found) const {
  const std::vector<int> columns = columns_of(found.set);
  Eigen::VectorXd left = data_.data().cast<double>();
  for (std::size_t c = 0; c < columns.size(); ++c)
    left -= found.coefficients[static_cast<Eigen::Index>(c)] * data_.columns().col(columns[c]).cast<double>();
  return left;
}

Normal EvidenceSearch::normal_of(const Set& set) const {
  const int size = size_of(all_, set);
  Normal normal{Eigen::MatrixXd(size, size), Eigen::VectorXd(size)};
  int row = 0;
  for (std::size_t i = 0; i < set.size(); ++i) {
    const Entry& one = all_.entries[set[i].entry];
    const int first = one.first_column[set[i].shape];
    normal.b.segment(row, one.size) = data_.with_data().segment(first, one.size);
    normal.gram.block(row, row, one.size, one.size) = data_.within(first, one.size);
    int column = row + one.size;
    for (std::size_t k = i + 1; k < set.size(); ++k) {
      const Entry& other = all_.entries[set[k].entry];
      const auto products =
          data_.with_all(first, one.size).middleRows(other.first_column[set[k].shape], other.size);
      normal.gram.block(column, row, other.size, one.size) = products;
      normal.gram.block(row, column, one.size, other.size) = products.transpose();
      column += other.size;
    }
    row += one.size;
  }
  return normal;
}

double EvidenceSearch::noise_beside(double left) const {
  return std::max(1.0, left / static_cast<double>(data_.data().size()));
}

double EvidenceSearch::log_likelihood(double left) const {
  const double noise = noise_beside(left);
  return -left / (2 * noise) - static_cast<double>(data_.data().size()) / 2 * std::log(noise);
}

Weighed EvidenceSearch::weigh(const Set& set) const {
  Weighed result{set, 0, data_.data_square(), {}, {}};
  if (set.empty()) {
    result.score = log_likelihood(result.left);
    return result;
  }
  const Prior prior = prior_of(set);
  const Normal normal = normal_of(set);
  const Eigen::VectorXd pull = normal.b + prior.precision * prior.mean;
  const Eigen::LLT<Eigen::MatrixXd> hessian(normal.gram + prior.precision), precision(prior.precision);
  result.coefficients = hessian.solve(pull);
  result.left -= pull.dot(result.coefficients) - prior.mean.dot(prior.precision * prior.mean);
  result.covariance =
      noise_beside(result.left) * hessian.solve(Eigen::MatrixXd::Identity(pull.size(), pull.size()));
  result.score =
      log_likelihood(result.left) + half_log_determinant(precision) - half_log_determinant(hessian);
  for (Eigen::Index i = 0; i < pull.size(); ++i) {
    if (prior.sign[i] == 0) continue;
    result.score +=
        log_normal_cdf(prior.sign[i] * result.coefficients[i] / std::sqrt(result.covariance(i, i))) -
        log_normal_cdf(prior.sign[i] * prior.mean[i] * std::sqrt(prior.precision(i, i)));
  }
  for (const Item& item : set) result.score += all_.log_prior(item);
  return result;
}

Option EvidenceSearch::option(const Set& set, std::size_t entry) const {
  std::vector<Option> all;
  for (std::size_t shape = 0; shape < all_.entries[entry].first_column.size(); ++shape) {
    for (std::size_t prior = 0; prior < all_.entries[entry].priors.size(); ++prior) {
      const Item item{entry, shape, prior};
      all.push_back({item, weigh(with(set, item)).score});
    }
  }
  Option best = *std::max_element(all.begin(), all.end(),
                                  [](const Option& a, const Option& b) { return a.score < b.score; });
  double sum = 0;
  for (const Option& other : all) sum += std::exp(other.score - best.score);
  best.score += std::log(sum);
  return best;
}

bool EvidenceSearch::may_add(const Set& set, std::size_t entry) const {
  return !has_entry(all_, set, entry) && all_.excluded.count(all_.entries[entry].name) == 0;
}

double EvidenceSearch::size_for(double bits, const Set& set, const Item& item, int coefficient) const {
  constexpr double kNineOfTen_z = 1.2816;
  const Set joined = with(set, item);
  const Eigen::MatrixXd all =
      normal_of(joined).gram / noise_beside(weigh(set).left) + prior_of(joined).precision;
  const Prior& prior = all_.prior_of(item);
  const Eigen::MatrixXd& P = prior.precision;
  const Eigen::Index n = P.rows(), others = all.rows() - n;
  const Eigen::MatrixXd H = all.bottomRightCorner(n, n) -
                            all.bottomLeftCorner(n, others) *
                                all.topLeftCorner(others, others).llt().solve(all.topRightCorner(others, n));
  const Eigen::VectorXd g = (H - P).col(coefficient), pull = P * prior.mean;
  const Eigen::LLT<Eigen::MatrixXd> hessian(H);
  // The evidence rises by square c^2 + linear c + constant.
  const double square = g.dot(hessian.solve(g)) / 2, linear = g.dot(hessian.solve(pull));
  const double constant = (pull.dot(hessian.solve(pull)) - pull.dot(prior.mean)) / 2 +
                          half_log_determinant(Eigen::LLT<Eigen::MatrixXd>(P)) -
                          half_log_determinant(hessian) + all_.log_prior(item);
  if (!(square > 0) || !(g[coefficient] > 0)) return kInfinity;
  const double missing = std::max(bits * kNatsPerBit - constant, 0.0);
  const double estimate = (std::sqrt(linear * linear + 4 * square * missing) - linear) / (2 * square);
  return estimate + kNineOfTen_z / std::sqrt(g[coefficient]);
}

std::vector<Option> EvidenceSearch::options(const Set& set) const {
  std::vector<Option> result;
  for (std::size_t e = 0; e < all_.entries.size(); ++e) {
    if (may_add(set, e)) result.push_back(option(set, e));
  }
  std::sort(result.begin(), result.end(), [](const Option& a, const Option& b) { return a.score > b.score; });
  return result;
}

double EvidenceSearch::bits(const Weighed& best, std::size_t index) const {
  const Set rest = without(best.set, index);
  return (option(rest, best.set[index].entry).score - weigh(rest).score) / kNatsPerBit;
}

std::vector<Option> EvidenceSearch::instead_of(const Weighed& best, std::size_t index) const {
  std::vector<Option> result;
  const auto by_flights = [&](double score, const Item& item) {
    return score + all_.entries[item.entry].doubt;
  };
  const double least = by_flights(best.score, best.set[index]) - kNamed_bits * kNatsPerBit;
  for (const Option& option : options(without(best.set, index))) {
    const bool is_close = by_flights(option.score, option.item) > least;
    if (is_effect(all_, option.item) && is_close && option.item.entry != best.set[index].entry)
      result.push_back(option);
  }
  return result;
}

double EvidenceSearch::needed_bits(const Weighed& now) const {
  return std::max(kNamed_bits, kModelError * (data_.data_square() - now.left) / 2 / kNatsPerBit);
}

bool EvidenceSearch::shows_form(const Weighed& named, std::size_t index, const Item& curve,
                                const Weighed& free) const {
  constexpr double kLeft = 0.75, kLeftByForm = 0.5, kOfEvidence = 1.0 / 8;
  const double gained_bits = (free.score - named.score) / kNatsPerBit;
  if (gained_bits < needed_bits(named)) return false;
  const bool is_form = is_form_of(all_, curve, named.set[index]);
  const bool is_rest_noise = noise_beside(free.left) == 1;
  return free.left < (is_form ? kLeftByForm : kLeft) * named.left ||
         (is_rest_noise && gained_bits > kOfEvidence * bits(named, index));
}

bool EvidenceSearch::may_follow(const Weighed& now, const Option& added) const {
  if (added.score < now.score + needed_bits(now) * kNatsPerBit) return false;
  if (is_effect(all_, added.item)) return true;
  const Weighed joined = weigh(with(now.set, added.item));
  for (std::size_t i = 0; i < now.set.size(); ++i) {
    if (!is_effect(all_, now.set[i])) continue;
    const bool takes_name = is_form_of(all_, added.item, now.set[i]) || bits(joined, i) < needed_bits(joined);
    if (takes_name && !shows_form(now, i, added.item, joined)) return false;
  }
  return true;
}

Set EvidenceSearch::changed(const Weighed& now, std::size_t index) const {
  const Item& item = now.set[index];
  if (bits(now, index) < needed_bits(now)) return without(now.set, index);
  const Weighed rest = weigh(without(now.set, index));
  const auto is_better = [&](const Option& other) {
    if (other.item == item || !may_follow(rest, other)) return false;
    const Set exchanged = with(rest.set, other.item);
    if (is_effect(all_, item) && !is_effect(all_, other.item))
      return shows_form(now, index, other.item, weigh(exchanged));
    if (is_form_of(all_, item, other.item)) return !shows_form(weigh(exchanged), rest.set.size(), item, now);
    return other.score > now.score + kExchanged_bits * kNatsPerBit;
  };
  const std::vector<Option> others = options(rest.set);
  const auto other = std::find_if(others.begin(), others.end(), is_better);
  return other == others.end() ? now.set : with(rest.set, other->item);
}

Weighed EvidenceSearch::next(const Weighed& now) const {
  const bool has_room = now.set.size() < kMostExplanations;
  const std::vector<Option> added = has_room ? options(now.set) : std::vector<Option>();
  const auto best = [&](bool is_name) {
    return std::find_if(added.begin(), added.end(), [&](const Option& option) {
      return is_effect(all_, option.item) == is_name && may_follow(now, option);
    });
  };
  if (const auto name = best(true); name != added.end()) return weigh(with(now.set, name->item));
  // No further effect: the set is complete enough to be judged.
  for (std::size_t i = 0; i < now.set.size(); ++i) {
    const Set other = changed(now, i);
    if (!(other == now.set)) return weigh(other);
  }
  const auto curve = best(false);
  return curve == added.end() ? now : weigh(with(now.set, curve->item));
}

}  // namespace swarmcert::evidence
