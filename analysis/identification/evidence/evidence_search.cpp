#include "analysis/identification/evidence/evidence_search.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace swarmcert::evidence {
namespace {

const double kNatsPerBit = std::log(2.0);
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

bool is_effect(const Hypotheses& all, const Item& item) {
  return all.entries[item.entry].kind == Kind::kEffect;
}

/// Returns the best effect with at least this score, else the best of all.
/// @param options best first; not empty
Option preferred(const Hypotheses& all, const std::vector<Option>& options, double least) {
  for (const Option& option : options) {
    if (option.score >= least && is_effect(all, option.item)) return option;
  }
  return options.front();
}

/// Expands numbers by band to rows of the transform.
Eigen::VectorXd by_row(const Spectral& spectral, const Eigen::VectorXd& by_band) {
  Eigen::VectorXd result(spectral.rows());
  for (std::size_t b = 0; b < spectral.bands().size(); ++b) {
    const Band& band = spectral.bands()[b];
    result.segment(band.first, band.count).setConstant(by_band[static_cast<Eigen::Index>(b)]);
  }
  return result;
}

/// Returns the sums of squares of rows over each band.
Eigen::VectorXd by_band(const Spectral& spectral, const Eigen::VectorXd& squares) {
  Eigen::VectorXd result(static_cast<Eigen::Index>(spectral.bands().size()));
  for (std::size_t b = 0; b < spectral.bands().size(); ++b) {
    const Band& band = spectral.bands()[b];
    result[static_cast<Eigen::Index>(b)] = squares.segment(band.first, band.count).sum();
  }
  return result;
}

/// Returns the power of the noise by cell, from the part of the residual that instruments do not span. What they span
/// depends on the power, so that both are found in turn.
Eigen::VectorXd noise_beside_instruments(const Hypotheses& all) {
  constexpr int kRounds = 3;
  const auto bands = static_cast<Eigen::Index>(all.spectral.bands().size());
  Eigen::VectorXd power = Eigen::VectorXd::Ones(3 * bands), squares_N2(3 * bands),
                  counts = all.noise.counts();
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Eigen::Index first = static_cast<Eigen::Index>(axis) * bands;
      const Eigen::VectorXd weight =
          by_row(all.spectral, power.segment(first, bands).cwiseSqrt().cwiseInverse());
      const Eigen::MatrixXd basis =
          orthonormal_basis(weight.asDiagonal() * all.instruments[axis].cast<double>());
      Eigen::VectorXd left = weight.cwiseProduct(all.residual_N[axis].cast<double>());
      left -= basis * (basis.transpose() * left);
      squares_N2.segment(first, bands) = by_band(all.spectral, left.cwiseQuotient(weight).cwiseAbs2());
      counts.segment(first, bands) =
          all.noise.counts().segment(first, bands) - by_band(all.spectral, basis.rowwise().squaredNorm());
    }
    power = all.noise.power(squares_N2, counts);
  }
  return power;
}

}  // namespace

EvidenceSearch::EvidenceSearch(const Hypotheses& all) : all_(all) {
  const Eigen::VectorXd power = noise_beside_instruments(all);
  const auto bands = static_cast<Eigen::Index>(all.spectral.bands().size());
  std::array<Eigen::MatrixXd, 3> parts;
  Eigen::Index numbers = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    parts[axis] = projected(axis, power.segment(static_cast<Eigen::Index>(axis) * bands, bands));
    numbers += parts[axis].rows();
  }
  Eigen::MatrixXd joined(numbers, parts[0].cols());
  joined << parts[0], parts[1], parts[2];
  columns_ = joined.leftCols(joined.cols() - 1);
  data_ = joined.rightCols<1>();
}

Eigen::MatrixXd EvidenceSearch::projected(std::size_t axis, const Eigen::VectorXd& power) const {
  const Eigen::VectorXd weight = by_row(all_.spectral, power.cwiseSqrt().cwiseInverse());
  const Eigen::MatrixXd basis =
      orthonormal_basis(weight.asDiagonal() * all_.instruments[axis].cast<double>());
  const Eigen::MatrixXf weighted = (weight.asDiagonal() * basis).cast<float>();
  Eigen::MatrixXf result(basis.cols(), all_.columns[axis].cols() + 1);
  result << weighted.transpose() * all_.columns[axis], weighted.transpose() * all_.residual_N[axis];
  return result.cast<double>();
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
  const bool loses_name = is_effect(all_, now.set[index]) && !is_effect(all_, other.item);
  const double needed_bits = loses_name ? kNamed_bits : kExchanged_bits;
  if (other.score > now.score + needed_bits * kNatsPerBit && !(other.item == now.set[index]))
    return weigh(with(rest, other.item));
  return now;
}

std::vector<Option> EvidenceSearch::instead_of(const Weighed& best, std::size_t index) const {
  std::vector<Option> result;
  for (const Option& option : options(without(best.set, index))) {
    const bool is_close = option.score > best.score - kNamed_bits * kNatsPerBit;
    if (is_effect(all_, option.item) && is_close && option.item.entry != best.set[index].entry)
      result.push_back(option);
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

Weighed EvidenceSearch::best() const {
  Weighed now = weigh({});
  bool is_improved = true;
  while (now.set.size() < kMostExplanations) {
    const double least = now.score + kNamed_bits * kNatsPerBit;
    const Option next = preferred(all_, options(now.set), least);
    const bool adds_effect = next.score >= least && is_effect(all_, next.item);
    if (!adds_effect && !is_improved) {  // no further effect: the set is complete enough to be judged
      now = improved(std::move(now));
      is_improved = true;
      continue;
    }
    if (next.score < least) return now;
    now = weigh(with(now.set, next.item));
    is_improved = false;
  }
  return improved(std::move(now));
}

}  // namespace swarmcert::evidence
