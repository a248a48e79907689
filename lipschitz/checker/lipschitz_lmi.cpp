#include "lipschitz/checker/lipschitz_lmi.h"

#include <algorithm>

namespace swarmcert::check {
namespace {

Matrix transposed(const Matrix& a) {
  Matrix result(a.cols, a.rows);
  for (int i = 0; i < a.rows; ++i) {
    for (int j = 0; j < a.cols; ++j) result(j, i) = a(i, j);
  }
  return result;
}

}  // namespace

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c(a.rows, b.cols);
  for (int i = 0; i < a.rows; ++i) {
    for (int k = 0; k < a.cols; ++k) {
      if (a(i, k).sign() == 0) continue;
      for (int j = 0; j < b.cols; ++j) c(i, j) += a(i, k) * b(k, j);
    }
  }
  return c;
}

std::size_t hidden_neurons(const std::vector<Matrix>& stages) {
  std::size_t neurons = 0;
  for (std::size_t k = 0; k + 1 < stages.size(); ++k) neurons += static_cast<std::size_t>(stages[k].rows);
  return neurons;
}

Matrix lipschitz_lmi(const std::vector<Matrix>& stages, const Dyadic& rho, const std::vector<Dyadic>& t) {
  const std::size_t hidden = stages.size() - 1;
  const Matrix& first = stages.front();
  const Matrix& last = stages.back();
  if (hidden == 0) {
    Matrix p =
        first.rows <= first.cols ? product(first, transposed(first)) : product(transposed(first), first);
    for (Dyadic& entry : p.entries) entry = -entry;
    for (int i = 0; i < p.rows; ++i) p(i, i) += rho;
    return p;
  }
  Matrix p(static_cast<int>(t.size()), static_cast<int>(t.size()));
  for (int i = 0; i < p.rows; ++i) p(i, i) = Dyadic(2.0) * rho * t[i];

  const Matrix first_gram = product(first, transposed(first));
  for (int i = 0; i < first.rows; ++i) {
    for (int j = 0; j < first.rows; ++j) p(i, j) += -(t[i] * first_gram(i, j) * t[j]);
  }
  int before = 0;  // index of the first neuron of layer k - 1
  for (std::size_t k = 1; k < hidden; ++k) {
    const Matrix& m = stages[k];
    const int begin = before + m.cols;
    for (int i = 0; i < m.rows; ++i) {
      for (int j = 0; j < m.cols; ++j) {
        p(begin + i, before + j) = -(rho * t[begin + i] * m(i, j));
        p(before + j, begin + i) = p(begin + i, before + j);
      }
    }
    before = begin;
  }
  const Matrix last_gram = product(transposed(last), last);
  for (int i = 0; i < last.cols; ++i) {
    for (int j = 0; j < last.cols; ++j) p(before + i, before + j) += -(rho * last_gram(i, j));
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
  const Matrix last_gram = product(transposed(stages.back()), stages.back());
  for (int i = 0; i < last_gram.rows; ++i) {
    for (int j = 0; j < last_gram.cols; ++j) p(before + i, before + j) += -last_gram(i, j);
  }
  return p;
}

bool shows_positive_semidefinite(const Matrix& p, const Factor& factor) {
  const auto size = static_cast<std::size_t>(p.rows);
  if (factor.rows.size() != size || factor.scale.size() != size) return false;
  std::vector<int> first;  // column of the first entry of each row
  for (int i = 0; i < p.rows; ++i) first.push_back(i + 1 - static_cast<int>(factor.rows[i].size()));
  if (!std::all_of(first.begin(), first.end(), [](int column) { return column >= 0; })) return false;
  std::vector<Dyadic> slack(size);  // E_ii - sum_{j != i} |E_ij|
  for (int i = 0; i < p.rows; ++i) {
    for (int j = 0; j <= i; ++j) {
      mpz_class gram = 0;
      for (int k = std::max(first[i], first[j]); k <= j; ++k) {
        gram += factor.rows[i][k - first[i]] * factor.rows[j][k - first[j]];
      }
      Dyadic e = p(i, j);
      e.exponent += factor.scale[i] + factor.scale[j];
      e += Dyadic(-gram, 2 * factor.unit_exponent);
      if (i != j) e.mantissa = -abs(e.mantissa);
      slack[i] += e;
      if (i != j) slack[j] += e;
    }
  }
  return std::all_of(slack.begin(), slack.end(), [](const Dyadic& s) { return s.sign() >= 0; });
}

}  // namespace swarmcert::check
