/// Values and slopes of activations on intervals: compared with known digits and with samples, and their tightness.
#include "lipschitz/checker/activation_bounds.h"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <string>

#include "lipschitz/checker/fixed_point.h"
#include "lipschitz/checker/proposed_factor.h"

namespace swarmcert::check {
namespace {

using files::Activation;

constexpr Activation kSmooth[] = {Activation::kTanh, Activation::kSigmoid, Activation::kSoftplus,
                                  Activation::kElu,  Activation::kSelu,    Activation::kSilu,
                                  Activation::kGelu};

double uniform(std::mt19937_64& generator, double low, double high) {
  return low + (high - low) * std::ldexp(static_cast<double>(generator() >> 11), -53);
}

mpq_class exact(const Dyadic& x) {
  mpq_class result(x.mantissa);
  if (x.exponent >= 0) result *= mpq_class(mpz_class(1) << static_cast<mp_bitcnt_t>(x.exponent));
  if (x.exponent < 0) result /= mpq_class(mpz_class(1) << static_cast<mp_bitcnt_t>(-x.exponent));
  return result;
}

/// Converts decimal digits such as "-0.9051..." to a fraction.
mpq_class decimal(const std::string& digits) {
  const std::size_t point = digits.find('.');
  mpz_class denominator;
  mpz_ui_pow_ui(denominator.get_mpz_t(), 10, digits.size() - point - 1);
  mpq_class result(mpz_class(digits.substr(0, point) + digits.substr(point + 1), 10), denominator);
  result.canonicalize();
  return result;
}

/// s(t) and s'(t) at t = -1.5, from the formulas of the statement with 60 digits of Python's decimal.
struct Digits {
  Activation activation;
  const char *value, *slope;
};
constexpr Digits kDigits[] = {
    {Activation::kTanh, "-0.9051482536448664382423036964564", "0.18070663892364853059744011374260"},
    {Activation::kSigmoid, "0.18242552380635634039278282134375", "0.14914645207033285650153341043401"},
    {Activation::kSoftplus, "0.20141327798275240949948280905709", "0.18242552380635634039278282134375"},
    {Activation::kElu, "-0.7768698398515701710667195292359", "0.22313016014842982893328047076401"},
    {Activation::kSelu, "-1.3658143533672526805134452703490", "0.39228498748012410132060631389551"},
    {Activation::kSilu, "-0.2736382857095345105891742320156", "-0.0412941542991429443595172943072"},
    {Activation::kGelu, "-0.1002108019032870990067410614698", "-0.1274691922299795254166552959522"}};

TEST(ActivationBounds, AreTheNextMultiplesAroundKnownDigits) {
  const Interval at = {-1.5, -1.5};
  const mpq_class value_unit = exact(Dyadic(1, kValueUnit)), slope_unit = exact(Dyadic(1, kSlopeUnit));
  for (const Digits& known : kDigits) {
    const Interval value = values_between(known.activation, at),
                   slopes = slopes_between(known.activation, at);
    const mpq_class digits = decimal(known.value), slope = decimal(known.slope);
    EXPECT_LE(exact(value.lower), digits) << known.value;
    EXPECT_GE(exact(value.upper), digits) << known.value;
    EXPECT_EQ(exact(value.upper) - exact(value.lower), value_unit) << known.value;
    EXPECT_LT(exact(slopes.lower), slope) << known.slope;
    EXPECT_GT(exact(slopes.upper), slope) << known.slope;
    EXPECT_EQ(exact(slopes.upper) - exact(slopes.lower), slope_unit) << known.slope;
  }
}

TEST(FixedPoint, EnclosesKnownDigitsFarBeyondDoubles) {
  const auto expect_near = [](const Fixed& x, const std::string& digits) {
    const mpq_class unit(1, mpz_class(1) << kFixedBits), known = decimal(digits);
    EXPECT_LE(mpq_class(x.lower) * unit, known + decimal("0.0000000000000000000000000000000000000001"));
    EXPECT_GE(mpq_class(x.upper) * unit, known - decimal("0.0000000000000000000000000000000000000001"));
    EXPECT_LT(mpq_class(x.upper - x.lower) * unit, exact(Dyadic(1, -200)));
  };
  expect_near(exp_of_minus(Fixed(Dyadic(1.0))), "0.3678794411714423215955237701614608674458");
  expect_near(log_of_one_plus(Fixed(Dyadic(1.0))), "0.6931471805599453094172321214581765680755");
  expect_near(normal_density(Fixed(Dyadic())), "0.3989422804014326779399460599343818684759");
  EXPECT_EQ(exp_of_minus(Fixed(Dyadic(1e6))).lower, 0);
  EXPECT_EQ(exp_of_minus(Fixed(Dyadic(1e6))).upper, 1);
}

TEST(ActivationBounds, ContainEverySampledValueAndSlopeOfAnInterval) {
  std::mt19937_64 generator(71);
  for (const Activation activation : kSmooth) {
    const files::ActivationFunction& function = files::function_of(activation);
    double widest_excess = 0;
    for (int i = 0; i < 400; ++i) {
      const double low = uniform(generator, -6, 5);
      const double high = low + std::exp2(uniform(generator, -6, 3));
      const Interval values = values_between(activation, {low, high}),
                     slopes = slopes_between(activation, {low, high});
      constexpr int kSteps = 64;
      constexpr double kRounding = 1e-14;
      double least = 9, greatest = -9, least_slope = 9, greatest_slope = -9, before = 0;
      for (int k = 0; k <= kSteps; ++k) {
        const double value = function.value(low + (high - low) * k / kSteps);
        least = std::min(least, value);
        greatest = std::max(greatest, value);
        if (k > 0) {
          const double slope = (value - before) * kSteps / (high - low);
          least_slope = std::min(least_slope, slope);
          greatest_slope = std::max(greatest_slope, slope);
        }
        before = value;
      }
      const std::string where = function.op + " " + std::to_string(low) + " " + std::to_string(high);
      EXPECT_LE(to_double(values.lower), least + kRounding) << where;
      EXPECT_GE(to_double(values.upper), greatest - kRounding) << where;
      const double slope_rounding = kRounding * kSteps / (high - low);
      EXPECT_LE(to_double(slopes.lower), least_slope + slope_rounding) << where;
      EXPECT_GE(to_double(slopes.upper), greatest_slope - slope_rounding) << where;
      widest_excess =
          std::max({widest_excess, least - to_double(values.lower), to_double(values.upper) - greatest,
                    least_slope - to_double(slopes.lower), to_double(slopes.upper) - greatest_slope});
    }
    const double jump =
        activation == Activation::kSelu ? 0.71 : 0;  // jump of the slope at 0, over which a sample averages
    EXPECT_LT(widest_excess, 0.12 + jump) << function.op << ": much wider than the sampled range";
  }
}

TEST(ActivationBounds, OfAPartLieWithinThoseOfTheWhole) {
  std::mt19937_64 generator(72);
  for (const Activation activation : kSmooth) {
    for (int i = 0; i < 300; ++i) {
      const double low = uniform(generator, -4, 3), high = low + uniform(generator, 0, 3);
      const double inner_low = uniform(generator, low, high),
                   inner_high = uniform(generator, inner_low, high);
      for (const auto bounds : {values_between, slopes_between}) {
        const Interval whole = bounds(activation, {low, high}),
                       part = bounds(activation, {inner_low, inner_high});
        EXPECT_TRUE(part.lower >= whole.lower && whole.upper >= part.upper)
            << files::function_of(activation).op << " " << low << " " << high;
      }
    }
  }
}

TEST(ActivationBounds, LieWithinTheSlopesOfAllInputsAndReachThem) {
  for (const Activation activation : kSmooth) {
    const files::ActivationFunction& function = files::function_of(activation);
    const Interval slopes = slopes_between(activation, {-1e300, 1e300});
    EXPECT_GE(to_double(slopes.lower), function.least_slope);
    EXPECT_LE(to_double(slopes.upper), function.greatest_slope);
    EXPECT_NEAR(to_double(slopes.lower), function.least_slope, 1e-7);
    EXPECT_NEAR(to_double(slopes.upper), function.greatest_slope, 1e-7);
  }
  // Far from 0, where an activation hardly changes, and where it is linear.
  EXPECT_EQ(to_double(slopes_between(Activation::kTanh, {40, 1e9}).upper), 0x1p-24);
  EXPECT_EQ(to_double(slopes_between(Activation::kElu, {0, 5}).lower), 1 - 0x1p-24);
  EXPECT_EQ(to_double(slopes_between(Activation::kRelu, {-5, 0}).upper), 0x1p-24);
  EXPECT_EQ(to_double(slopes_between(Activation::kRelu, {0, 5}).lower), 1 - 0x1p-24);
  EXPECT_EQ(to_double(slopes_between(Activation::kRelu, {0, 0}).lower), 0);
  EXPECT_EQ(to_double(slopes_between(Activation::kRelu, {0, 0}).upper), 0x1p-24);
  EXPECT_EQ(to_double(values_between(Activation::kSoftplus, {-1e9, 7}).lower), 0);
  EXPECT_THROW(slopes_between(Activation::kMaxMinPairs, {0, 1}), std::domain_error);
  EXPECT_THROW(values_between(Activation::kMaxMinPairs, {0, 1}), std::domain_error);
}

}  // namespace
}  // namespace swarmcert::check
