/// @file Curves and maps over variables, fitted without one fold and evaluated on that fold.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "analysis/identification/scan/samples.h"

namespace swarmcert::identification {

/// Partition of the samples into chunks that are resampled, sign-flipped and left out as a whole.
struct Chunks {
  std::vector<int> of_sample;
  std::vector<int> flight;  ///< of each chunk
  std::vector<int> fold;    ///< of each chunk
  static constexpr int kFolds = 5;

  int count() const { return static_cast<int>(flight.size()); }
};
/// Returns chunks of two blocks of 2 s, or of one block if there are fewer than 20; folds are flights if there are five
/// or more.
Chunks chunks_of(const ScanSamples& samples);

/// Knots of one variable, ascending; curves are constant outside them.
using Knots = std::vector<double>;
/// Returns `count` equidistant knots over the middle 98 % of the values; empty if these are all equal or unknown.
Knots knots_over(const Eigen::Ref<const Eigen::VectorXf>& values, int count);

/// A row of a design matrix with at most four entries.
struct SparseRow {
  std::array<int, 4> index{};
  std::array<float, 4> weight{};
  int count = 0;
};
/// Returns rows of hat functions over one variable, or of their products over two. NaN gives an empty row.
std::vector<SparseRow> hat_rows(const Eigen::Ref<const Eigen::VectorXf>& values, const Knots& knots);
std::vector<SparseRow> hat_rows(const Eigen::Ref<const Eigen::VectorXf>& a, const Knots& a_knots,
                                const Eigen::Ref<const Eigen::VectorXf>& b, const Knots& b_knots);

/// [samples x columns]; row major, because all passes go from sample to sample.
using Columns = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Fits of all columns of `targets` without each fold, and to all samples. Each fit includes a constant.
class CurveFit {
 public:
  /// @param rows must outlive this object
  CurveFit(const std::vector<SparseRow>& rows, int columns, const Chunks& chunks);
  /// Fits to other targets [samples x m].
  void fit(const Columns& targets);
  /// Returns the predictions of each sample by the fit without its fold, [samples x m].
  /// @param rows the samples' rows, or rows at other points
  Columns predictions(const std::vector<SparseRow>& rows) const;
  Columns predictions() const { return predictions(rows_); }
  /// Returns [columns x m] without fold f; f = kFolds: of all samples.
  const Eigen::MatrixXd& coefficients(int fold) const {
    return coefficients_[static_cast<std::size_t>(fold)];
  }
  /// Returns sums of squared errors [draws x m] of fits to `targets` with flipped signs: chunk c is multiplied by
  /// signs(d, c). Each sample is predicted by the fit without its fold. Takes a single pass for any number of draws.
  Eigen::MatrixXd errors_of_flipped(const Columns& targets, const Eigen::MatrixXd& signs) const;
  Eigen::VectorXd samples_at_columns() const { return grams_[Chunks::kFolds].diagonal(); }

 private:
  const std::vector<SparseRow>& rows_;
  const Chunks& chunks_;
  const int columns_;
  std::array<Eigen::MatrixXd, Chunks::kFolds + 1> grams_;  ///< without each fold; of all samples
  std::array<Eigen::MatrixXd, Chunks::kFolds + 1> inverses_;
  std::array<Eigen::MatrixXd, Chunks::kFolds + 1> coefficients_;
};

/// Returns predictions by the mean of the other folds.
Columns mean_predictions(const Columns& targets, const Chunks& chunks);

/// Returns sums of (target - prediction)^2, [chunks x columns].
Eigen::MatrixXd chunk_errors(const Columns& targets, const Columns& predictions, const Chunks& chunks);

}  // namespace swarmcert::identification
