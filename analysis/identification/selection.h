/// @file Whether held-out blocks confirm an effect, by cross-validation.
#pragma once

#include "analysis/identification/cross_validation.h"

namespace swarmcert::identification {

/// Thresholds at which an effect is considered found. Sources: 80 closed-loop simulations and the published flights.
struct Thresholds {
  double gain = 0.02;   ///< smallest relative reduction of the cross-validated mean square
  double paired_z = 3;  ///< paired over blocks; or
  double wald_z = 3.5;  ///< cluster-robust, together with
  double least_paired_z = 1;
  std::size_t support_records = 100, support_blocks = 5;
  /// Fewer blocks are sufficient for an effect that reduces the mean square of held-out blocks by this much, because
  /// that is a successful prediction.
  double plain_gain = 0.3;
  std::size_t plain_support_blocks = 2;
};

/// Returns true if the flights show `candidate` with `theta` in at least `blocks` blocks: either blocks in which the
/// effect acts (Effect::in_support), or blocks that carry its coefficient (telling_blocks()). The latter matter, for
/// example, for the ground effect, which can be strong in flights that never come near the floor.
bool is_supported(const Grams& grams, std::size_t candidate, std::size_t theta, std::size_t blocks,
                  const Thresholds& thresholds);

/// Tests of effects beside others, based on the fits of CrossValidation.
class Selection : public CrossValidation {
 public:
  /// @param grams must outlive this object
  explicit Selection(const Grams& grams, Thresholds thresholds = {})
      : CrossValidation(grams), thresholds_(thresholds) {}

  /// Sorts the effects such that each reduces the error more than the next would in its place.
  Members ordered(Members members) const;
  /// Returns the best theta of `candidate` beside `members`.
  Member best_theta(const Members& members, int candidate) const;
  /// Returns true if the data support adding `added` to `before`.
  bool is_acceptable(const Members& before, const Member& added) const;
  /// Returns the fraction of the cross-validated mean square that the member at `index` removes: 0.1 for a tenth. For a
  /// lag or delay, which has no mean, the mean of each track is subtracted.
  double loss_without(const Members& members, std::size_t index) const;
  /// Returns whether there are enough blocks for an answer.
  bool is_sound() const { return grams().blocks.size() >= kFewestBlocks; }

 private:
  bool is_acceptable(const Members& before, const Member& added, double before_square, double after_square,
                     const Folds& folds) const;
  std::vector<double> errors(const Members& members, const Folds& folds, bool trims) const;
  /// Returns the index of the plain candidate of a family; -1 without one.
  int plain_of(stability::Family family) const;
  /// For an effect that only changes within flights show: returns whether it reduces the error of held-out blocks about
  /// the mean of each track, beside a thrust scale.
  bool is_shown_within_flights(const Members& before, const Member& added) const;
  /// Returns whether the last member is a lag or delay whose gain is at a bound.
  bool is_held(const Members& members) const;

  const Thresholds thresholds_;
};

}  // namespace swarmcert::identification
