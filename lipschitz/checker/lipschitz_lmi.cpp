#include "lipschitz/checker/lipschitz_lmi.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "lipschitz/checker/integer_rows.h"
#include "lipschitz/checker/proposed_factor.h"

namespace swarmcert::check {
namespace {

Matrix transposed(const Matrix& a) {
  Matrix result(a.cols, a.rows);
  for (int i = 0; i < a.rows; ++i) {
    for (int j = 0; j < a.cols; ++j) result(j, i) = a(i, j);
  }
  return result;
}

/// A matrix stored as integers: row i is (row i of `rows`) 2^exponents[i], exactly.
struct ScaledRows {
  std::vector<long> exponents;
  IntegerRows rows;
};

ScaledRows scaled_rows(const Matrix& a) {
  std::vector<long> exponents;
  std::vector<std::vector<mpz_class>> rows;
  for (int i = 0; i < a.rows; ++i) {
    long least = std::numeric_limits<long>::max();
    for (int k = 0; k < a.cols; ++k)
      if (a(i, k).sign() != 0) least = std::min(least, a(i, k).exponent);
    exponents.push_back(least == std::numeric_limits<long>::max() ? 0 : least);
    rows.emplace_back(a.cols);
    for (int k = 0; k < a.cols; ++k) {
      const Dyadic& entry = a(i, k);
      if (entry.sign() != 0)
        rows.back()[k] = entry.mantissa << static_cast<mp_bitcnt_t>(entry.exponent - exponents.back());
    }
  }
  return {std::move(exponents), IntegerRows(std::move(rows))};
}

/// A A'.
Matrix row_gram(const Matrix& a) {
  const ScaledRows scaled = scaled_rows(a);
  Matrix result(a.rows, a.rows);
  for (int i = 0; i < a.rows; ++i) {
    for (int j = 0; j <= i; ++j) {
      result(i, j) = Dyadic(scaled.rows.inner(i, 0, scaled.rows, j, 0, a.cols),
                            scaled.exponents[i] + scaled.exponents[j]);
      result(j, i) = result(i, j);
    }
  }
  return result;
}

}  // namespace

Matrix product(const Matrix& a, const Matrix& b) {
  const ScaledRows rows = scaled_rows(a), columns = scaled_rows(transposed(b));
  Matrix c(a.rows, b.cols);
  for (int i = 0; i < a.rows; ++i) {
    for (int j = 0; j < b.cols; ++j)
      c(i, j) =
          Dyadic(rows.rows.inner(i, 0, columns.rows, j, 0, a.cols), rows.exponents[i] + columns.exponents[j]);
  }
  return c;
}

std::size_t hidden_neurons(const std::vector<Matrix>& stages) {
  std::size_t neurons = 0;
  for (std::size_t k = 0; k + 1 < stages.size(); ++k) neurons += static_cast<std::size_t>(stages[k].rows);
  return neurons;
}

SymmetricMatrix::SymmetricMatrix(std::vector<int> first) : first_(std::move(first)) {
  for (std::size_t i = 0; i < first_.size(); ++i)
    rows_.emplace_back(i + 1 - static_cast<std::size_t>(first_[i]));
}

SymmetricMatrix::SymmetricMatrix(const Matrix& dense) {
  for (int i = 0; i < dense.rows; ++i) {
    int first = 0;
    while (first < i && dense(i, first).sign() == 0) ++first;
    first_.push_back(first);
    rows_.emplace_back();
    for (int j = first; j <= i; ++j) rows_.back().push_back(dense(i, j));
  }
}

namespace {

/// Returns the first column of each row of the chain's inequality, which is where the previous layer begins.
std::vector<int> chain_envelope(const std::vector<Matrix>& stages) {
  std::vector<int> first;
  int before = 0, begin = 0;
  for (std::size_t k = 0; k + 1 < stages.size(); ++k) {
    first.insert(first.end(), static_cast<std::size_t>(stages[k].rows), before);
    before = begin;
    begin += stages[k].rows;
  }
  return first;
}

}  // namespace

SymmetricMatrix lipschitz_lmi(const std::vector<Matrix>& stages, const Dyadic& rho,
                              const std::vector<Dyadic>& t) {
  const std::size_t hidden = stages.size() - 1;
  const Matrix& first = stages.front();
  const Matrix& last = stages.back();
  if (hidden == 0) {
    Matrix p = row_gram(first.rows <= first.cols ? first : transposed(first));
    for (Dyadic& entry : p.entries) entry = -entry;
    for (int i = 0; i < p.rows; ++i) p(i, i) += rho;
    return p;
  }
  SymmetricMatrix p(chain_envelope(stages));
  for (int i = 0; i < p.size(); ++i) p.at(i, i) = Dyadic(2.0) * rho * t[i];

  const Matrix first_gram = row_gram(first);
  for (int i = 0; i < first.rows; ++i) {
    for (int j = 0; j <= i; ++j) p.at(i, j) += -(t[i] * first_gram(i, j) * t[j]);
  }
  int before = 0;  // index of the first neuron of layer k - 1
  for (std::size_t k = 1; k < hidden; ++k) {
    const Matrix& m = stages[k];
    const int begin = before + m.cols;
    for (int i = 0; i < m.rows; ++i) {
      const Dyadic factor = -(rho * t[begin + i]);
      for (int j = 0; j < m.cols; ++j) p.at(begin + i, before + j) = factor * m(i, j);
    }
    before = begin;
  }
  const Matrix last_gram = row_gram(transposed(last));
  for (int i = 0; i < last.cols; ++i) {
    for (int j = 0; j <= i; ++j) p.at(before + i, before + j) += -(rho * last_gram(i, j));
  }
  return p;
}

Matrix quadratic_lmi(const std::vector<Matrix>& stages, const Matrix& q, const std::vector<Dyadic>& t) {
  const int inputs = q.rows;
  Matrix p(inputs + static_cast<int>(t.size()), inputs + static_cast<int>(t.size()));
  for (int i = 0; i < inputs; ++i) {
    for (int j = 0; j < inputs; ++j) p(i, j) = q(i, j);
  }
  int before = 0, begin = inputs;
  for (std::size_t k = 0; k + 1 < stages.size(); ++k) {
    const Matrix& m = stages[k];
    for (int i = 0; i < m.rows; ++i) {
      const Dyadic& multiplier = t[begin - inputs + i];
      p(begin + i, begin + i) = Dyadic(2.0) * multiplier;
      for (int j = 0; j < m.cols; ++j) {
        p(begin + i, before + j) = -(multiplier * m(i, j));
        p(before + j, begin + i) = p(begin + i, before + j);
      }
    }
    before = begin;
    begin += m.rows;
  }
  const Matrix last_gram = row_gram(transposed(stages.back()));
  for (int i = 0; i < last_gram.rows; ++i) {
    for (int j = 0; j < last_gram.cols; ++j) p(before + i, before + j) += -last_gram(i, j);
  }
  return p;
}

bool BentChain::is_bent() const {
  return std::any_of(slopes.begin(), slopes.end(), [](const SlopeRange& range) {
    return range.low.sign() != 0 || (range.high - Dyadic(1.0)).sign() != 0;
  });
}

std::size_t BentChain::multipliers() const {
  if (groups.empty()) return slopes.size();
  std::size_t count = 0;
  for (std::size_t k = 0; k < groups.size(); ++k)
    count += static_cast<std::size_t>(groups[k] == 1 ? stages[k].rows : 2 * (stages[k].rows / groups[k]));
  return count;
}

namespace {

/// The multipliers of a chain, by neuron, and those of the sums of groups, by layer.
struct Multipliers {
  std::vector<Dyadic> own;
  std::vector<std::vector<Dyadic>> sums;
};

Multipliers spread(const BentChain& chain, const std::vector<Dyadic>& t) {
  if (chain.slopes.size() != hidden_neurons(chain.stages) || t.size() != chain.multipliers())
    throw std::invalid_argument("lipschitz_lmi: there is not one range of slopes per hidden neuron");
  if (chain.groups.empty()) return {t, {}};
  Multipliers result;
  auto next = t.begin();
  for (std::size_t k = 0; k < chain.groups.size(); ++k) {
    const int rows = chain.stages[k].rows, group = chain.groups[k];
    if (rows % group != 0) throw std::invalid_argument("lipschitz_lmi: a layer is no multiple of its group");
    for (int i = 0; i < rows; ++i) result.own.push_back(next[i / group]);
    next += rows / group;
    const auto past = group == 1 ? next : next + rows / group;
    result.sums.emplace_back(next, past);
    next = past;
  }
  return result;
}

/// Returns the matrix of the squares of the sums of a layer's groups, of what enters less of what leaves them, over the
/// variables that enter and those that leave the layer.
Matrix squares_of_sums(const Matrix& m, int group, const std::vector<Dyadic>& t) {
  const int groups = static_cast<int>(t.size());
  Matrix rows(groups, m.cols + m.rows);
  for (int i = 0; i < m.rows; ++i) {
    for (int j = 0; j < m.cols; ++j) rows(i / group, j) += m(i, j);
    rows(i / group, m.cols + i) = -1.0;
  }
  Matrix weighted = rows;
  for (int g = 0; g < groups; ++g)
    for (int j = 0; j < rows.cols; ++j) weighted(g, j) = t[static_cast<std::size_t>(g)] * rows(g, j);
  return product(transposed(rows), weighted);
}

void add_block(const Matrix& block, int at, Matrix& p) {
  for (int i = 0; i < block.rows; ++i)
    for (int j = 0; j < block.cols; ++j) p(at + i, at + j) += block(i, j);
}

}  // namespace

SymmetricMatrix lipschitz_lmi(const BentChain& chain, const Dyadic& rho, const std::vector<Dyadic>& stated) {
  const auto [t, sums] = spread(chain, stated);
  if (!chain.is_bent()) return lipschitz_lmi(chain.stages, rho, t);
  Matrix q(chain.stages.front().cols, chain.stages.front().cols);
  for (int i = 0; i < q.rows; ++i) q(i, i) = rho;
  std::vector<Matrix> weighted = chain.stages;  // a + b times each hidden row
  std::size_t next = 0;                         // the first neuron of a stage
  for (std::size_t k = 0; k + 1 < weighted.size(); ++k)
    for (int i = 0; i < weighted[k].rows; ++i, ++next)
      for (int j = 0; j < weighted[k].cols; ++j)
        weighted[k](i, j) = (chain.slopes[next].low + chain.slopes[next].high) * weighted[k](i, j);
  Matrix p = quadratic_lmi(weighted, q, t);
  int before = 0;  // index of the first variable that enters a stage
  next = 0;
  for (std::size_t k = 0; k + 1 < chain.stages.size(); ++k) {
    const Matrix& m = chain.stages[k];
    Matrix bent = m;  // 2 t a b times each row
    for (int i = 0; i < m.rows; ++i, ++next) {
      const Dyadic factor = Dyadic(2.0) * chain.slopes[next].low * chain.slopes[next].high * t[next];
      for (int j = 0; j < m.cols; ++j) bent(i, j) = factor * m(i, j);
    }
    add_block(product(transposed(m), bent), before, p);
    if (!sums.empty() && !sums[k].empty()) add_block(squares_of_sums(m, chain.groups[k], sums[k]), before, p);
    before += m.cols;
  }
  return p;
}

namespace {

/// Returns the least exponent of the entries of D P D and R R'.
long least_exponent(const SymmetricMatrix& p, const Factor& factor) {
  long least = 2 * factor.unit_exponent;
  for (int i = 0; i < p.size(); ++i)
    for (int j = p.first(i); j <= i; ++j)
      if (p.at(i, j).sign() != 0)
        least = std::min(least, p.at(i, j).exponent + factor.scale[i] + factor.scale[j]);
  return least;
}

}  // namespace

bool shows_positive_semidefinite(const SymmetricMatrix& p, const Factor& factor) {
  const auto size = static_cast<std::size_t>(p.size());
  if (factor.rows.size() != size || factor.scale.size() != size) return false;
  std::vector<int> first;  // column of the first entry of each row
  for (int i = 0; i < p.size(); ++i) first.push_back(i + 1 - static_cast<int>(factor.rows[i].size()));
  if (!std::all_of(first.begin(), first.end(), [](int column) { return column >= 0; })) return false;
  const IntegerRows r(factor.rows);
  const long unit = least_exponent(p, factor);
  std::vector<mpz_class> slack(size);  // E_ii - sum_{j != i} |E_ij|, in units of 2^unit
  mpz_class e, gram;
  for (int i = 0; i < p.size(); ++i) {
    for (int j = std::min(p.first(i), first[i]); j <= i; ++j) {
      e = 0;
      if (j >= p.first(i)) {
        const Dyadic& entry = p.at(i, j);
        if (entry.sign() != 0)
          e = entry.mantissa << static_cast<mp_bitcnt_t>(entry.exponent + factor.scale[i] + factor.scale[j] -
                                                         unit);
      }
      const int from = std::max(first[i], first[j]);
      if (from <= j) {
        gram = r.inner(i, from - first[i], r, j, from - first[j], j - from + 1);
        gram <<= static_cast<mp_bitcnt_t>(2 * factor.unit_exponent - unit);
        e -= gram;
      }
      if (i == j) {
        slack[i] += e;
        continue;
      }
      e = abs(e);
      slack[i] -= e;
      slack[j] -= e;
    }
  }
  return std::all_of(slack.begin(), slack.end(), [](const mpz_class& s) { return s >= 0; });
}

bool shows_positive_semidefinite(const SymmetricMatrix& p, const std::optional<Factor>& factor) {
  // proposed_factor() returns only factors that the test above has accepted.
  return factor ? shows_positive_semidefinite(p, *factor) : proposed_factor(p).has_value();
}

}  // namespace swarmcert::check
