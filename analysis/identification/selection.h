/// @file Which effects explain a residual: forward selection with swaps and removals, judged by cross-validation.
#pragma once

#include <array>
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
  double removal_share = 0.7;  ///< of `gain`: an effect that loses less than this is removed
  std::size_t support_records = 100, support_blocks = 5;
  /// What lowers the mean square of blocks left out by this much was predicted there from elsewhere: fewer will do.
  double plain_gain = 0.3;
  std::size_t plain_support_blocks = 2;
};

/// An effect with a theta of its grid.
struct Member {
  int candidate = 0, theta = 0;
  bool operator==(const Member& other) const { return candidate == other.candidate && theta == other.theta; }
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

class Selection {
 public:
  /// @param grams must outlive this.
  explicit Selection(const Grams& grams, Thresholds thresholds = {});

  /// Forward, swap and backward passes; the effects ordered().
  Members select() const;
  /// One step forward from `members`. Returns false where nothing is left to add.
  bool add_one(Members& members) const;
  /// Drops effects that have become needless.
  void prune(Members& members) const;
  /// First the effects that act in some places only, then those that act everywhere, which a wrong calibration looks
  /// like; of each, in the order in which they lower the error most.
  Members ordered(Members members) const;
  /// Cross-validated mean square of the vector residual, N^2. Infinite if it cannot be fitted.
  double mean_square(const Members& members) const;
  /// The theta of `candidate` that suits best beside `members`.
  Member best_theta(const Members& members, int candidate) const;
  Fit fit(const Members& members) const;
  /// Cross-validated squared error of each block, N^2.
  std::vector<double> block_errors(const Members& members) const;
  /// Cluster-robust, of the last member, on the scale of one coefficient: comparable whatever its number of columns.
  double wald(const Members& members) const;
  /// True where the data show that `added` belongs to `before`.
  bool is_acceptable(const Members& before, const Member& added) const;
  /// Enough blocks for an answer.
  bool is_sound() const { return grams_.blocks.size() >= kFewestBlocks; }
  /// Coefficients of the fits without one fold each.
  std::vector<Eigen::VectorXd> fold_coefficients(const Members& members) const;

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

 private:
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
  void divide(Folds& folds) const;
  const Folds& folds_for(const Members& members) const;
  double mean_square(const Members& members, const Folds& folds) const;
  std::vector<double> block_errors(const Members& members, const Folds& folds) const;
  std::vector<int> columns(const Members& members) const;
  Eigen::VectorXd solve(const Sum& sum, const Members& members) const;
  bool is_acceptable(const Members& before, const Member& added, double before_square, double after_square,
                     const Folds& folds) const;
  /// The last member is a lag or delay whose gain is at a bound.
  bool is_held(const Members& members) const;
  bool swap_one(Members& members) const;
  bool remove_one(Members& members) const;

  const Grams& grams_;
  const Thresholds thresholds_;
  Folds random_, by_flight_;
  bool has_flights_ = false;
  Sum total_;
};

}  // namespace swarmcert::identification
