/// @file Number types that state their guarantee. They do not convert into one another.
#pragma once

namespace swarmcert::lipschitz {

namespace detail {
/// A double with a meaning; `Tag` makes each meaning a type of its own.
template <class Tag>
class Guaranteed {
 public:
  constexpr explicit Guaranteed(double value) : value_(value) {}
  constexpr double value() const { return value_; }
  friend constexpr bool operator==(Guaranteed a, Guaranteed b) { return a.value_ == b.value_; }

 private:
  double value_;
};
}  // namespace detail

/// At least the true value, in exact arithmetic for the weights as stored.
using UpperBound = detail::Guaranteed<struct UpperBoundTag>;
/// At most the true value, in exact arithmetic for the weights as stored.
using LowerBound = detail::Guaranteed<struct LowerBoundTag>;
/// An approximation of the true value without any guarantee.
using Estimate = detail::Guaranteed<struct EstimateTag>;

/// lower <= true value <= upper.
struct Enclosure {
  LowerBound lower;
  UpperBound upper;
};

/// Result of checking a claim; inconclusive if it is neither proved nor refuted.
enum class Verdict { kProved, kRefuted, kInconclusive };

/// "proved", "refuted" or "inconclusive".
constexpr const char* name(Verdict verdict) {
  return verdict == Verdict::kProved ? "proved" : verdict == Verdict::kRefuted ? "refuted" : "inconclusive";
}

}  // namespace swarmcert::lipschitz
