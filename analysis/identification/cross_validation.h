/// @file Fits of any set of effects, and their prediction of held-out blocks.
#pragma once

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "analysis/identification/block_grams.h"

namespace swarmcert::identification {

/// An effect with a theta of its grid.
struct Member {
  int candidate = 0, theta = 0;
  bool operator==(const Member& other) const { return candidate == other.candidate && theta == other.theta; }
  bool operator<(const Member& other) const {
    return candidate != other.candidate ? candidate < other.candidate : theta < other.theta;
  }
};
using Members = std::vector<Member>;

/// `members` without the one at `index`; with `added` at the end.
Members without(Members members, std::size_t index);
Members with(Members members, const Member& added);

/// A fit on all blocks.
struct Fit {
  Eigen::VectorXd coefficients;
  Eigen::MatrixXd covariance;  ///< see sandwich()
};

/// What was predicted once is remembered: the passes of a selection ask for the same again. For one thread at a time.
class CrossValidation {
 public:
  /// @param grams must outlive this.
  explicit CrossValidation(const Grams& grams);

  /// Cross-validated mean square of the vector residual, N^2. Infinite if it cannot be fitted.
  double mean_square(const Members& members) const;
  /// Cross-validated squared error of each block, N^2.
  std::vector<double> block_errors(const Members& members) const;
  /// Coefficients of the fits without one fold each.
  std::vector<Eigen::VectorXd> fold_coefficients(const Members& members) const;
  /// Coefficients of the fit on all blocks, within their bounds: factors of the columns. Of a lag or delay beside a
  /// thrust_ratio c that is its gain plus c, since the ratio acts on the thrust behind it: (1 + c) L T for a gain of 1.
  Eigen::VectorXd coefficients(const Members& members) const;
  Fit fit(const Members& members) const;
  /// `coefficients` as the model file has them: a lag or delay by its own gain.
  Eigen::VectorXd in_model(const Members& members, const Eigen::VectorXd& coefficients) const;
  /// Cluster-robust, of the last member, on the scale of one coefficient: comparable whatever its number of columns.
  double wald(const Members& members) const;

  const Grams& grams() const { return grams_; }
  const Candidate& candidate(const Member& member) const {
    return grams_.candidates[static_cast<std::size_t>(member.candidate)];
  }
  const Support& support(const Member& member) const {
    return grams_.support[static_cast<std::size_t>(member.candidate)][static_cast<std::size_t>(member.theta)];
  }
  /// True if an effect of the candidate's name is among `members`.
  bool is_present(const Members& members, int candidate) const;
  double records() const { return total_.records; }

 protected:
  static constexpr int kFolds = 5;
  struct Sum {
    Eigen::VectorXd gram, b;
    double y = 0;
    double records = 0;
  };
  /// A way to divide the blocks: at random, or by whole flights.
  struct Folds {
    std::vector<int> of_block;
    std::array<Sum, kFolds> inside, outside;
  };
  const Folds& folds_for(const Members& members) const;
  double mean_square(const Members& members, const Folds& folds) const;
  const std::vector<double>& block_errors(const Members& members, const Folds& folds) const;
  /// As block_errors(), about the mean residual of each track: what differs from flight to flight, as a trim does,
  /// takes no part.
  std::vector<double> trimmed_errors(const Members& members, const Folds& folds) const;

 private:
  /// What a prediction depends on: whether whole flights are left out, and of which effects it is.
  using Question = std::pair<bool, Members>;

  void divide(Folds& folds) const;
  double made_mean_square(const Members& members, const Folds& folds) const;
  std::vector<double> made_block_errors(const Members& members, const Folds& folds) const;
  std::vector<int> columns(const Members& members) const;
  Eigen::VectorXd solve(const Sum& sum, const Members& members) const;
  /// T of c = T c_model: ones on the diagonal, and where a stage of the thrust meets its scale.
  Eigen::MatrixXd from_model(const Members& members) const;

  const Grams& grams_;
  Folds random_, by_flight_;
  bool has_flights_ = false;
  Sum total_;
  mutable std::map<Question, double> mean_squares_;
  mutable std::map<Question, std::vector<double>> block_errors_;
};

}  // namespace swarmcert::identification
