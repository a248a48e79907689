/// @file Search for the set of explanations with the largest posterior probability.
///
/// Data and columns, whitened, are projected on an orthonormal basis of the instruments: some hundred numbers per axis,
/// in which a disturbance is noise and the vehicle's answer to it has no part. The noise is estimated from the rest of
/// the data, which no effect of the set points reaches. For a set with columns X, prior N(mu, P^-1) and data y of
/// variance 1,
///   ln p(y | set) = -1/2 (y - X c)'(y - X c) - 1/2 (c - mu)' P (c - mu) + 1/2 ln det P - 1/2 ln det H,
/// H = X'X + P, c = H^-1 (X'y + P mu), up to a constant of the data; where a coefficient has a sign, the probabilities
/// of the sign after and before the flights are added. Sets are compared by this number and ln p(set) alone.
#pragma once

#include <vector>

#include "analysis/identification/evidence/hypotheses.h"

namespace swarmcert::evidence {

/// An explanation is added if the set gains odds of 128 : 1, exchanged if it gains 4 : 1, and removed if the set gains
/// anything without it. Effects are added before curves; a curve takes the place of an effect with the former odds:
/// below, flights cannot tell them apart.
inline constexpr double kNamed_bits = 7, kExchanged_bits = 2;

using Set = std::vector<Item>;

struct Weighed {
  Set set;
  double score = 0;              ///< ln p(y | set) + ln p(set), nats
  Eigen::VectorXd coefficients;  ///< c, item by item
  Eigen::MatrixXd covariance;    ///< H^-1
};

/// Something to add to a set.
struct Option {
  Item item;         ///< the best of its entry
  double score = 0;  ///< of the set with it, summed over the shapes and scales of the entry
};

class EvidenceSearch {
 public:
  /// @param all with instruments; must outlive this object
  explicit EvidenceSearch(const Hypotheses& all);

  /// Returns the best set, by forward steps with removals and exchanges.
  Weighed best() const;
  /// Returns the effects that flights cannot tell from the item at `index` of best(): those with which, in its place,
  /// the set loses less than kNamed_bits; best first.
  std::vector<Option> instead_of(const Weighed& best, std::size_t index) const;

 private:
  /// Projects data and columns along each axis, [numbers x (columns, data)].
  /// @param power of the noise, by band of the axis
  Eigen::MatrixXd projected(std::size_t axis, const Eigen::VectorXd& power) const;
  Weighed weigh(const Set& set) const;
  /// Returns what may be added to a set, best first.
  std::vector<Option> options(const Set& set) const;
  /// Removes and exchanges items while the score rises.
  Weighed improved(Weighed now) const;
  /// Removes or replaces the item at `index` if that raises the score, and returns the result.
  Weighed changed(const Weighed& now, std::size_t index) const;

  const Hypotheses& all_;
  Eigen::MatrixXd columns_;  ///< [numbers x columns]
  Eigen::VectorXd data_;
};

}  // namespace swarmcert::evidence
