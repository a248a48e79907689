/// @file Curves and maps over variables, fitted without one fold and judged on that fold.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "analysis/identification/scan/samples.h"

namespace swarmcert::identification {

/// Samples in chunks that are resampled, flipped and left out as a whole.
struct Chunks {
  std::vector<int> of_sample;
  std::vector<int> flight;  ///< of each chunk
  std::vector<int> fold;    ///< of each chunk
  static constexpr int kFolds = 5;

  int count() const { return static_cast<int>(flight.size()); }
};
/// Two blocks of 2 s make a chunk, one where there are fewer than 20; folds are flights where there are five.
Chunks chunks_of(const ScanSamples& samples);

/// Knots of one variable, ascending; outside them curves are constant.
using Knots = std::vector<double>;
/// `count` knots at equal distances over the middle 98 % of the values; empty where these are all alike or unknown.
Knots knots_over(const Eigen::Ref<const Eigen::VectorXf>& values, int count);

/// A row of a design matrix with at most four entries.
struct SparseRow {
  std::array<int, 4> index{};
  std::array<float, 4> weight{};
  int count = 0;
};
/// Rows of hat functions over one variable, or of their products over two. NaN gives an empty row.
std::vector<SparseRow> hat_rows(const Eigen::Ref<const Eigen::VectorXf>& values, const Knots& knots);
std::vector<SparseRow> hat_rows(const Eigen::Ref<const Eigen::VectorXf>& a, const Knots& a_knots,
                                const Eigen::Ref<const Eigen::VectorXf>& b, const Knots& b_knots);

/// [samples x columns], a sample's values side by side: every pass goes from sample to sample.
using Columns = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Fits of all columns of `targets` without one fold each, and of all samples. Each has a constant.
class CurveFit {
 public:
  /// @param rows must outlive this.
  CurveFit(const std::vector<SparseRow>& rows, int columns, const Chunks& chunks);
  /// Fits anew to other targets [samples x m].
  void fit(const Columns& targets);
  /// Of the fits without the fold that a sample lies in, [samples x m]. @param rows of another point of the samples
  Columns predictions(const std::vector<SparseRow>& rows) const;
  Columns predictions() const { return predictions(rows_); }
  /// [columns x m] without fold f; f = kFolds: of all samples.
  const Eigen::MatrixXd& coefficients(int fold) const {
    return coefficients_[static_cast<std::size_t>(fold)];
  }
  /// Sums of squared errors [draws x m] of fits to `targets` with other signs: chunk c counts signs(d, c) times. Every
  /// sample is predicted by the fit without its fold. One pass over the samples, however many draws.
  Eigen::MatrixXd errors_of_flipped(const Columns& targets, const Eigen::MatrixXd& signs) const;
  Eigen::VectorXd samples_at_columns() const { return grams_[Chunks::kFolds].diagonal(); }

 private:
  const std::vector<SparseRow>& rows_;
  const Chunks& chunks_;
  const int columns_;
  std::array<Eigen::MatrixXd, Chunks::kFolds + 1> grams_;  ///< without a fold; of all
  std::array<Eigen::MatrixXd, Chunks::kFolds + 1> inverses_;
  std::array<Eigen::MatrixXd, Chunks::kFolds + 1> coefficients_;
};

/// Predictions by the mean of the other folds.
Columns mean_predictions(const Columns& targets, const Chunks& chunks);

/// Sums of (target - prediction)^2, [chunks x columns].
Eigen::MatrixXd chunk_errors(const Columns& targets, const Columns& predictions, const Chunks& chunks);

}  // namespace swarmcert::identification
