#include "analysis/identification/scan/curve_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

namespace swarmcert::identification {
namespace {

constexpr int kFewestChunks = 20, kFewestScanFlights = 5;

using RowMajorXd = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void group_blocks(const ScanSamples& samples, int blocks_each, Chunks& chunks) {
  chunks.flight.clear();
  chunks.of_sample.clear();
  int last_block = -1, in_chunk = 0, last_flight = -1;
  for (std::size_t i = 0; i < samples.block.size(); ++i) {
    const int block = samples.block[i], flight = samples.flight[i];
    if (block != last_block) {
      if (flight != last_flight || in_chunk >= blocks_each) {
        chunks.flight.push_back(flight);
        in_chunk = 0;
      }
      ++in_chunk;
      last_block = block;
      last_flight = flight;
    }
    chunks.of_sample.push_back(chunks.count() - 1);
  }
}

double quantile_of(std::vector<float>& values, double p) {
  const auto k = static_cast<std::ptrdiff_t>(p * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

struct Hat {
  int index = -1;  ///< -1: unknown
  float upper = 0;
};

Hat hat_at(float value, const Knots& knots) {
  if (std::isnan(value)) return {};
  const auto last = static_cast<int>(knots.size()) - 1;
  const double place = (value - knots.front()) / (knots.back() - knots.front()) * last;
  const double inside = std::clamp(place, 0.0, static_cast<double>(last));
  const int index = std::min(static_cast<int>(inside), last - 1);
  return {index, static_cast<float>(inside - index)};
}

}  // namespace

Chunks chunks_of(const ScanSamples& samples) {
  Chunks chunks;
  group_blocks(samples, 2, chunks);
  if (chunks.count() < kFewestChunks) group_blocks(samples, 1, chunks);
  const bool by_flight = samples.flights >= kFewestScanFlights;
  std::vector<int> order;
  for (int c = 0; c < chunks.count(); ++c) order.push_back(c % Chunks::kFolds);
  std::mt19937_64 generator(1);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[generator() % i]);
  for (int c = 0; c < chunks.count(); ++c) {
    const auto k = static_cast<std::size_t>(c);
    chunks.fold.push_back(by_flight ? chunks.flight[k] % Chunks::kFolds : order[k]);
  }
  return chunks;
}

Knots knots_over(const Eigen::Ref<const Eigen::VectorXf>& values, int count) {
  constexpr double kTail = 0.01;
  std::vector<float> known;
  for (const float value : values) {
    if (std::isfinite(value)) known.push_back(value);
  }
  if (2 * static_cast<Eigen::Index>(known.size()) < values.size() || known.empty()) return {};
  const double lower = quantile_of(known, kTail), upper = quantile_of(known, 1 - kTail);
  if (!(upper - lower > 1e-5 * std::max({1e-2, std::abs(lower), std::abs(upper)}))) return {};
  Knots knots;
  for (int k = 0; k < count; ++k) knots.push_back(lower + (upper - lower) * k / (count - 1));
  return knots;
}

std::vector<SparseRow> hat_rows(const Eigen::Ref<const Eigen::VectorXf>& values, const Knots& knots) {
  std::vector<SparseRow> rows(static_cast<std::size_t>(values.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Hat hat = hat_at(values[static_cast<Eigen::Index>(i)], knots);
    if (hat.index < 0) continue;
    rows[i] = {{hat.index, hat.index + 1}, {1 - hat.upper, hat.upper}, 2};
  }
  return rows;
}

std::vector<SparseRow> hat_rows(const Eigen::Ref<const Eigen::VectorXf>& a, const Knots& a_knots,
                                const Eigen::Ref<const Eigen::VectorXf>& b, const Knots& b_knots) {
  std::vector<SparseRow> rows(static_cast<std::size_t>(a.size()));
  const auto width = static_cast<int>(b_knots.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Hat ha = hat_at(a[static_cast<Eigen::Index>(i)], a_knots);
    const Hat hb = hat_at(b[static_cast<Eigen::Index>(i)], b_knots);
    if (ha.index < 0 || hb.index < 0) continue;
    const int first = ha.index * width + hb.index;
    const float u = ha.upper, w = hb.upper;
    rows[i] = {{first, first + 1, first + width, first + width + 1},
               {(1 - u) * (1 - w), (1 - u) * w, u * (1 - w), u * w},
               4};
  }
  return rows;
}

CurveFit::CurveFit(const std::vector<SparseRow>& rows, int columns, const Chunks& chunks)
    : rows_(rows), chunks_(chunks), columns_(columns) {
  // A weak regularisation towards the constant, worth two samples, determines knots without samples.
  constexpr double kPull = 2;
  const int size = columns + 1;
  std::array<Eigen::MatrixXd, Chunks::kFolds> inside;
  for (Eigen::MatrixXd& gram : inside) gram = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const SparseRow& row = rows[i];
    Eigen::MatrixXd& gram =
        inside[static_cast<std::size_t>(chunks.fold[static_cast<std::size_t>(chunks.of_sample[i])])];
    gram(columns, columns) += 1;
    for (int a = 0; a < row.count; ++a) {
      const auto ka = static_cast<std::size_t>(a);
      gram(row.index[ka], columns) += row.weight[ka];
      for (int b = 0; b < row.count; ++b)
        gram(row.index[ka], row.index[static_cast<std::size_t>(b)]) +=
            row.weight[ka] * row.weight[static_cast<std::size_t>(b)];
    }
  }
  Eigen::MatrixXd& all = grams_[Chunks::kFolds];
  all = Eigen::MatrixXd::Zero(size, size);
  for (const Eigen::MatrixXd& gram : inside) all += gram;
  for (std::size_t f = 0; f <= Chunks::kFolds; ++f) {
    if (f < Chunks::kFolds) grams_[f] = all - inside[f];
    Eigen::MatrixXd pulled = grams_[f];
    pulled.row(columns).head(columns) = pulled.col(columns).head(columns).transpose();
    pulled.diagonal().head(columns).array() += kPull;
    pulled(columns, columns) += 1e-6;
    inverses_[f] = pulled.ldlt().solve(Eigen::MatrixXd::Identity(size, size));
  }
}

void CurveFit::fit(const Columns& targets) {
  const int size = columns_ + 1;
  std::array<RowMajorXd, Chunks::kFolds> inside;
  for (RowMajorXd& b : inside) b = RowMajorXd::Zero(size, targets.cols());
  Eigen::RowVectorXd values;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const SparseRow& row = rows_[i];
    RowMajorXd& b =
        inside[static_cast<std::size_t>(chunks_.fold[static_cast<std::size_t>(chunks_.of_sample[i])])];
    values = targets.row(static_cast<Eigen::Index>(i)).cast<double>();
    for (std::size_t a = 0; a < static_cast<std::size_t>(row.count); ++a)
      b.row(row.index[a]) += static_cast<double>(row.weight[a]) * values;
    b.row(columns_) += values;
  }
  RowMajorXd all = RowMajorXd::Zero(size, targets.cols());
  for (const RowMajorXd& b : inside) all += b;
  for (std::size_t f = 0; f < Chunks::kFolds; ++f) coefficients_[f] = inverses_[f] * (all - inside[f]);
  coefficients_[Chunks::kFolds] = inverses_[Chunks::kFolds] * all;
}

Columns CurveFit::predictions(const std::vector<SparseRow>& rows) const {
  Columns result(static_cast<Eigen::Index>(rows.size()), coefficients_[0].cols());
  std::array<RowMajorXd, Chunks::kFolds> coefficients;
  for (std::size_t f = 0; f < Chunks::kFolds; ++f) coefficients[f] = coefficients_[f];
  RowMajorXd sum(1, result.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const SparseRow& row = rows[i];
    const int fold = chunks_.fold[static_cast<std::size_t>(chunks_.of_sample[i])];
    const RowMajorXd& c = coefficients[static_cast<std::size_t>(fold)];
    sum.row(0) = c.row(columns_);
    for (std::size_t a = 0; a < static_cast<std::size_t>(row.count); ++a)
      sum.row(0) += static_cast<double>(row.weight[a]) * c.row(row.index[a]);
    result.row(static_cast<Eigen::Index>(i)) = sum.row(0).cast<float>();
  }
  return result;
}

Eigen::MatrixXd CurveFit::errors_of_flipped(const Columns& targets, const Eigen::MatrixXd& signs) const {
  // |t - X b|^2 = |t|^2 - 2 b' X' t + b' X' X b for each fold; flipped signs change only X' t, chunk by chunk.
  const auto draws = static_cast<std::size_t>(signs.rows());
  const Eigen::Index size = columns_ + 1, m = targets.cols();
  std::vector<std::array<RowMajorXd, Chunks::kFolds>> products(draws);  // X' t for each draw and fold
  for (auto& of_draw : products) of_draw.fill(RowMajorXd::Zero(size, m));
  RowMajorXd of_chunk = RowMajorXd::Zero(size, m);
  Eigen::RowVectorXd values, squares = Eigen::RowVectorXd::Zero(m);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const SparseRow& row = rows_[i];
    values = targets.row(static_cast<Eigen::Index>(i)).cast<double>();
    squares += values.cwiseAbs2();
    for (std::size_t a = 0; a < static_cast<std::size_t>(row.count); ++a)
      of_chunk.row(row.index[a]) += static_cast<double>(row.weight[a]) * values;
    of_chunk.row(columns_) += values;
    const int chunk = chunks_.of_sample[i];
    if (i + 1 < rows_.size() && chunks_.of_sample[i + 1] == chunk) continue;
    const auto fold = static_cast<std::size_t>(chunks_.fold[static_cast<std::size_t>(chunk)]);
    for (std::size_t d = 0; d < draws; ++d)
      products[d][fold] += signs(static_cast<Eigen::Index>(d), chunk) * of_chunk;
    of_chunk.setZero();
  }
  Eigen::MatrixXd errors = squares.replicate(signs.rows(), 1);
  for (std::size_t f = 0; f < Chunks::kFolds; ++f) {
    Eigen::MatrixXd gram = grams_[Chunks::kFolds] - grams_[f];
    gram.row(columns_) = gram.col(columns_).transpose();
    for (std::size_t d = 0; d < draws; ++d) {
      RowMajorXd others = RowMajorXd::Zero(size, m);
      for (std::size_t g = 0; g < Chunks::kFolds; ++g) {
        if (g != f) others += products[d][g];
      }
      const Eigen::MatrixXd b = inverses_[f] * others;
      errors.row(static_cast<Eigen::Index>(d)) +=
          b.cwiseProduct(gram * b - 2 * products[d][f]).colwise().sum();
    }
  }
  return errors;
}

Columns mean_predictions(const Columns& targets, const Chunks& chunks) {
  const Eigen::Index m = targets.cols();
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(Chunks::kFolds, m);
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(Chunks::kFolds);
  const auto fold_of = [&](Eigen::Index i) {
    return chunks.fold[static_cast<std::size_t>(chunks.of_sample[static_cast<std::size_t>(i)])];
  };
  for (Eigen::Index i = 0; i < targets.rows(); ++i) {
    sums.row(fold_of(i)) += targets.row(i).cast<double>();
    counts[fold_of(i)] += 1;
  }
  const Eigen::RowVectorXd all = sums.colwise().sum();
  Columns result(targets.rows(), m);
  for (Eigen::Index i = 0; i < targets.rows(); ++i) {
    const double others = std::max(counts.sum() - counts[fold_of(i)], 1.0);
    result.row(i) = ((all - sums.row(fold_of(i))) / others).cast<float>();
  }
  return result;
}

Eigen::MatrixXd chunk_errors(const Columns& targets, const Columns& predictions, const Chunks& chunks) {
  RowMajorXd errors = RowMajorXd::Zero(chunks.count(), targets.cols());
  for (Eigen::Index i = 0; i < targets.rows(); ++i) {
    errors.row(chunks.of_sample[static_cast<std::size_t>(i)]) +=
        (targets.row(i) - predictions.row(i)).cast<double>().cwiseAbs2();
  }
  return errors;
}

}  // namespace swarmcert::identification
