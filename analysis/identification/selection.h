/// @file Which effects explain a residual: forward selection with swaps and removals, judged by cross-validation.
#pragma once

#include "analysis/identification/cross_validation.h"

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

/// True where the flights show `candidate` with `theta` in at least `blocks` blocks: where the effect counts as acting
/// (Effect::in_support), or where they carry its coefficient (telling_blocks): over the ground, flights that never come
/// near the floor see a strong effect from above.
bool is_supported(const Grams& grams, std::size_t candidate, std::size_t theta, std::size_t blocks,
                  const Thresholds& thresholds);

/// The passes over candidates, on top of the fits that judge them.
class Selection : public CrossValidation {
 public:
  /// @param grams must outlive this.
  explicit Selection(const Grams& grams, Thresholds thresholds = {})
      : CrossValidation(grams), thresholds_(thresholds) {}

  /// Forward, swap and backward passes; the effects ordered().
  /// @param names where to begin: effects that are known already
  Members select(const std::vector<std::string>& names = {}) const;
  /// One step forward from `members`. Returns false where nothing is left to add.
  bool add_one(Members& members) const;
  /// Drops effects that have become needless.
  void prune(Members& members) const;
  /// In the order in which they lower the error most; but one that acts in some places only comes before those that act
  /// everywhere, which a wrong calibration looks like, where it lowers the error by a quarter as much.
  Members ordered(Members members) const;
  /// The theta of `candidate` that suits best beside `members`.
  Member best_theta(const Members& members, int candidate) const;
  /// True where the data show that `added` belongs to `before`.
  bool is_acceptable(const Members& before, const Member& added) const;
  /// What of the cross-validated mean square goes away with the member at `index`: 0.1 for a tenth. Of a lag or delay,
  /// which has no mean, about the mean of each track.
  double loss_without(const Members& members, std::size_t index) const;
  /// Enough blocks for an answer.
  bool is_sound() const { return grams().blocks.size() >= kFewestBlocks; }

 private:
  bool is_acceptable(const Members& before, const Member& added, double before_square, double after_square,
                     const Folds& folds) const;
  std::vector<double> errors(const Members& members, const Folds& folds, bool trims) const;
  /// The candidate that `candidate` becomes where what it varies with stays the same; -1 if there is none.
  int plain_form(int candidate) const;
  /// Index of the candidate with this name; -1 if no candidate has it.
  int index_of(const char* name) const;
  /// Of a ceiling: about the mean of each track, beside a scale of the thrust, it lowers the error of blocks left out.
  bool is_shown_within_flights(const Members& before, const Member& added) const;
  /// Blocks that were left out prefer `after` by two standard errors, and by as much as an effect must gain.
  bool is_clearly_better(const Members& after, const Members& before) const;
  /// A formula of the scan (scan/formulas.h), which stands for whatever has no name.
  bool is_formula(const Member& member) const;
  /// A name stands unless the formula explains more by an eighth, or leaves less by a fifth, and blocks that were left
  /// out prefer it clearly.
  bool formula_wins(const Members& rest, const Member& formula, const Member& named) const;
  /// The last member is a lag or delay whose gain is at a bound.
  bool is_held(const Members& members) const;
  bool swap_one(Members& members) const;
  bool remove_one(Members& members) const;

  const Thresholds thresholds_;
};

}  // namespace swarmcert::identification
