/// @file Search for the set of explanations with the largest posterior probability.
///
/// For a set with columns X, prior N(mu, P^-1) and data y of variance 1,
///   ln p(y | set) = -1/2 (y - X c)'(y - X c) - 1/2 (c - mu)' P (c - mu) + 1/2 ln det P - 1/2 ln det H,
/// H = X'X + P, c = H^-1 (X'y + P mu), up to a constant of the data; where a coefficient has a sign, the probabilities
/// of the sign after and before the flights are added. Sets are compared by this number and ln p(set) alone. No set
/// explains everything, so the variance is that of what a set leaves, where this is more than 1.
#pragma once

#include <vector>

#include "analysis/identification/evidence/hypotheses.h"
#include "analysis/identification/evidence/whitened.h"

namespace swarmcert::evidence {

/// An explanation is added if the set gains odds of 128 : 1, removed if it gains less, and exchanged if it gains 4 : 1.
/// Effects are added before curves. A curve takes the place of an effect only if it shows another form.
inline constexpr double kNamed_bits = 7, kExchanged_bits = 2;
/// Forces are modelled to about a percent. Beside a set, a ten-thousandth of its evidence is thus none.
inline constexpr double kModelError = 1e-4;

using Set = std::vector<Item>;

struct Weighed {
  Set set;
  double score = 0;              ///< ln p(y | set) + ln p(set), nats
  double left = 0;               ///< (y - X c)'(y - X c) + (c - mu)' P (c - mu)
  Eigen::VectorXd coefficients;  ///< c, item by item
  Eigen::MatrixXd covariance;    ///< H^-1, times the variance of the noise
};

/// Something to add to a set.
struct Option {
  Item item;         ///< the best of its entry
  double score = 0;  ///< of the set with it, summed over the shapes and priors of the entry
};

class EvidenceSearch {
 public:
  /// @param all, data must outlive this object
  EvidenceSearch(const Hypotheses& all, const Whitened& data) : all_(all), data_(data) {}

  /// Takes a step to a better set: adds an effect, or removes or exchanges something, or adds a curve. Returns `now` if
  /// no step is better.
  Weighed next(const Weighed& now) const;
  /// Returns the effects that flights cannot tell from the item at `index`: those with which, in its place,
  /// the set loses less than kNamed_bits, whatever was likely before the flights; best first.
  std::vector<Option> instead_of(const Weighed& best, std::size_t index) const;
  /// Returns by how much the entry of the item at `index` raises the evidence of the set, in bits.
  double bits(const Weighed& best, std::size_t index) const;
  Weighed weigh(const Set& set) const;
  /// Returns whether a set with a curve, in the place of the effect at `index` or beside it, explains clearly
  /// more: it leaves a quarter less, or half as much if the curve is over the variable of the effect, for no drag is
  /// exactly linear; or if what it leaves is noise, it gains an eighth of the evidence for the effect.
  bool shows_form(const Weighed& named, std::size_t index, const Item& curve, const Weighed& free) const;
  /// Returns the size of one coefficient with which an item would raise the evidence of `set` by `bits` in 90 % of
  /// flights. With G = X'X of the item beside the set, the evidence rises as in weigh() by a quadratic function of the
  /// estimate, which scatters by 1/sqrt(G_kk) about the size. Signs of coefficients, worth up to a bit, are left out.
  double size_for(double bits, const Set& set, const Item& item, int coefficient) const;
  /// Returns whether an entry is neither in a set, nor excluded.
  bool may_add(const Set& set, std::size_t entry) const;
  /// Returns the columns of a set, item by item.
  std::vector<int> columns_of(const Set& set) const;
  /// Returns y - X c.
  Eigen::VectorXd left_by(const Weighed& found) const;
  /// Joins the priors of the items of a set.
  Prior prior_of(const Set& set) const;

 private:
  /// Returns X'X, without forming products of the last item with what is not in the set, and X'y.
  Normal normal_of(const Set& set) const;
  /// Returns the best shape and prior of an entry beside a set.
  Option option(const Set& set, std::size_t entry) const;
  /// Returns what may be added to a set, best first.
  std::vector<Option> options(const Set& set) const;
  /// Returns the variance of the noise, and ln p(y) up to a constant, beside a set that leaves this much.
  double noise_beside(double left) const;
  double log_likelihood(double left) const;
  /// Returns the bits by which an explanation has to raise the evidence of a set.
  double needed_bits(const Weighed& now) const;
  /// Returns whether something may be added to a set: a curve that takes the name or the evidence of an effect only if
  /// it shows another form.
  bool may_follow(const Weighed& now, const Option& added) const;
  /// Returns the set without the item at `index`, or with another in its place, if that is better.
  Set changed(const Weighed& now, std::size_t index) const;

  const Hypotheses& all_;
  const Whitened& data_;
};

}  // namespace swarmcert::evidence
