/// @file Which effects explain a residual: forward selection with swaps and removals, judged by cross-validation.
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "analysis/identification/block_grams.h"

namespace swarmcert::identification {

/// When an effect counts as found. Sources: measured on 80 closed-loop simulations and the published flights.
struct Thresholds {
  double gain = 0.02;   ///< least relative fall of the cross-validated mean square
  double paired_z = 3;  ///< paired over blocks; or
  double wald_z = 3.5;  ///< cluster-robust, together with
  double least_paired_z = 1;
  double swap_gain = 0.003;
  double removal_share = 0.7;     ///< of `gain`: an effect that loses less than this is removed
  double memory_tolerance = 0.3;  ///< lags and delays have gain 1; a fit further away is something else
  std::size_t support_records = 100, support_blocks = 5;
};

/// An effect with a theta of its grid.
struct Member {
  int candidate = 0, theta = 0;
  bool operator==(const Member& other) const { return candidate == other.candidate && theta == other.theta; }
};

/// A fit on all blocks.
struct Fit {
  Eigen::VectorXd coefficients;
  Eigen::MatrixXd covariance;  ///< sandwich, clustered by block
};

/// Everything known of a selected effect.
struct Finding {
  Member member;
  double rmse_before_N = 0, rmse_after_N = 0;  ///< cross-validated, of the vector
  std::pair<double, double> drop_interval;  ///< 90 % of the relative fall of the RMSE, by resampling blocks
  double paired_z = 0, wald_z = 0;
  Support support;
  std::vector<double> coefficients;
  std::vector<std::pair<double, double>> intervals;  ///< 90 %, statistical, one per coefficient
  std::vector<std::string> confounded_with;          ///< candidates that these data cannot tell from it
  std::vector<std::pair<double, double>>
      model_form;  ///< spread of each coefficient over the fits with a rival added
};

/// The smallest effect that these data would have shown in 90 % of cases.
struct Detectable {
  std::string effect, parameter;
  double size = 0;         ///< infinite where no size within the physical bounds would be seen
  std::string excitation;  ///< what to fly to see smaller ones
};

class Selection {
 public:
  /// @param grams must outlive this.
  Selection(const Grams& grams, Thresholds thresholds = {});

  /// Forward, swap and backward passes; the effects in the order in which they lower the error most.
  std::vector<Member> select() const;
  /// Cross-validated mean square of the vector residual, N^2. Infinite if it cannot be fitted.
  double mean_square(const std::vector<Member>& members) const;
  /// The theta of `candidate` that suits best beside `members`.
  Member best_theta(const std::vector<Member>& members, int candidate) const;
  Fit fit(const std::vector<Member>& members) const;
  std::vector<Finding> findings(const std::vector<Member>& members) const;
  std::vector<Detectable> detectable(const std::vector<Member>& members) const;
  bool is_sound() const { return grams_.blocks.size() >= 10; }

 private:
  static constexpr int kFolds = 5;
  struct Sum {
    Eigen::VectorXd gram, b;
    double y = 0;
    double records = 0;
  };
  std::vector<int> columns(const std::vector<Member>& members) const;
  Eigen::MatrixXd sub_gram(const Eigen::VectorXd& packed, const std::vector<int>& columns) const;
  Eigen::VectorXd solve(const Sum& sum, const std::vector<Member>& members) const;
  std::array<Eigen::VectorXd, kFolds> fold_fits(const std::vector<Member>& members) const;
  std::vector<double> block_errors(const std::vector<Member>& members) const;
  double wald(const std::vector<Member>& members) const;
  bool is_acceptable(const std::vector<Member>& before, const Member& added, double before_square,
                     double after_square) const;
  bool add_one(std::vector<Member>& members) const;
  bool swap_one(std::vector<Member>& members) const;
  bool remove_one(std::vector<Member>& members) const;

  const Grams& grams_;
  const Thresholds thresholds_;
  std::vector<int> fold_;  ///< by block
  std::array<Sum, kFolds> folds_;
  Sum total_;
};

}  // namespace swarmcert::identification
