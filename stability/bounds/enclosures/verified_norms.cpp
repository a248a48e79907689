#include "stability/bounds/enclosures/verified_norms.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "nn/base/doubles.h"
#include "stability/bounds/enclosures/contracting_system.h"
#include "stability/bounds/enclosures/enclosed_state.h"
#include "stability/bounds/enclosures/local_polynomial.h"
#include "stability/bounds/enclosures/verified_delay.h"

namespace swarmcert::stability {
namespace {

class Enclosure {
 public:
  explicit Enclosure(const ContractingSystem& system)
      : system_(system),
        length_(kShare / norm_above(system.A)),
        step_(system.A, length_, kShare * (1 + 1e-12)) {
    for (std::size_t r = 0; r < 4; ++r) {
      taylor_[r][0] = system.rows[r];
      for (std::size_t k = 1; k <= kLocalTerms; ++k) {
        taylor_[r][k] = taylor_[r][k - 1] * system.A;
        for (Interval& x : taylor_[r][k]) x = x / Interval(static_cast<double>(k));
      }
      row_norm_[r] = norm_above(taylor_[r][0]);
      remainder_norm_[r] = norm_above(taylor_[r][kLocalTerms]);
    }
  }

  /// @param y index of the row of h': 2 with an integral, where the system's response is h; 1 without.
  /// @param settled limit of h.
  VerifiedNorms run(std::size_t y, Interval settled) {
    EnclosedState state(system_.b);
    double size = state.largest_norm();
    const double first = size;
    VerifiedNorms norms;
    AbsoluteIntegral rate;
    AbsoluteIntegral amplitude;
    double best_value = 0;
    double best_slope = 0;
    for (long step = 0; size > std::max(1e-13 * first, 1e3 * state.error) && step < 4'000'000; ++step) {
      std::array<LocalPolynomial, 4> local;
      for (std::size_t r = 0; r < 4; ++r) {
        for (std::size_t k = 0; k < kLocalTerms; ++k) local[r].c[k] = dot(taylor_[r][k], state.w);
        local[r].remainder = up(remainder_norm_[r] * size * (1 + 1e-12));
        local[r].error = up(row_norm_[r] * state.error);
      }
      local[y - 1].c[0] += settled;
      if (y == 2) rate.add(local[1], local[0], 0, length_, kLocalDepth);
      amplitude.add(local[y], local[y - 1], 0, length_, kLocalDepth);
      raise_supremum(local[y - 1], local[y], 0, length_, kLocalDepth, best_value, norms.edge);
      raise_supremum(local[y], local[y + 1], 0, length_, kLocalDepth, best_slope, norms.impulse);
      state.advance(step_);
      size = state.largest_norm();
    }
    const double tail = up(size / system_.alpha);
    norms.rate = y == 2 ? rate.finish() + Interval(0, up(row_norm_[1] * tail)) : Interval(kInfinity);
    norms.amplitude = amplitude.finish() + Interval(0, up(row_norm_[y] * tail));
    norms.edge = {std::max(norms.edge.lower, settled.mig()),
                  std::max(norms.edge.upper, up(settled.mag() + up(row_norm_[y - 1] * size)))};
    norms.impulse = {norms.impulse.lower, std::max(norms.impulse.upper, up(row_norm_[y] * size))};
    return norms;
  }

 private:
  static constexpr double kShare = 0.25;  ///< |A| times the length of a step

  const ContractingSystem& system_;
  double length_;
  EnclosedStep step_;
  std::array<std::array<IntervalVector, kLocalTerms + 1>, 4> taylor_;
  std::array<double, 4> row_norm_{};
  std::array<double, 4> remainder_norm_{};
};

IntervalVector intervals(const Polynomial& p) { return IntervalVector(p.begin(), p.end()); }

/// Returns denominator + feedback times the first `order` + 1 terms of e^(-Ts).
IntervalVector with_expanded_delay(const TransferFunction& y, std::size_t order) {
  IntervalVector result = intervals(y.denominator);
  Interval term = 1;
  for (std::size_t j = 0; j <= order; ++j) {
    if (j > 0) term = -(term * Interval(y.delay_s) / Interval(static_cast<double>(j)));
    for (std::size_t i = 0; i < y.feedback.size(); ++i) result[i + j] += term * Interval(y.feedback[i]);
  }
  return result;
}

/// Returns an upper bound on |feedback/denominator (e^(-Ts) - its expansion)|_1; see verified_norms().
double rest_of_delay(const TransferFunction& y, std::size_t order, const IntervalVector& denominator) {
  IntervalVector numerator = intervals(y.feedback);
  numerator.insert(numerator.begin(), order, Interval(0));
  const std::optional<ContractingSystem> system = contracting(numerator, denominator);
  if (!system) return kInfinity;
  Interval weight = 1;  // T^(order + 1)/(order + 1)!
  for (std::size_t j = 1; j <= order + 1; ++j) {
    weight = weight * Interval(y.delay_s) / Interval(static_cast<double>(j));
  }
  const Interval jump =
      numerator.size() + 1 == denominator.size() ? abs(numerator.back() / denominator.back()) : Interval(0);
  return (weight * (jump + Enclosure(*system).run(2, Interval(0)).amplitude)).upper;
}

/// Returns the norms of the loop whose characteristic polynomial is `denominator`.
std::optional<VerifiedNorms> norms_over(const TransferFunction& y, const IntervalVector& denominator,
                                        bool integrates) {
  const std::optional<ContractingSystem> system = contracting(intervals(y.numerator), denominator);
  if (!system) return std::nullopt;
  if (integrates) return Enclosure(*system).run(2, Interval(0));
  return Enclosure(*system).run(1, Interval(y.numerator[0]) / Interval(y.feedback[0]));
}

VerifiedNorms times(VerifiedNorms norms, Interval factor) {
  for (const auto gain : kVerifiedGains) {
    if (std::isfinite((norms.*gain).upper)) norms.*gain = norms.*gain * factor;
  }
  return norms;
}

/// @param integrates true: y is the response to a step; false: that to an impulse.
std::optional<VerifiedNorms> norms_of(const TransferFunction& y, bool integrates) {
  if (y.delay_s == 0) return norms_over(y, intervals(sum(y.denominator, y.feedback)), integrates);
  // A delay that is short compared with the slowest mode takes many steps, but its expansion may be accurate.
  constexpr long kFewPieces = 30'000;
  constexpr long kMostPieces = 400'000;
  constexpr double kSharp = 1e-3;
  if (const auto norms = norms_by_steps(y, integrates, kFewPieces)) return norms;
  std::size_t order = y.denominator.size() - y.feedback.size();
  IntervalVector denominator;
  double rest = kInfinity;
  while (order-- > 0 && !(rest < kSharp)) {
    IntervalVector expanded = with_expanded_delay(y, order);
    const double missed = rest_of_delay(y, order, expanded);
    if (missed < rest) rest = missed, denominator = std::move(expanded);
  }
  if (!(rest < kSharp)) {
    if (const auto norms = norms_by_steps(y, integrates, kMostPieces)) return norms;
  }
  if (!(rest < 1)) return std::nullopt;
  std::optional<VerifiedNorms> norms = norms_over(y, denominator, integrates);
  if (!norms) return std::nullopt;
  const Interval more = Interval(1) / (Interval(1) - Interval(rest));
  const Interval less = Interval(1) / (Interval(1) + Interval(rest));
  for (const auto gain : kVerifiedGains) {
    Interval& x = *norms.*gain;
    if (std::isfinite(x.upper)) x = {(x * less).lower, (x * more).upper};
  }
  norms->delay_gain = rest;
  return norms;
}

}  // namespace

std::optional<VerifiedNorms> verified_norms(const AxisLoop& loop, Channel channel) {
  const bool integrates = loop.Ki > 0;
  return norms_of(integrates ? step_transfer(loop, channel) : impulse_transfer(loop, channel), integrates);
}

std::optional<VerifiedNorms> verified_norms(const AxisLoop& loop, Estimate estimate) {
  if (estimate == Estimate::kPosition) return norms_of(position_error_transfer(loop), false);
  std::optional<VerifiedNorms> norms = verified_norms(loop, Channel::kCommand);
  return norms ? std::optional(times(*norms, Interval(loop.mass_kg) * Interval(loop.Kd))) : std::nullopt;
}

}  // namespace swarmcert::stability
