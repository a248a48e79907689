#include "lipschitz/checker/bounds.h"

#include <gtest/gtest.h>

#include <type_traits>

namespace swarmcert::lipschitz {
namespace {

template <class From, class To>
constexpr bool kMixes =
    std::is_convertible_v<From, To> || std::is_assignable_v<To&, From> || std::is_constructible_v<To, From>;

TEST(BoundTypes, UpperLowerAndEstimateCannotBeMixedUp) {
  static_assert(!kMixes<UpperBound, LowerBound> && !kMixes<LowerBound, UpperBound>);
  static_assert(!kMixes<Estimate, UpperBound> && !kMixes<Estimate, LowerBound>);
  static_assert(!kMixes<UpperBound, Estimate> && !kMixes<LowerBound, Estimate>);
  static_assert(!std::is_convertible_v<double, UpperBound>,
                "a plain number does not become a bound by accident");
  static_assert(!std::is_convertible_v<UpperBound, double>, "a bound does not lose its meaning by accident");
  static_assert(std::is_copy_assignable_v<UpperBound>, "the checks above can fail");
}

}  // namespace
}  // namespace swarmcert::lipschitz
