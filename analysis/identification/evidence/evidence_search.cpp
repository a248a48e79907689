#include "analysis/identification/evidence/evidence_search.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmcert::evidence {
namespace {

constexpr double kNatsPerBit = 0.6931471805599453;
constexpr std::size_t kMostExplanations = 8;

double log_determinant(const Eigen::MatrixXd& positive) {
  return 2 * Eigen::LLT<Eigen::MatrixXd>(positive).matrixLLT().diagonal().array().abs().log().sum();
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

bool has_entry(const Set& set, std::size_t entry) {
  return std::any_of(set.begin(), set.end(), [&](const Item& item) { return item.entry == entry; });
}

int size_of(const Hypotheses& all, const Set& set) {
  int size = 0;
  for (const Item& item : set) size += all.entries[item.entry].size;
  return size;
}

/// Joins the priors of the items of a set.
Prior joined(const Hypotheses& all, const Set& set) {
  const int size = size_of(all, set);
  Prior prior{Eigen::VectorXd::Zero(size), Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  Eigen::Index first = 0;
  for (const Item& item : set) {
    const Prior part = all.prior_of(item);
    const Eigen::Index n = part.mean.size();
    prior.mean.segment(first, n) = part.mean;
    prior.sign.segment(first, n) = part.sign;
    prior.precision.block(first, first, n, n) = part.precision;
    first += n;
  }
  return prior;
}

/// Returns an orthonormal basis of the columns, without directions that hardly any column has.
Eigen::MatrixXd orthonormal_basis(Eigen::MatrixXd columns) {
  constexpr double kLeast = 1e-5;  // of the largest eigenvalue, of columns of equal length
  for (Eigen::Index c = 0; c < columns.cols(); ++c)
    columns.col(c) /= std::max(columns.col(c).norm(), std::numeric_limits<double>::min());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(columns.transpose() * columns);
  const Eigen::VectorXd& all = parts.eigenvalues();
  const Eigen::Index rank = (all.array() > kLeast * all.maxCoeff()).count();
  return columns * parts.eigenvectors().rightCols(rank) *
         all.tail(rank).cwiseSqrt().cwiseInverse().asDiagonal();
}

}  // namespace

Eigen::VectorXd EvidenceSearch::noise_beside(const Weighed& set) const {
  std::array<Eigen::VectorXf, 3> left = all_.residual_N;
  Eigen::Index first = 0;
  for (const Item& item : set.set) {
    const Entry& entry = all_.entries[item.entry];
    const Eigen::VectorXf own = set.coefficients.segment(first, entry.size).cast<float>();
    for (std::size_t axis = 0; axis < 3; ++axis)
      left[axis] -= all_.columns[axis].middleCols(entry.first_column[item.shape], entry.size) * own;
    first += entry.size;
  }
  const std::vector<Band>& bands = all_.spectral.bands();
  Eigen::VectorXd squares_N2(static_cast<Eigen::Index>(3 * bands.size()));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t b = 0; b < bands.size(); ++b)
      squares_N2[static_cast<Eigen::Index>(axis * bands.size() + b)] =
          left[axis].segment(bands[b].first, bands[b].count).cast<double>().squaredNorm();
  }
  return all_.noise.power(squares_N2);
}

void EvidenceSearch::project(const Weighed& beside) {
  const std::vector<Band>& bands = all_.spectral.bands();
  const Eigen::VectorXd S = noise_beside(beside);
  std::array<Eigen::MatrixXf, 3> columns;
  std::array<Eigen::VectorXf, 3> data;
  Eigen::Index numbers = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Eigen::VectorXd weight(all_.spectral.rows());
    for (std::size_t b = 0; b < bands.size(); ++b)
      weight.segment(bands[b].first, bands[b].count)
          .setConstant(1 / std::sqrt(S[static_cast<Eigen::Index>(axis * bands.size() + b)]));
    const Eigen::MatrixXd basis =
        orthonormal_basis(weight.asDiagonal() * all_.instruments[axis].cast<double>());
    const Eigen::MatrixXf weighted = (weight.asDiagonal() * basis).cast<float>();
    columns[axis] = weighted.transpose() * all_.columns[axis];
    data[axis] = weighted.transpose() * all_.residual_N[axis];
    numbers += data[axis].size();
  }
  columns_.resize(numbers, columns[0].cols());
  data_.resize(numbers);
  columns_ << columns[0].cast<double>(), columns[1].cast<double>(), columns[2].cast<double>();
  data_ << data[0].cast<double>(), data[1].cast<double>(), data[2].cast<double>();
}

Weighed EvidenceSearch::weigh(const Set& set) const {
  Weighed result{set, -data_.squaredNorm() / 2, {}, {}};
  if (set.empty()) return result;
  const Prior prior = joined(all_, set);
  Eigen::MatrixXd x(columns_.rows(), prior.mean.size());
  Eigen::Index first = 0;
  for (const Item& item : set) {
    const Entry& entry = all_.entries[item.entry];
    x.middleCols(first, entry.size) = columns_.middleCols(entry.first_column[item.shape], entry.size);
    first += entry.size;
  }
  const Eigen::MatrixXd hessian = x.transpose() * x + prior.precision;
  result.covariance = hessian.inverse();
  result.coefficients = result.covariance * (x.transpose() * data_ + prior.precision * prior.mean);
  const Eigen::VectorXd off = result.coefficients - prior.mean;
  result.score = -((data_ - x * result.coefficients).squaredNorm() + off.dot(prior.precision * off)) / 2 +
                 (log_determinant(prior.precision) - log_determinant(hessian)) / 2;
  for (Eigen::Index i = 0; i < off.size(); ++i) {
    if (prior.sign[i] == 0) continue;
    result.score +=
        log_normal_cdf(prior.sign[i] * result.coefficients[i] / std::sqrt(result.covariance(i, i))) -
        log_normal_cdf(prior.sign[i] * prior.mean[i] * std::sqrt(prior.precision(i, i)));
  }
  for (const Item& item : set) result.score += all_.log_prior(item);
  return result;
}

std::vector<Option> EvidenceSearch::options(const Set& set) const {
  std::vector<Option> result;
  for (std::size_t e = 0; e < all_.entries.size(); ++e) {
    if (has_entry(set, e)) continue;
    std::vector<Option> all;
    for (std::size_t shape = 0; shape < all_.entries[e].first_column.size(); ++shape) {
      for (std::size_t scale = 0; scale < all_.entries[e].scales.size(); ++scale) {
        const Item item{e, shape, scale};
        all.push_back({item, weigh(with(set, item)).score});
      }
    }
    Option best = *std::max_element(all.begin(), all.end(),
                                    [](const Option& a, const Option& b) { return a.score < b.score; });
    double sum = 0;
    for (const Option& option : all) sum += std::exp(option.score - best.score);
    best.score += std::log(sum);
    result.push_back(best);
  }
  std::sort(result.begin(), result.end(), [](const Option& a, const Option& b) { return a.score > b.score; });
  return result;
}

Weighed EvidenceSearch::changed(const Weighed& now, std::size_t index) const {
  const Set rest = without(now.set, index);
  Weighed removed = weigh(rest);
  if (removed.score > now.score) return removed;
  const Option other = options(rest).front();
  if (other.score > now.score + kExchanged_bits * kNatsPerBit && !(other.item == now.set[index]))
    return weigh(with(rest, other.item));
  return now;
}

std::vector<Option> EvidenceSearch::instead_of(const Weighed& best, std::size_t index) const {
  std::vector<Option> result;
  for (const Option& option : options(without(best.set, index))) {
    const bool is_effect = all_.entries[option.item.entry].kind == Kind::kEffect;
    const bool is_close = option.score > best.score - kNamed_bits * kNatsPerBit;
    if (is_effect && is_close && option.item.entry != best.set[index].entry) result.push_back(option);
  }
  return result;
}

Weighed EvidenceSearch::improved(Weighed now) const {
  for (std::size_t i = 0; i < now.set.size(); ++i) {
    Weighed next = changed(now, i);
    if (!(next.score > now.score)) continue;
    now = std::move(next);
    i = static_cast<std::size_t>(-1);  // from the beginning
  }
  return now;
}

Weighed EvidenceSearch::best() {
  Weighed now;
  for (;;) {
    project(now);
    now = improved(weigh(now.set));
    const std::vector<Option> all = options(now.set);
    if (now.set.size() == kMostExplanations || all.front().score < now.score + kNamed_bits * kNatsPerBit)
      return now;
    now = weigh(with(now.set, all.front().item));
  }
}

}  // namespace swarmcert::evidence
