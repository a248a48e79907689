#include "lipschitz/checker/part_inequality.h"

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>
#include <numeric>

#include "lipschitz/checker/products.h"
#include "nn/base/doubles.h"

namespace swarmcert::check {
namespace {

using Row = std::vector<double>;

/// Bound on the absolute error of a product due to underflow, including flushing to zero.
constexpr double kLost = 0x1p-1000;

static_assert(std::numeric_limits<double>::is_iec559 && FLT_EVAL_METHOD == 0,
              "the error bounds here are those of IEEE double arithmetic");

Row absolute(const Row& values) {
  Row result(values.size());
  std::transform(values.begin(), values.end(), result.begin(), [](double x) { return std::abs(x); });
  return result;
}

}  // namespace

std::optional<Rounded> rounded(const Matrix& exact) {
  Rounded result(exact.rows, exact.cols);
  for (std::size_t i = 0; i < exact.entries.size(); ++i) {
    const Dyadic& x = exact.entries[i];
    signed long exponent = 0;
    const double fraction = mpz_get_d_2exp(&exponent, x.mantissa.get_mpz_t());  // truncates to 53 bits
    const long total = exponent + x.exponent;
    if (x.sign() == 0) continue;
    if (std::abs(total) > 900) return std::nullopt;
    result.value[i] = std::ldexp(fraction, static_cast<int>(total));
    result.radius[i] = 2 * kUnit * std::abs(result.value[i]) + 0x1p-900;
  }
  return result;
}

Rounded gram_of_form(const Row& q, const HiddenLayer& last) {
  const int rows = last.outputs, columns = last.inputs;
  const auto entry = [&](int i, int j) {
    const auto a = static_cast<std::size_t>(std::max(i, j)), b = static_cast<std::size_t>(std::min(i, j));
    return q[a * (a + 1) / 2 + b];
  };
  const double gamma = 1.01 * (rows + 2) * kUnit;
  Rounded half(rows, columns), result(columns, columns);  // Q W
  for (int i = 0; i < rows; ++i)
    for (int k = 0; k < rows; ++k) {
      const double* const w = &last.weights[static_cast<std::size_t>(k) * columns];
      const double factor = entry(i, k);
      for (int j = 0; j < columns; ++j) {
        half.at(i)[j] += factor * w[j];
        half.radius_at(i)[j] += 1.01 * gamma * std::abs(factor * w[j]) + kLost;
      }
    }
  for (int k = 0; k < rows; ++k) {
    const double* const w = &last.weights[static_cast<std::size_t>(k) * columns];
    for (int i = 0; i < columns; ++i)
      for (int j = 0; j < columns; ++j) {
        result.at(i)[j] += w[i] * half.at(k)[j];
        result.radius_at(i)[j] +=
            1.02 * std::abs(w[i]) * (half.radius_at(k)[j] + gamma * std::abs(half.at(k)[j])) + kLost;
      }
  }
  for (int i = 0; i < columns; ++i)  // the exact matrix is symmetric: one entry is used for both
    for (int j = 0; j < i; ++j) {
      result.at(j)[i] = result.at(i)[j];
      result.radius_at(j)[i] = result.radius_at(i)[j];
    }
  return result;
}

PartInequality::PartInequality(const LocalFunction& f, const Rounded& gram, const NeuronBounds& bounds,
                               const Row& form, const Row& t, const std::vector<const Conflict*>& conflicts)
    : f_(f), gram_(gram), bounds_(bounds), t_(t), moving_(static_cast<int>(f.coordinates.size())), z_(0, 0) {
  for (const Conflict* conflict : conflicts) factors_[conflict->first] = factors_[conflict->second] = {};
  int free = 0;
  for (std::size_t k = 0; k < f.hidden.size(); ++k)
    for (int i = 0; i < f.hidden[k].outputs; ++i)
      if (undecided(k, i)) ++free;
  n_ = moving_ + free;
  s_.assign(static_cast<std::size_t>(n_) * n_, 0.0);
  excess_.assign(s_.size(), 0.0);
  for (int i = 0; i < moving_; ++i)
    for (int j = 0; j <= i; ++j) s(i, j) = form[static_cast<std::size_t>(i) * moving_ + j];
  z_ = subtract_neurons();
  for (const Conflict* conflict : conflicts) subtract_conflict(*conflict);
  subtract_output();
}

bool PartInequality::is_positive_definite() {
  const Row d = scale();
  const double error = largest_error(d);
  double trace = 0;
  // Writes D S D to the upper triangle. It is exact except for underflow; overflow leads to a refusal.
  for (int i = 0; i < n_; ++i)
    for (int j = 0; j <= i; ++j)
      s(j, i) = s(i, j) * (d[static_cast<std::size_t>(i)] * d[static_cast<std::size_t>(j)]);
  for (int i = 0; i < n_; ++i) trace += std::abs(s(i, i));
  // The relative error of a sum of at most n nonnegative doubles is at most n u.
  const double shift = 1.001 * error + 1.01 * (n_ + 4) * kUnit * trace + 0x1p-900;
  if (!std::isfinite(shift)) return false;
  for (int i = 0; i < n_; ++i) s(i, i) = std::nextafter(s(i, i) - shift, -1e300);
  return cholesky_runs_through();
}

bool PartInequality::on(std::size_t k, int i) const {
  return !f_.hidden[k].has_relu(static_cast<std::size_t>(i)) ||
         bounds_.lower[k][static_cast<std::size_t>(i)] >= 0;
}

bool PartInequality::off(std::size_t k, int i) const {
  return f_.hidden[k].has_relu(static_cast<std::size_t>(i)) &&
         bounds_.upper[k][static_cast<std::size_t>(i)] <= 0;
}

/// Adds the terms of the neurons to S; returns dz of the last hidden layer as forms in the variables.
Rounded PartInequality::subtract_neurons() {
  Rounded z(0, 0);
  int variable = moving_;
  std::size_t neuron = 0;
  for (std::size_t k = 0; k < f_.hidden.size(); ++k) {
    const HiddenLayer& layer = f_.hidden[k];
    Rounded y = k == 0 ? first_layer() : next_layer(layer, k, z, variable);
    const int known = variable;  // y depends only on previous variables
    for (int i = 0; i < layer.outputs; ++i, ++neuron) {
      if (!undecided(k, i)) continue;
      const double t = t_.at(neuron);
      const double* const row = y.at(i);
      const double* const radius = y.radius_at(i);
      for (int j = 0; j < known; ++j) {
        const double product = t * row[j];
        s(variable, j) = -product;
        excess(variable, j) = 1.01 * (t * radius[j] + kUnit * std::abs(product)) + kLost;
      }
      s(variable, variable) = 2 * t;  // exact
      const auto wanted = factors_.find(neuron);
      if (wanted != factors_.end()) wanted->second = {variable, Row(row, row + n_), Row(radius, radius + n_)};
      std::fill(y.at(i), y.at(i) + n_, 0.0);
      std::fill(y.radius_at(i), y.radius_at(i) + n_, 0.0);
      y.at(i)[variable++] = 1;  // from here on the row is dz
    }
    for (int i = 0; i < layer.outputs; ++i) {
      if (!off(k, i) || on(k, i)) continue;
      std::fill(y.at(i), y.at(i) + n_, 0.0);
      std::fill(y.radius_at(i), y.radius_at(i) + n_, 0.0);
    }
    z = std::move(y);
  }
  return z;
}

/// Returns e_i, or a_i = dy_i - e_i. Exact except for dy_i, which does not depend on the neuron's own variable.
PartInequality::NeuronForms PartInequality::factor(NeuronForms forms, bool is_on) {
  if (is_on) {
    std::fill(forms.value.begin(), forms.value.end(), 0.0);
    std::fill(forms.radius.begin(), forms.radius.end(), 0.0);
  }
  forms.value[static_cast<std::size_t>(forms.variable)] = is_on ? 1 : -1;
  return forms;
}

std::vector<int> PartInequality::support(const NeuronForms& forms) {
  std::vector<int> result;
  for (std::size_t j = 0; j < forms.value.size(); ++j)
    if (forms.value[j] != 0 || forms.radius[j] != 0) result.push_back(static_cast<int>(j));
  return result;
}

/// S -= s (p q' + q p').
void PartInequality::subtract_conflict(const Conflict& conflict) {
  const NeuronForms p = factor(factors_.at(conflict.first), conflict.first_on);
  const NeuronForms q = factor(factors_.at(conflict.second), conflict.second_on);
  const std::vector<int> rows = support(p), columns = support(q);
  for (const int i : rows)
    for (const int j : columns) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      const double product = conflict.multiplier * (p.value[a] * q.value[b]);
      const double spread = std::abs(p.value[a]) * q.radius[b] + p.radius[a] * std::abs(q.value[b]) +
                            p.radius[a] * q.radius[b] + kLost;
      const int k = std::max(i, j), l = std::min(i, j);
      for (int times = i == j ? 2 : 1; times > 0; --times) {
        s(k, l) -= product;
        excess(k, l) += 1.01 * (std::abs(conflict.multiplier) * spread + 4 * kUnit * std::abs(product)) +
                        kUnit * std::abs(s(k, l)) + kLost;
      }
    }
}

Rounded PartInequality::first_layer() const {
  const HiddenLayer& layer = f_.hidden.front();
  Rounded y(layer.outputs, n_);
  for (int i = 0; i < layer.outputs; ++i)
    for (int j = 0; j < moving_; ++j) {
      const auto column = static_cast<std::size_t>(f_.coordinates[static_cast<std::size_t>(j)]);
      const double weight = f_.weight[static_cast<std::size_t>(j)];
      y.at(i)[j] = layer.weights[static_cast<std::size_t>(i) * layer.inputs + column] * weight;
      y.radius_at(i)[j] = weight == 1 ? 0 : 2 * kUnit * std::abs(y.at(i)[j]) + kLost;
    }
  return y;
}

/// Returns W z; rows of neurons that are off stay 0. The dz of an undecided neuron is a variable, so it needs no
/// product.
Rounded PartInequality::next_layer(const HiddenLayer& layer, std::size_t k, const Rounded& z,
                                   int known) const {
  Rounded y(layer.outputs, n_);
  const double gamma = 1.01 * (layer.inputs + 2) * kUnit;
  int variable = known;
  std::vector<int> own(static_cast<std::size_t>(layer.inputs), -1), on_inputs;
  for (int c = layer.inputs; c-- > 0;)
    if (undecided(k - 1, c)) own[static_cast<std::size_t>(c)] = --variable;
  Row spread(static_cast<std::size_t>(layer.inputs) * n_);  // error of one product with z, per |w|
  for (int c = 0; c < layer.inputs; ++c) {
    if (own[static_cast<std::size_t>(c)] >= 0 || !on(k - 1, c)) continue;
    on_inputs.push_back(c);
    double* const row = &spread[static_cast<std::size_t>(c) * n_];
    for (int j = 0; j < variable; ++j)
      row[j] = 1.01 * z.radius_at(c)[j] + gamma * std::abs(z.at(c)[j]) + kLost;
  }
  const Row sizes = absolute(layer.weights);
  for (int i = 0; i < layer.outputs; ++i) {
    if (off(k, i) && !on(k, i)) continue;
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(i) * layer.inputs;
    add_product(y.at(i), n_, 1, variable, {&layer.weights[static_cast<std::size_t>(first)], layer.inputs},
                {z.value.data(), n_}, on_inputs);
    add_product(y.radius_at(i), n_, 1, variable, {&sizes[static_cast<std::size_t>(first)], layer.inputs},
                {spread.data(), n_}, on_inputs);
    for (int j = 0; j < variable; ++j)  // for round-off of the radii themselves
      y.radius_at(i)[j] = on_inputs.empty() ? 0 : 1.01 * y.radius_at(i)[j] + layer.inputs * kLost;
    for (int c = 0; c < layer.inputs; ++c)  // exact: no other neuron of the previous layer has this variable
      if (own[static_cast<std::size_t>(c)] >= 0)
        y.at(i)[own[static_cast<std::size_t>(c)]] = layer.weights[static_cast<std::size_t>(first + c)];
  }
  return y;
}

/// S -= F' G F with F = dz of the last hidden layer, on the lower triangle. add_error_of_output() bounds the round-off.
void PartInequality::subtract_output() {
  const int rows = z_.rows;
  std::vector<int> all(static_cast<std::size_t>(rows)), some;
  std::iota(all.begin(), all.end(), 0);
  Row h(static_cast<std::size_t>(rows) * n_), minus_f(static_cast<std::size_t>(rows));  // G F
  add_product(h.data(), n_, rows, n_, {gram_.value.data(), gram_.cols}, {z_.value.data(), n_}, all);
  for (int i = 0; i < n_; ++i) {
    some.clear();
    for (int c = 0; c < rows; ++c) {
      minus_f[static_cast<std::size_t>(c)] = -z_.at(c)[i];
      if (z_.at(c)[i] != 0) some.push_back(c);
    }
    add_product(&s(i, 0), n_, 1, i + 1, {minus_f.data(), rows}, {h.data(), n_}, some);
  }
}

/// Powers of two d_i with d_i^2 near 1 / s_ii.
Row PartInequality::scale() const {
  Row d(static_cast<std::size_t>(n_), 1.0);
  for (std::size_t i = 0; i < d.size(); ++i) {
    const double diagonal = s_[i * (d.size() + 1)];
    if (diagonal > 0) d[i] = std::ldexp(1.0, -std::ilogb(diagonal) / 2);
  }
  return d;
}

/// Returns an upper bound on the largest row sum of D |S - true S| D, which bounds the norm of the difference.
double PartInequality::largest_error(const Row& d) const {
  Row sums(d.size(), 0.0);  // row sums, without the factor d_i
  const double total = std::accumulate(d.begin(), d.end(), 0.0);
  // Each entry of S is the sum of its previous value and one product per row of F.
  const double gamma = 1.01 * (z_.rows + 2) * kUnit;
  for (std::size_t i = 0; i < d.size(); ++i) {
    double sum = 0;
    for (std::size_t j = 0; j <= i; ++j) {
      const double error = excess_[i * d.size() + j] + gamma * std::abs(s_[i * d.size() + j]);
      sum += error * d[j];
      sums[j] += error * d[i];
    }
    sums[i] += sum + 4 * (z_.rows + 4) * kLost * total;
  }
  add_error_of_output(d, sums);
  double largest = 0;
  for (std::size_t i = 0; i < d.size(); ++i) {
    const double error = 1.01 * sums[i] * d[i];
    if (!(error <= largest)) largest = error;  // propagates NaN
  }
  return largest + static_cast<double>(d.size()) * 0x1p-1000;
}

/// Adds the row sums, weighted by d, of a bound on the error of F' G F. For F and G within r_F and r_G of the exact
/// matrices, the error is at most
///   |F|' (r_G + gamma M) |F| + |F|' M r_F + r_F' M |F| + r_F' M r_F,  M = |G| + r_G,
/// where gamma covers the round-off of G F, of F' (G F) and of the subtraction. The bound is symmetric like G, so an
/// entry computed for i >= j is used for both. Its weighted row sums are products with vectors.
void PartInequality::add_error_of_output(const Row& d, Row& sums) const {
  const int rows = z_.rows;
  const auto size = static_cast<std::size_t>(rows);
  const double gamma = 1.01 * (6 * rows + 20) * kUnit, total = std::accumulate(d.begin(), d.end(), 0.0);
  Row f(size), f_radius(size);  // |F| d and r_F d
  for (int c = 0; c < rows; ++c)
    for (int j = 0; j < n_; ++j) {
      f[static_cast<std::size_t>(c)] += std::abs(z_.at(c)[j]) * d[static_cast<std::size_t>(j)];
      f_radius[static_cast<std::size_t>(c)] += z_.radius_at(c)[j] * d[static_cast<std::size_t>(j)];
    }
  // Returns M x with M = |G| + r_G if `whole`, else r_G x.
  const auto times = [&](const Row& x, bool whole) {
    Row result(size);
    for (int i = 0; i < rows; ++i)
      for (int c = 0; c < rows; ++c)
        result[static_cast<std::size_t>(i)] +=
            ((whole ? std::abs(gram_.at(i)[c]) : 0) + gram_.radius_at(i)[c]) * x[static_cast<std::size_t>(c)];
    return result;
  };
  Row both(size);
  for (std::size_t c = 0; c < size; ++c) both[c] = f[c] + f_radius[c];
  const Row m_both = times(both, true), r_f = times(f, false), m_radius = times(f_radius, true);
  for (int c = 0; c < rows; ++c) {
    const auto k = static_cast<std::size_t>(c);
    const double by_f = r_f[k] + gamma * m_both[k] + m_radius[k] + (rows + 4) * kLost * total;
    for (int i = 0; i < n_; ++i)
      sums[static_cast<std::size_t>(i)] +=
          1.02 * (std::abs(z_.at(c)[i]) * by_f + z_.radius_at(c)[i] * m_both[k]);
  }
}

/// Factorises S = U' U on the upper triangle, row by row. Returns whether the factorisation succeeds.
bool PartInequality::cholesky_runs_through() {
  std::vector<int> before;
  Row factors(static_cast<std::size_t>(n_));
  for (int k = 0; k < n_; ++k) {
    before.clear();
    for (int i = 0; i < k; ++i) {
      factors[static_cast<std::size_t>(i)] = -s(i, k);
      if (s(i, k) != 0) before.push_back(i);
    }
    add_product(&s(k, k), n_, 1, n_ - k, {factors.data(), n_}, {&s(0, k), n_}, before);
    const double pivot = s(k, k);
    if (!(pivot > 0) || !std::isfinite(pivot)) return false;
    const double root = std::sqrt(pivot);
    double* const row = &s(k, 0);
    row[k] = root;
    for (int j = k + 1; j < n_; ++j) {
      row[j] /= root;
      if (!std::isfinite(row[j])) return false;
    }
  }
  return true;
}

}  // namespace swarmcert::check
