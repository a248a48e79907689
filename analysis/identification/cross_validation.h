/// @file Fits of arbitrary sets of effects, and their predictions of held-out blocks.
#pragma once

#include <array>
#include <vector>

#include "analysis/identification/block_grams.h"

namespace swarmcert::identification {

/// An effect with one theta of its grid.
struct Member {
  int candidate = 0, theta = 0;
  bool operator==(const Member& other) const { return candidate == other.candidate && theta == other.theta; }
  bool operator<(const Member& other) const {
    return candidate != other.candidate ? candidate < other.candidate : theta < other.theta;
  }
};
using Members = std::vector<Member>;

/// Returns `members` without the one at `index`, or with `added` at the end.
Members without(Members members, std::size_t index);
Members with(Members members, const Member& added);

/// A fit to all blocks.
struct Fit {
  Eigen::VectorXd coefficients;
  Eigen::MatrixXd covariance;  ///< see sandwich()
};

/// Fits and cross-validates sets of effects.
class CrossValidation {
 public:
  /// @param grams must outlive this object
  explicit CrossValidation(const Grams& grams);

  /// Returns the cross-validated mean square of the residual vector, N^2; infinite if the members cannot be fitted.
  double mean_square(const Members& members) const;
  /// Returns the cross-validated squared error of each block, N^2.
  std::vector<double> block_errors(const Members& members) const;
  /// Sorts the effects such that each reduces the error more than the next would in its place.
  Members ordered(Members members) const;
  /// Returns the best theta of `candidate` beside `members`.
  Member best_theta(const Members& members, int candidate) const;
  /// Returns the coefficients of the fits that leave out one fold each.
  std::vector<Eigen::VectorXd> fold_coefficients(const Members& members) const;
  /// Returns the coefficients of the fit to all blocks, within their bounds, as factors of the columns. For a lag or
  /// delay beside a thrust_ratio c the coefficient is its gain plus c, because the ratio acts on the thrust after the
  /// lag: (1 + c) L T for a gain of 1.
  Eigen::VectorXd coefficients(const Members& members) const;
  Fit fit(const Members& members) const;
  /// Converts `coefficients` to those of the model file: a lag or delay has its own gain.
  Eigen::VectorXd in_model(const Members& members, const Eigen::VectorXd& coefficients) const;
  /// Returns the cluster-robust Wald statistic of the last member, on the scale of a single coefficient, so that it is
  /// comparable for any number of columns.
  double wald(const Members& members) const;

  const Grams& grams() const { return grams_; }
  const Candidate& candidate(const Member& member) const {
    return grams_.candidates[static_cast<std::size_t>(member.candidate)];
  }
  const Support& support(const Member& member) const {
    return grams_.support[static_cast<std::size_t>(member.candidate)][static_cast<std::size_t>(member.theta)];
  }
  double records() const { return total_.records; }

 private:
  static constexpr int kFolds = 5;
  struct Sum {
    Eigen::VectorXd gram, b;
    double y = 0;
    double records = 0;
  };
  /// A partition of the blocks: at random or by whole flights.
  struct Folds {
    std::vector<int> of_block;
    std::array<Sum, kFolds> inside, outside;
  };

  const Folds& folds_for(const Members& members) const;
  void divide(Folds& folds) const;
  std::vector<int> columns(const Members& members) const;
  Eigen::VectorXd solve(const Sum& sum, const Members& members) const;
  /// Returns T with c = T c_model: ones on the diagonal, and couplings between a stage of the thrust and its scale.
  Eigen::MatrixXd from_model(const Members& members) const;
  /// Returns whether the last member is a lag or delay whose gain is at a bound.
  bool is_held(const Members& members) const;

  const Grams& grams_;
  Folds random_, by_flight_;
  bool has_flights_ = false;
  Sum total_;
};

}  // namespace swarmcert::identification
